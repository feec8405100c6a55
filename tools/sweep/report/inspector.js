// Calibration, and the variograms of regions.

function meanReliability(list) {
  const mean = (get) => list.reduce((sum, r) => sum + get(r), 0) / list.length;
  const rootMeanSquare = (get) => Math.sqrt(mean((r) => get(r) ** 2));
  const bins = Math.min(...list.map((r) => r.bins.length));
  return {
    bins: Array.from({ length: bins }, (_, i) => [rootMeanSquare((r) => r.bins[i][0]), rootMeanSquare((r) => r.bins[i][1])]),
    scores: list[0].scores.map((_, i) => mean((r) => r.scores[i])),
    coverage: list[0].coverage.map((_, i) => mean((r) => r.coverage[i])),
    certain: mean((r) => r.certain), beyond: mean((r) => r.below + r.above),
    withinOne: mean((r) => r.withinOne), withinTwo: mean((r) => r.withinTwo),
    meanScore: mean((r) => r.meanScore), meanSquareScore: mean((r) => r.meanSquareScore),
  };
}

function startCalibration(data) {
  const settings = shownSettings(data).filter((s) => s.reliability.length > 0);
  if (settings.length === 0) {
    $('calibration').replaceChildren(make('h2', {}, 'Calibration: predicted against actual error'),
      make('p', { class: 'note' }, data.reference ? 'No method wrote an error map.' : 'Without a reference there is no actual error to compare with.'));
    return;
  }
  $('calibrated').append(...settings.map((s, i) => make('option', { value: i }, settingName(s))));
  const preferred = settings.findIndex((s) => s.method !== 'mean' && s.setting === data.detail);
  $('calibrated').value = Math.max(preferred, 0);
  const update = () => drawCalibration(meanReliability(settings[+$('calibrated').value].reliability));
  $('calibrated').addEventListener('change', update);
  update();
  const rows = settings.map((s) => {
    const r = meanReliability(s.reliability);
    return make('tr', {}, make('td', {}, settingName(s)), make('td', {}, `${digits(100 * r.withinOne)} %`), make('td', {}, `${digits(100 * r.withinTwo)} %`),
      make('td', {}, interval(s.agreement)), make('td', {}, digits(r.meanScore)), make('td', {}, digits(r.meanSquareScore)), make('td', {}, `${digits(100 * r.beyond)} %`));
  });
  $('calibration-table').replaceChildren(make('div', { class: 'scroll' }, make('table', {},
    make('thead', {}, make('tr', {}, ['setting', 'within 1 s (68.3 %)', 'within 2 s (95.4 %)', 'predicted / actual RMSE', 'mean z (0)', 'mean z² (1)', '|z| > 6'].map((t) => make('th', {}, t)))),
    make('tbody', {}, rows))), make('p', { class: 'note' }, 'In brackets: if the error map is right and errors are normal. The reference’s own noise counts as error, unless it has an error map of its own.'));
}

function drawCalibration(r) {
  const positive = r.bins.filter(([p, a]) => p > 0 && a > 0);
  if (positive.length === 0) $('reliability').replaceChildren(make('p', { class: 'note' }, 'No error is predicted anywhere.'));
  else {
    const limits = logLimits(positive.flat());
    const chart = axes({ x: { ...limits, title: 'predicted error' }, y: { ...limits, title: 'actual error' }, label: 'Reliability diagram', width: 400, height: 340 });
    chart.svg.append(draw('line', { x1: chart.x(limits.low), y1: chart.y(limits.low), x2: chart.x(limits.high), y2: chart.y(limits.high), stroke: 'var(--soft)', 'stroke-dasharray': '4 4' }),
      draw('path', { d: positive.map(([p, a], i) => `${i ? 'L' : 'M'}${chart.x(p)},${chart.y(a)}`).join(''), fill: 'none', stroke: colour(2), 'stroke-width': 2 }),
      ...positive.map(([p, a]) => marker(2, chart.x(p), chart.y(a), 4)));
    $('reliability').replaceChildren(chart.svg);
  }

  const levels = r.coverage.map((_, i) => .05 * (i + 1));
  const coverage = axes({ x: { low: 0, high: 1, title: 'nominal level' }, y: { low: 0, high: 1, title: 'share inside' }, label: 'Coverage', width: 400, height: 340 });
  coverage.svg.append(draw('line', { x1: coverage.x(0), y1: coverage.y(0), x2: coverage.x(1), y2: coverage.y(1), stroke: 'var(--soft)', 'stroke-dasharray': '4 4' }),
    draw('path', { d: levels.map((l, i) => `${i ? 'L' : 'M'}${coverage.x(l)},${coverage.y(r.coverage[i])}`).join(''), fill: 'none', stroke: colour(3), 'stroke-width': 2 }),
    ...levels.map((l, i) => marker(3, coverage.x(l), coverage.y(r.coverage[i]), 4)));
  $('coverage').replaceChildren(coverage.svg);

  const width = 12 / r.scores.length, density = r.scores.map((s) => s / width);
  const high = Math.max(.45, ...density) * 1.05;
  const scores = axes({ x: { low: -6, high: 6, title: 'z' }, y: { low: 0, high, title: 'density' }, label: 'Histogram of z', width: 400, height: 340 });
  density.forEach((d, i) => scores.svg.append(draw('rect', { x: scores.x(-6 + i * width) + .5, y: scores.y(d), width: Math.max(scores.x(width) - scores.x(0) - 1, 1), height: scores.y(0) - scores.y(d), fill: colour(4), opacity: .75 })));
  const bell = Array.from({ length: 97 }, (_, i) => -6 + i / 8);
  scores.svg.append(draw('path', { d: bell.map((z, i) => `${i ? 'L' : 'M'}${scores.x(z)},${scores.y(Math.exp(-z * z / 2) / Math.sqrt(2 * Math.PI))}`).join(''), fill: 'none', stroke: 'var(--ink)', 'stroke-width': 1.5 }));
  $('scores').replaceChildren(scores.svg);
}

