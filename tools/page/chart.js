// Charts as SVG, drawn by hand: log-log curves with intervals, and plain ones.

const SVG = 'http://www.w3.org/2000/svg';
function draw(tag, attributes = {}, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes))
    if (value !== undefined && value !== null) element.setAttribute(name, value);
  element.append(...children.filter((child) => child !== null));
  return element;
}

const colour = (i) => `var(--s${i % 8})`;

/** The marker of series i about (x, y): colour alone must not tell series apart. */
function marker(i, x, y, size = 5) {
  const points = (list) => list.map(([a, b]) => `${x + a * size},${y + b * size}`).join(' ');
  const style = { fill: colour(i), class: 'shape' };
  switch (i % 6) {
    case 0: return draw('circle', { cx: x, cy: y, r: size, ...style });
    case 1: return draw('rect', { x: x - size * .9, y: y - size * .9, width: 1.8 * size, height: 1.8 * size, ...style });
    case 2: return draw('polygon', { points: points([[0, -1.3], [1.2, .9], [-1.2, .9]]), ...style });
    case 3: return draw('polygon', { points: points([[0, -1.35], [1.35, 0], [0, 1.35], [-1.35, 0]]), ...style });
    case 4: return draw('polygon', { points: points([[0, 1.3], [1.2, -.9], [-1.2, -.9]]), ...style });
    default: return draw('path', { d: `M${x - size},${y - size}L${x + size},${y + size}M${x - size},${y + size}L${x + size},${y - size}`,
      stroke: colour(i), 'stroke-width': 3, fill: 'none', class: 'shape' });
  }
}

const dashes = ['', '6 3', '2 3', '8 3 2 3', '4 2', '1 3'];

/** Ticks of a logarithmic axis: decades, with 2 and 5 (or all digits) when there are few for the room (1: 480 pixels). */
function logTicks(low, high, room = 1) {
  const decades = Math.log10(high / low) / room, ticks = [];
  const steps = decades > 3 ? [1] : decades > 1.2 ? [1, 2, 5] : [1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9];
  for (let e = Math.floor(Math.log10(low)); e <= Math.ceil(Math.log10(high)); ++e)
    for (const s of steps) {
      const value = s * 10 ** e;
      if (value >= low * .9999 && value <= high * 1.0001) ticks.push(value);
    }
  return ticks;
}

function linearTicks(low, high, count = 6, least = 0) {
  const raw = Math.max((high - low) / count, least), power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map((s) => s * power).find((s) => s >= raw);
  const ticks = [];
  for (let v = Math.ceil(low / step) * step; v <= high + step * 1e-9; v += step) ticks.push(Math.abs(v) < step * 1e-9 ? 0 : v);
  return ticks;
}

/**
 * Axes of a chart: {svg, x(v), y(v)}. options: x, y = {low, high, log, title}; width, height.
 */
