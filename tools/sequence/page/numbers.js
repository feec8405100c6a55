// Error against frame, and the means of all frames.

const data = JSON.parse($('data').textContent);
const measures = { relMse: 'relMSE', flicker: 'flicker' };
if (data.motion) measures.flickerAlongMotion = 'flicker along motion';

const hidden = new Set();

function drawFrames() {
  const measure = $('measure').value;
  const curves = data.sequences.map((s, index) => ({
    index, name: s.name,
    points: data.frames.map((frame, i) => ({ x: frame, y: s.series[measure][i] }))
      .filter((p) => p.y > 0)  // logarithms
      .map((p) => ({ ...p, text: `${s.name}, frame ${p.x}: ${digits(p.y)}` })),
  })).filter((c) => !hidden.has(c.name));
  curveChart($('by-frame'), curves, { x: 'frame', y: measures[measure], whole: true });
  $('legend').replaceChildren(legend(data.sequences.map((s, index) => ({ name: s.name, index })), hidden, drawFrames));
}

$('measure').append(...Object.entries(measures).map(([value, name]) => make('option', { value }, name)));
$('measure').addEventListener('change', drawFrames);

$('about').textContent = `${data.frames.length} frames (${data.frames[0]} to ${data.frames[data.frames.length - 1]}) of ${data.width} x ${data.height} pixels, against ${data.reference}.`;
$('tile').textContent = `${data.tile} x ${data.tile}`;
$('table').append(make('table', {},
  make('thead', {}, make('tr', {}, make('th', {}, 'sequence'), ...Object.values(measures).map((name) => make('th', {}, name)))),
  make('tbody', {}, data.sequences.map((s) => make('tr', {}, make('td', { title: s.path }, s.name),
    ...Object.keys(measures).map((m) => make('td', {}, interval(s[m]))))))));
drawFrames();