function startInspector(data) {
  if (data.inspections.length === 0) {
    $('variograms').replaceChildren(make('h2', {}, 'Variograms'), make('p', { class: 'note' }, 'No regions were inspected.'));
    return null;
  }
  $('inspection').append(...data.inspections.map((i, n) => make('option', { value: n }, `${i.method}, ${digits(i.setting, 6)} spp`)));
  const state = { regions: [], current: -1, image: null };
  const canvas = $('regions'), context = canvas.getContext('2d');

  async function load() {
    const chosen = data.inspections[+$('inspection').value];
    const setting = data.settings.find((s) => s.method === chosen.method && s.setting === chosen.setting && !s.hierarchical && s.image);
    state.regions = chosen.regions;
    state.image = setting.image;
    state.base = await canvasOf('radiance', setting.image, null, 1);
    const scale = Math.max(2, Math.ceil(640 / setting.image.width));
    canvas.width = setting.image.width * scale;
    canvas.height = setting.image.height * scale;
    select(Math.max(state.regions.findIndex((r) => r.inspection?.model), state.regions.findIndex((r) => r.inspection)));
  }

  function box(region) {
    const f = canvas.width / state.image.width / state.image.factor;
    return [(region.x - state.image.x) * f, (region.y - state.image.y) * f, region.width * f, region.height * f];
  }

  function select(index) {
    if (index < 0 || index >= state.regions.length) return;
    state.current = index;
    context.imageSmoothingEnabled = false;
    context.drawImage(state.base, 0, 0, canvas.width, canvas.height);
    context.lineWidth = 1;
    context.strokeStyle = '#3fc79c';
    for (const region of state.regions) if (region.inspection) context.strokeRect(...box(region).map((v, i) => i < 2 ? v + .5 : v - 1));
    context.lineWidth = 3;
    context.strokeStyle = '#fff';
    context.strokeRect(...box(state.regions[index]));
    context.lineWidth = 1.5;
    context.strokeStyle = '#d00000';
    context.strokeRect(...box(state.regions[index]));
    const neighbourhood = state.regions[index].inspection?.neighbourhood;
    if (neighbourhood) {
      context.setLineDash([4, 3]);
      context.strokeRect(...box(neighbourhood));
      context.setLineDash([]);
    }
    drawRegion(state.regions[index]);
    canvas.dataset.region = index;
  }

  function move(dx, dy) {
    const here = state.regions[state.current], x = here.x + here.width / 2, y = here.y + here.height / 2;
    let best = -1, least = Infinity;
    state.regions.forEach((r, i) => {
      const ex = r.x + r.width / 2 - x, ey = r.y + r.height / 2 - y;
      const along = ex * dx + ey * dy, across = Math.abs(ex * dy) + Math.abs(ey * dx);
      if (along > 0 && along + 4 * across < least) { least = along + 4 * across; best = i; }
    });
    select(best);
  }

  canvas.addEventListener('click', (event) => {
    const area = canvas.getBoundingClientRect();
    const x = state.image.x + (event.clientX - area.left) / area.width * state.image.width * state.image.factor;
    const y = state.image.y + (event.clientY - area.top) / area.height * state.image.height * state.image.factor;
    select(state.regions.findIndex((r) => x >= r.x && x < r.x + r.width && y >= r.y && y < r.y + r.height));
  });
  canvas.addEventListener('keydown', (event) => {
    const n = state.regions.length;
    const next = () => { for (let k = 1; k <= n; ++k) { const i = (state.current + k) % n; if (state.regions[i].inspection) { select(i); return; } } };
    const actions = { ArrowLeft: () => move(-1, 0), ArrowRight: () => move(1, 0), ArrowUp: () => move(0, -1), ArrowDown: () => move(0, 1), Enter: next };
    if (!actions[event.key]) return;
    event.preventDefault();
    actions[event.key]();
  });
  $('inspection').addEventListener('change', load);
  return { state, select, ready: load() };
}

