// Two images under one divider: zoom and pan are the same for both.

function startViewer(data) {
  const sources = data.settings.filter((s) => s.image).map((s) => ({ name: settingName(s), image: s.image, setting: s }));
  if (data.referenceImage) sources.unshift({ name: 'reference', image: data.referenceImage });
  if (sources.length === 0) { $('images').hidden = true; return null; }
  const picture = $('picture'), context = picture.getContext('2d');
  const state = { zoom: 0, x: .5, y: .5, split: .5, exposure: 0, view: 'radiance' };
  const width = sources[0].image.width, height = sources[0].image.height;
  const scale = Math.max(1, Math.floor(1024 / width));
  picture.width = width * scale;
  picture.height = height * scale;

  for (const select of [$('left'), $('right')])
    select.append(...sources.map((s, i) => make('option', { value: i }, s.name)));
  for (const [name, title] of Object.entries(views)) {
    if (!data.referenceImage && (name === 'signed' || name === 'relative')) continue;
    if (name === 'stddev' && !sources.some((s) => s.image.stddev)) continue;
    $('view').append(make('option', { value: name }, title));
  }
  // What most want to see first: the average beside the best of the same samples.
  const first = sources.findIndex((s) => s.setting?.method === 'mean' && s.setting.setting === data.detail && !s.setting.hierarchical);
  const others = sources.map((s, i) => i).filter((i) => sources[i].setting && i !== first && !sources[i].setting.hierarchical && sources[i].setting.setting === data.detail);
  $('left').value = Math.max(first, 0);
  $('right').value = others.length ? others[others.length - 1] : sources.length - 1;

  const cache = new Map();
  const shaded = (index) => {
    const gain = 2 ** state.exposure;
    const key = `${index} ${state.view} ${state.view === 'relative' ? 0 : gain}`;
    if (!cache.has(key)) {
      if (cache.size > 24) cache.delete(cache.keys().next().value);
      cache.set(key, canvasOf(state.view, sources[index].image, data.referenceImage, gain));
    }
    return cache.get(key);
  };

  let latest = 0;
  async function render() {
    const call = ++latest;
    const [left, right] = await Promise.all([shaded(+$('left').value), shaded(+$('right').value)]);
    if (call !== latest) return;
    const zoom = 2 ** state.zoom, w = width / zoom, h = height / zoom;
    state.x = Math.min(Math.max(state.x, .5 / zoom), 1 - .5 / zoom);
    state.y = Math.min(Math.max(state.y, .5 / zoom), 1 - .5 / zoom);
    const sx = state.x * width - w / 2, sy = state.y * height - h / 2;
    context.imageSmoothingEnabled = false;
    const edge = Math.round(state.split * picture.width);
    for (const [canvas, from, to] of [[left, 0, edge], [right, edge, picture.width]]) {
      context.save();
      context.beginPath();
      context.rect(from, 0, to - from, picture.height);
      context.clip();
      context.drawImage(canvas, sx, sy, w, h, 0, 0, picture.width, picture.height);
      context.restore();
    }
    $('divider').style.left = `calc(${100 * state.split}% - 1px)`;
    $('split').value = 100 * state.split;
    $('exposure').value = state.exposure;
    $('exposure-value').textContent = `${state.exposure > 0 ? '+' : ''}${state.exposure} EV`;
    $('zoom').value = state.zoom;
    $('zoom-value').textContent = `${digits(zoom)}x`;
    $('view').value = state.view;
    $('left-name').textContent = sources[+$('left').value].name;
    $('right-name').textContent = sources[+$('right').value].name;
    picture.dataset.drawn = call;
  }

  const change = (changes) => { Object.assign(state, changes); return render(); };
  const zoomBy = (step) => change({ zoom: Math.min(Math.max(state.zoom + step, 0), 5) });
  const modes = () => [...$('view').options].map((o) => o.value);
  $('left').addEventListener('change', render);
  $('right').addEventListener('change', render);
  $('view').addEventListener('change', () => change({ view: $('view').value }));
  $('exposure').addEventListener('input', () => change({ exposure: +$('exposure').value }));
  $('zoom').addEventListener('input', () => change({ zoom: +$('zoom').value }));
  $('split').addEventListener('input', () => change({ split: $('split').value / 100 }));
  $('reset').addEventListener('click', () => change({ zoom: 0, x: .5, y: .5 }));
  $('viewer').addEventListener('keydown', (event) => {
    const step = .125 / 2 ** state.zoom;
    const actions = {
      ArrowLeft: () => change({ x: state.x - step }), ArrowRight: () => change({ x: state.x + step }),
      ArrowUp: () => change({ y: state.y - step }), ArrowDown: () => change({ y: state.y + step }),
      '+': () => zoomBy(.5), '=': () => zoomBy(.5), '-': () => zoomBy(-.5),
      ',': () => change({ split: Math.max(0, state.split - .05) }), '.': () => change({ split: Math.min(1, state.split + .05) }),
      e: () => change({ exposure: Math.min(6, state.exposure + .5) }), E: () => change({ exposure: Math.max(-6, state.exposure - .5) }),
      v: () => change({ view: modes()[(modes().indexOf(state.view) + 1) % modes().length] }),
    };
    if (event.ctrlKey || event.metaKey || event.altKey || !actions[event.key]) return;
    event.preventDefault();
    actions[event.key]();
  });
  let drag = null;
  $('viewer').addEventListener('pointerdown', (event) => {
    drag = { divider: event.target === $('divider'), x: event.clientX, y: event.clientY, from: { ...state } };
    $('viewer').setPointerCapture(event.pointerId);
  });
  $('viewer').addEventListener('pointermove', (event) => {
    if (!drag) return;
    const box = $('viewer').getBoundingClientRect();
    if (drag.divider) change({ split: Math.min(Math.max((event.clientX - box.left) / box.width, 0), 1) });
    else change({ x: drag.from.x - (event.clientX - drag.x) / box.width / 2 ** state.zoom, y: drag.from.y - (event.clientY - drag.y) / box.height / 2 ** state.zoom });
  });
  for (const name of ['pointerup', 'pointercancel']) $('viewer').addEventListener(name, () => { drag = null; });
  $('viewer').addEventListener('wheel', (event) => {
    if (!event.ctrlKey && document.activeElement !== $('viewer')) return;  // scrolling past must not zoom
    event.preventDefault();
    zoomBy(event.deltaY < 0 ? .25 : -.25);
  }, { passive: false });
  $('viewer-note').textContent = 'First repetition. Drag the divider; drag the image to pan; wheel (after a click) zooms. Keys, when the image has the focus: arrows, + and -, comma and full stop (divider), e and E (exposure), v (view). Signed errors: full colour at 0.25, less with more exposure. Relative errors: from 0.1 % to 100 %, logarithmic. Error maps: root of the predicted standard deviation, full at 1, less with more exposure. Green pixels are not finite.' +
    (sources[0].image.factor > 1 ? ` Images are reduced ${sources[0].image.factor} times; numbers are not.` : '');
  drawCrops(data, sources, state);
  render();
  return { state, change, settled: () => Number(picture.dataset.drawn) === latest };
}

