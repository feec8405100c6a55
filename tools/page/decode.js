'use strict';
// Numbers, elements, and the images' half floats.

const $ = (id) => document.getElementById(id);

/** An element with attributes and children; text children are text, never markup. */
function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes))
    if (value !== undefined && value !== null) element.setAttribute(name, value);
  element.append(...children.flat().filter((child) => child !== null && child !== undefined));
  return element;
}

/** Three significant digits, without powers of ten where they are not needed. */
function digits(value, count = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return '–';
  if (value === 0) return '0';
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-4) return value.toExponential(count - 1);
  return String(Number(value.toPrecision(count)));
}

/** [value, lower, upper, count] as text; the interval only where there is one. */
function interval(i, count = 3) {
  if (!i || i[0] === null) return '–';
  return digits(i[0], count) + (i[1] === null ? '' : ` (${digits(i[1], 2)} to ${digits(i[2], 2)})`);
}

const halves = (() => {
  const table = new Float32Array(65536);
  for (let i = 0; i < 65536; ++i) {
    const exponent = (i >> 10) & 31, fraction = i & 1023;
    const size = exponent === 0 ? fraction * 2 ** -24
      : exponent === 31 ? (fraction ? NaN : Infinity) : (1 + fraction / 1024) * 2 ** (exponent - 15);
    table[i] = i & 32768 ? -size : size;
  }
  return table;
})();

/** Base64 of deflated halves, high bytes first, to floats. */
async function unpack(text) {
  const deflated = Uint8Array.from(atob(text), (c) => c.charCodeAt(0));
  const stream = new Blob([deflated]).stream().pipeThrough(new DecompressionStream('deflate'));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const count = bytes.length / 2, values = new Float32Array(count);
  for (let i = 0; i < count; ++i) values[i] = halves[(bytes[i] << 8) | bytes[count + i]];
  return values;
}

/** An image of the data as planes: .radiance (R, then G, then B) and .stddev or null. Decoded once. */
function decoded(image) {
  image.decoded ??= (async () => ({
    x: image.x, y: image.y, width: image.width, height: image.height, factor: image.factor,
    radiance: await unpack(image.radiance),
    stddev: image.stddev ? await unpack(image.stddev) : null,
  }))();
  return image.decoded;
}

const srgb = (() => {  // 4096 steps of [0, 1]: finer than a display's 256 everywhere that is not nearly black
  const table = new Uint8ClampedArray(4097);
  for (let i = 0; i <= 4096; ++i) {
    const v = i / 4096;
    table[i] = Math.round(255 * (v <= 0.0031308 ? 12.92 * v : 1.055 * v ** (1 / 2.4) - 0.055));
  }
  return (v) => table[v >= 1 ? 4096 : v > 0 ? (v * 4096) | 0 : 0];
})();

/** Sequential map, as compare/colour_map.h: nearly black, violet, red, orange, pale yellow. */
function heat(t) {
  const stops = [[10, 8, 20], [76, 29, 110], [158, 40, 92], [217, 84, 45], [245, 158, 40], [252, 240, 190]];
  const place = Math.min(Math.max(t, 0), 1) * (stops.length - 1), i = Math.min(Math.floor(place), stops.length - 2);
  return stops[i].map((v, c) => Math.round(v + (stops[i + 1][c] - v) * (place - i)));
}

/** Diverging map of [-1, 1]: blue too dark, white right, red too bright. */
function diverging(t) {
  const s = Math.min(Math.abs(t), 1), end = t < 0 ? [20, 60, 150] : [150, 25, 25];
  return end.map((v) => Math.round(255 + (v - 255) * s));
}