function drawRegion(region) {
  const inspection = region.inspection;
  const skip = new Set(['inspection']);
  const rows = Object.entries(region).filter(([name]) => !skip.has(name)).map(([name, value]) => [name, value]);
  if (inspection) {
    inspection.model?.structures.forEach((m, i) => rows.push([`structure ${i + 1}`, `${m.type}, sill ${digits(m.sill)}, range ${digits(m.range)}, shape ${digits(m.shape)}`]));
    if (inspection.crossValidation) {
      rows.push(['cross-validation: RMSE', inspection.crossValidation.rmse]);
      rows.push(['cross-validation: mean z² (1 is right)', inspection.crossValidation.meanSquareScore]);
    }
    rows.push(['fallbacks', inspection.fallbacks.length ? inspection.fallbacks.join('; ') : 'none']);
    if (inspection.cloud) rows.push(['pairs', `${inspection.pairs} in the cloud, ${inspection.cloud.length} drawn`]);
  }
  $('region').replaceChildren(make('table', {}, make('tbody', {}, rows.map(([name, value]) => make('tr', {}, make('td', {}, name), make('td', {}, typeof value === 'number' ? digits(value, 4) : typeof value === 'string' ? value : JSON.stringify(value)))))));
  if (!inspection || inspection.classes.length === 0) {
    $('variogram').replaceChildren(make('p', { class: 'note' }, inspection ? 'This region has no variogram: too little data.' : 'This region was not inspected: only what was fitted is known.'));
    return;
  }
  const classes = inspection.classes.filter((c) => c.pairs > 0);
  const far = Math.max(...classes.map((c) => c.distance), ...inspection.cloud.map((p) => p[0])) * 1.03;
  const tops = classes.map((c) => c.semivariance + Math.min(c.standardError ?? 0, Math.abs(c.semivariance)));  // longer bars end at the frame
  const sill = inspection.model ? Math.max(...inspection.model.curve.map((p) => p[1])) : 0;
  const sorted = inspection.cloud.map((p) => p[1]).sort((a, b) => a - b);
  const high = Math.max(...tops, Math.min(sill, 2 * Math.max(...tops)), sorted[Math.floor(sorted.length * .9)] ?? 0) * 1.1 || 1;
  const low = Math.min(0, ...classes.map((c) => c.semivariance), sorted[Math.floor(sorted.length * .02)] ?? 0);
  const chart = axes({ x: { low: 0, high: far, title: inspection.distance }, y: { low, high, title: 'semivariance (squared radiance)' }, label: 'Variogram of the region', height: 380 });
  const clipped = (v) => Math.min(Math.max(v, low), high);
  for (const [h, g] of inspection.cloud) if (g <= high && g >= low) chart.svg.append(draw('circle', { cx: chart.x(h), cy: chart.y(g), r: 1.6, fill: 'var(--soft)', opacity: .45 }));
  if (inspection.model) {
    const path = inspection.model.curve.filter((p) => Number.isFinite(p[1]) && p[0] <= far).map((p, i) => `${i ? 'L' : 'M'}${chart.x(p[0])},${chart.y(clipped(p[1]))}`).join('');
    chart.svg.append(draw('path', { d: path, fill: 'none', stroke: colour(2), 'stroke-width': 2.5, class: 'model' }));
  }
  for (const c of classes) {
    const e = c.standardError ?? 0;
    chart.svg.append(draw('path', { d: `M${chart.x(c.distance)},${chart.y(clipped(c.semivariance - e))}V${chart.y(clipped(c.semivariance + e))}`, stroke: colour(1), 'stroke-width': 1.5 }));
    const point = marker(1, chart.x(c.distance), chart.y(clipped(c.semivariance)), 4);
    const title = draw('title');
    title.textContent = `${digits(c.pairs)} pairs at ${digits(c.distance)}: ${digits(c.semivariance)} ± ${digits(e)}`;
    point.append(title);
    chart.svg.append(point);
  }
  $('variogram').replaceChildren(chart.svg, make('p', { class: 'note' }, (inspection.cloud.length ? 'Grey: the cloud (pairs of data, less their noise; points outside the frame are left out).' : 'Of what the estimate lacks: products of the two halves\u2019 residuals, in which noise cancels.') + ' Squares: the empirical variogram with one standard error. Line: the fitted model.'));
}