/** Crops of the settings that came nearest to the time of the longest averaging. */
async function drawCrops(data, sources) {
  const target = $('crops');
  const first = sources[0].image;
  const crops = data.crops.length ? data.crops : defaultCrops(first);
  const base = data.series.find((s) => s.method === 'mean' && !s.hierarchical);
  const budget = base ? data.settings[base.settings[base.settings.length - 1]].seconds[0] : null;
  const chosen = [];
  for (const series of data.series) {
    const candidates = series.settings.map((i) => data.settings[i]).filter((s) => s.image);
    if (candidates.length === 0) continue;
    const distance = (s) => budget && !data.imageTimesOnly ? Math.abs(Math.log(s.seconds[0] / budget)) : -s.samplesPerPixel;
    chosen.push(sources.find((s) => s.setting === candidates.sort((a, b) => distance(a) - distance(b))[0]));
  }
  const shown = [...sources.filter((s) => !s.setting), ...chosen];
  target.replaceChildren(make('h3', {}, budget && !data.imageTimesOnly ? `Crops, each method’s setting nearest to ${digits(budget)} s` : 'Crops, each method at its most samples'));
  for (const [x, y, w, h] of crops) {
    const row = make('div', { class: 'crop-grid', style: `--columns:${Math.min(shown.length, 8)}` });
    for (const source of shown) {
      const full = await canvasOf('radiance', source.image, null, 1), f = source.image.factor;
      const canvas = make('canvas', { width: Math.max(1, Math.round(w / f)), height: Math.max(1, Math.round(h / f)), role: 'img', 'aria-label': source.name });
      canvas.getContext('2d').drawImage(full, -(x - source.image.x) / f, -(y - source.image.y) / f);
      row.append(make('figure', {}, canvas, make('figcaption', {}, source.name, source.setting ? `, ${digits(source.setting.seconds[0])} s` : '')));
    }
    target.append(row);
  }
}

/** Without wishes: the middle, and the two quarters beside it. */
function defaultCrops(image) {
  const w = image.width * image.factor, h = image.height * image.factor, side = Math.max(8, Math.round(Math.min(w, h) / 5));
  return [[.5, .5], [.25, .6], [.75, .35]].map(([u, v]) => [image.x + Math.round(u * w - side / 2), image.y + Math.round(v * h - side / 2), side, side]);
}
