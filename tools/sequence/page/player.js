// All sequences side by side, frame by frame.

const sources = [{ name: 'reference', images: data.referenceImages }, ...data.sequences];
const state = { frame: 0, view: 'radiance', exposure: 0, playing: 0 };  // playing: number of the run, or 0
const kMostShaded = 64e6;  // pixels kept as they are shown: 256 MB

$('player').append(...sources.map((source) => {
  const { width, height } = source.images[0];
  source.canvas = make('canvas', { width, height, role: 'img', 'aria-label': source.name });
  return make('figure', {}, source.canvas, make('figcaption', { title: source.path ?? data.reference }, source.name));
}));
for (const view of ['radiance', 'signed', 'relative']) $('view').append(make('option', { value: view }, views[view]));
$('frame').max = data.frames.length - 1;

const shadedFrames = new Map();
function shadedFrame(source, frame) {
  const image = source.images[frame], gain = 2 ** state.exposure;
  const key = `${sources.indexOf(source)} ${frame} ${state.view} ${state.view === 'relative' ? 0 : gain}`;
  if (!shadedFrames.has(key)) {
    if (shadedFrames.size * image.width * image.height > kMostShaded) shadedFrames.delete(shadedFrames.keys().next().value);
    shadedFrames.set(key, canvasOf(state.view, image, data.referenceImages[frame], gain));
  }
  return shadedFrames.get(key);
}

let asked = 0, drawn = 0;
async function show(changes = {}) {
  Object.assign(state, changes);
  const call = ++asked;
  const canvases = await Promise.all(sources.map((source) => shadedFrame(source, state.frame)));
  if (call !== asked) return;
  sources.forEach((source, i) => source.canvas.getContext('2d').drawImage(canvases[i], 0, 0));
  $('frame').value = state.frame;
  $('frame-value').textContent = data.frames[state.frame];
  $('exposure-value').textContent = `${state.exposure > 0 ? '+' : ''}${state.exposure} EV`;
  $('play').textContent = state.playing ? 'Pause' : 'Play';
  drawn = call;
}

/** The next frame when the last one is drawn and its time is over. */
async function play(run) {
  while (state.playing === run) {
    const start = performance.now();
    await show({ frame: (state.frame + 1) % data.frames.length });
    const rest = 1000 / Math.min(Math.max(+$('speed').value || 12, 1), 60) - (performance.now() - start);
    await new Promise((done) => setTimeout(done, Math.max(rest, 0)));
  }
}

let runs = 0;
$('play').addEventListener('click', () => {
  show({ playing: state.playing ? 0 : ++runs });
  if (state.playing) play(state.playing);
});
$('frame').addEventListener('input', () => show({ frame: +$('frame').value }));
$('view').addEventListener('change', () => show({ view: $('view').value }));
$('exposure').addEventListener('input', () => show({ exposure: +$('exposure').value }));
$('player-note').textContent = 'Signed errors: full colour at 0.25, less with more exposure. Relative errors: from 0.1 % to 100 %, logarithmic. Green pixels are not finite.' +
  (data.referenceImages[0].factor > 1 ? ` Images are reduced ${data.referenceImages[0].factor} times; numbers are not.` : '');
show().then(() => { document.documentElement.dataset.ready = 'yes'; });