function axes(options) {
  const width = options.width ?? 560, height = options.height ?? 400;
  const left = 66, right = 14, top = 12, bottom = 46;
  const scale = (axis, from, to) => {
    const f = axis.log ? Math.log : (v) => v;
    const low = f(axis.low), high = f(axis.high);
    return (v) => from + (f(v) - low) / (high - low || 1) * (to - from);
  };
  const x = scale(options.x, left, width - right), y = scale(options.y, height - bottom, top);
  const svg = draw('svg', { viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': options.label });
  for (const v of options.x.log ? logTicks(options.x.low, options.x.high, (width - left - right) / 480) : linearTicks(options.x.low, options.x.high, 6, options.x.step)) {
    svg.append(draw('line', { x1: x(v), x2: x(v), y1: top, y2: height - bottom, class: 'grid' }));
    const text = draw('text', { x: x(v), y: height - bottom + 17, 'text-anchor': 'middle', class: 'soft' });
    text.textContent = digits(v);
    svg.append(text);
  }
  for (const v of options.y.log ? logTicks(options.y.low, options.y.high) : linearTicks(options.y.low, options.y.high)) {
    svg.append(draw('line', { x1: left, x2: width - right, y1: y(v), y2: y(v), class: 'grid' }));
    const text = draw('text', { x: left - 7, y: y(v) + 4, 'text-anchor': 'end', class: 'soft' });
    text.textContent = digits(v);
    svg.append(text);
  }
  svg.append(draw('path', { d: `M${left},${top}V${height - bottom}H${width - right}`, fill: 'none', class: 'axis' }));
  const xTitle = draw('text', { x: (left + width - right) / 2, y: height - 8, 'text-anchor': 'middle' });
  xTitle.textContent = options.x.title;
  const yTitle = draw('text', { x: 0, y: 0, 'text-anchor': 'middle', transform: `translate(14 ${(top + height - bottom) / 2}) rotate(-90)` });
  yTitle.textContent = options.y.title;
  svg.append(xTitle, yTitle);
  return { svg, x, y };
}

/** Limits of logarithmic axes around positive values. */
function logLimits(values) {
  const good = values.filter((v) => Number.isFinite(v) && v > 0);
  const low = Math.min(...good), high = Math.max(...good);
  const margin = Math.max(Math.log(high / low) * .07, .12);
  return { low: low * Math.exp(-margin), high: high * Math.exp(margin), log: true };
}

/** Limits of an axis of whole numbers. */
function wholeLimits(values) {
  return { low: Math.min(...values) - .5, high: Math.max(...values) + .5, step: 1 };
}

/**
 * Log-log curves, or with whole numbers along x (titles.whole). curves: [{index, name, points: [{x, y, xRange, yRange, text, ring}]}]. Every point can be focused and
 * says what it is.
 */
function curveChart(target, curves, titles) {
  const points = curves.flatMap((c) => c.points);
  if (points.length === 0) {
    target.replaceChildren(make('p', { class: 'note' }, 'Nothing to draw for this measure.'));
    return;
  }
  const bounded = (range, value) => range && range[0] > value / 30 && range[1] < value * 30 ? range : [];
  const { svg, x, y } = axes({
    x: { ...(titles.whole ? wholeLimits : logLimits)(points.map((p) => p.x)), title: titles.x },
    y: { ...logLimits(points.flatMap((p) => [p.y, ...bounded(p.yRange, p.y)])), title: titles.y },
    label: `${titles.y} against ${titles.x}`,
  });
  const clip = (v) => Math.min(Math.max(v, 12), 400 - 46);  // intervals end at the frame
  for (const curve of curves) {
    const line = curve.points.map((p, k) => `${k ? 'L' : 'M'}${x(p.x)},${y(p.y)}`).join('');
    svg.append(draw('path', { d: line, fill: 'none', stroke: colour(curve.index), 'stroke-width': 2,
      'stroke-dasharray': dashes[curve.index % 6] || null, opacity: .85 }));
  }
  for (const curve of curves)
    for (const p of curve.points) {
      const group = draw('g', { class: 'mark', tabindex: 0, role: 'img', 'aria-label': p.text });
      const title = draw('title');
      title.textContent = p.text;
      group.append(title);
      if (p.yRange && p.yRange[0] > 0)
        group.append(draw('path', { d: `M${x(p.x)},${clip(y(p.yRange[0]))}V${clip(y(p.yRange[1]))}`, stroke: colour(curve.index), 'stroke-width': 1.5 }));
      if (p.ring) group.append(draw('circle', { cx: x(p.x), cy: y(p.y), r: 9, fill: 'none', stroke: 'var(--ink)', 'stroke-width': 1 }));
      group.append(marker(curve.index, x(p.x), y(p.y)));
      svg.append(group);
    }
  target.replaceChildren(svg);
}

/** Buttons that name the series and switch them on and off. */
function legend(names, hidden, changed) {
  return make('ul', { class: 'legend' }, names.map(({ name, index }) => {
    const icon = draw('svg', { viewBox: '0 0 16 16', 'aria-hidden': 'true' }, marker(index, 8, 8));
    const button = make('button', { type: 'button', 'aria-pressed': String(!hidden.has(name)) }, icon, name);
    button.addEventListener('click', () => {
      if (!hidden.delete(name)) hidden.add(name);
      changed(name);
    });
    return make('li', {}, button);
  }));
}
