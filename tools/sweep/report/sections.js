// Curves, tables and bars.

function settingName(s) {
  const sampling = s.hierarchical ? `hierarchical, tolerance ${digits(s.setting)}` : `${digits(s.setting, 6)} spp`;
  return `${s.method}, ${sampling}`;
}

const shownSettings = (data) => data.settings.filter((s) => s.runs > 0);
const titleOf = (data, measure) => data.measures.find((m) => m.name === measure).title;
const timeTitle = (data) => data.imageTimesOnly ? 'seconds of the reconstruction' : 'seconds, tracing and reconstruction';

function rangeOf(i) {
  return i[1] === null ? null : [i[1], i[2]];
}

function drawCurves(data, state) {
  const measure = state.measure, hidden = state.hidden;
  const front = new Set(data.pareto[measure] ?? []);
  const curves = (xOf) => data.series.map((series, index) => ({
    index, name: series.name,
    points: series.settings.filter((i) => data.settings[i].values[measure]?.[0] > 0).map((i) => {
      const s = data.settings[i], value = s.values[measure];
      return { x: xOf(s), y: value[0], yRange: rangeOf(value), ring: front.has(i),
        text: `${settingName(s)}: ${titleOf(data, measure)} ${interval(value)}, ${interval(s.seconds)} s, ${digits(s.samplesPerPixel)} samples a pixel` +
          (front.has(i) ? '; nothing is faster at this error' : '') };
    }).filter((p) => p.x > 0),
  })).filter((c) => c.points.length > 0 && !hidden.has(c.name));
  const title = titleOf(data, measure);
  curveChart($('by-time'), curves((s) => s.seconds[0]), { x: timeTitle(data), y: title });
  const bySamples = curves((s) => s.samplesPerPixel);
  bySamples.forEach((c) => c.points.forEach((p) => { p.ring = false; }));
  curveChart($('by-samples'), bySamples, { x: 'samples a pixel', y: title });
  $('by-time-note').textContent = 'Against time. Ringed: settings that nothing beats in both (the Pareto front). Lower and further left is better.' +
    (data.imageTimesOnly ? ' The renderer’s own time is not known (--trace-seconds), so only the reconstruction’s is drawn.' : '');
  const old = $('curves').querySelector('.legend');
  const list = legend(data.series.map((s, index) => ({ name: s.name, index })), hidden, (name) => {
    drawCurves(data, state);
    [...$('curves').querySelectorAll('.legend button')].find((b) => b.textContent === name)?.focus();
  });
  if (old) old.replaceWith(list); else $('curves').querySelector('.charts').before(list);
  drawSlopes(data, measure);
  drawHeadline(data, measure);
}

function drawSlopes(data, measure) {
  const rows = data.series.filter((s) => s.slopeBySamples[measure]).map((s) => make('tr', {},
    make('td', {}, s.name), make('td', {}, interval(s.slopeBySamples[measure])), make('td', {}, interval(s.slopeByTime[measure]))));
  const expected = ['rmse', 'rmse_tm', 'mape', 'predicted_rmse'].includes(measure) ? '-1/2' : '-1';
  $('slopes').replaceChildren(rows.length === 0 ? '' : make('div', { class: 'scroll' }, make('table', {},
    make('thead', {}, make('tr', {}, make('th', {}, 'slope of log error'), make('th', {}, 'by log samples'), make('th', {}, 'by log time'))),
    make('tbody', {}, rows))),
    make('p', { class: 'note' }, `Least squares over all repetitions, with 95 % intervals. The mean of independent samples without outliers, against a reference without noise, has ${expected} by samples` +
      (measure === 'dssim' || measure === 'rmse_tm' ? ' where errors are small.' : '.') +
      (data.fromDump ? ' Sub-sets of one dump share samples: slopes are less certain than their intervals say.' : '')));
}

/** One sentence: which setting brings averaging's best error soonest. */
function drawHeadline(data, measure) {
  const base = data.series.find((s) => s.method === 'mean' && !s.hierarchical);
  const settings = shownSettings(data).filter((s) => s.knob === '' && s.values[measure]?.[0] > 0);
  if (!base || data.imageTimesOnly || settings.length === 0) { $('headline').textContent = ''; return; }
  const mean = data.settings[base.settings[base.settings.length - 1]];
  const error = mean.values[measure]?.[0];
  if (!(error > 0)) { $('headline').textContent = ''; return; }
  const fastest = settings.filter((s) => s.values[measure][0] <= error).sort((a, b) => a.seconds[0] - b.seconds[0])[0];
  $('headline').textContent = `Plain averaging of ${digits(mean.setting, 6)} samples a pixel takes ${digits(mean.seconds[0])} s to a ${titleOf(data, measure)} of ${digits(error)}. ` +
    (fastest === mean ? 'No other setting reached that error sooner.'
      : `The fastest setting with at most that error was ${settingName(fastest)}: ${digits(fastest.seconds[0])} s, error ${interval(fastest.values[measure])}.`);
}

function ratioCell(entry, higherIsBetter) {
  if (!entry) return make('td', {}, '–');
  const [value, lower, upper] = entry.ratio;
  const sure = lower === null ? 0 : lower > 1 ? 1 : upper < 1 ? -1 : 0;
  const kind = entry.extrapolated ? '' : sure * (higherIsBetter ? 1 : -1) > 0 ? 'better' : sure ? 'worse' : '';
  return make('td', { class: kind }, (entry.extrapolated ? '~' : '') + digits(value),
    make('small', {}, lower === null ? '' : `${digits(lower, 2)} to ${digits(upper, 2)}`));
}

function drawTable(data, state) {
  const measure = state.measure, title = titleOf(data, measure);
  const withValue = (i, text) => make('td', {}, text ?? digits(i?.[0]), make('small', {}, !i || i[1] === null ? '' : `${digits(i[1], 2)} to ${digits(i[2], 2)}`));
  const front = new Set(data.pareto[measure] ?? []);
  const extra = ['psnr', 'ssim', 'bias'].filter((name) => data.settings.some((s) => s.values[name]));
  if (data.settings.some((s) => s.values.nonfinite?.[0] > 0)) extra.push('nonfinite');
  const rows = data.settings.map((s, i) => make('tr', { class: front.has(i) ? 'best' : null },
    make('td', {}, settingName(s), s.values.sigma ? make('small', {}, `sigma ${digits(s.values.sigma[0])}`) : null,
      s.failures.map((f) => make('small', { class: 'worse' }, `failed: ${f}`))),
    make('td', {}, digits(s.samplesPerPixel)), withValue(s.samplingSeconds), withValue(s.imageSeconds), withValue(s.seconds),
    withValue(s.cpuSeconds), make('td', {}, digits(s.peakBytes / 2 ** 20)), withValue(s.values[measure]),
    extra.map((name) => withValue(s.values[name])),
    ratioCell(s.samplesSaved[measure], true), ratioCell(s.speedUp[measure], true), ratioCell(s.errorRatio[measure], false),
    withValue(s.values.predicted_rmse), withValue(s.agreement)));
  $('table').replaceChildren(make('div', { class: 'scroll' }, make('table', {},
    make('thead', {}, make('tr', {}, ['setting', 'samples a pixel', 'tracing, s', 'reconstruction, s', 'total, s', 'processor, s', 'peak, MB', title,
      ...extra.map((n) => ({ psnr: 'PSNR, dB', ssim: 'SSIM', bias: 'bias', nonfinite: 'pixels not finite' })[n]), 'averaging needs samples ×', 'averaging needs time ×', 'error by averaging’s',
      'RMSE predicted', 'predicted / actual'].map((t) => make('th', {}, t)))),
    make('tbody', {}, rows))),
    make('p', { class: 'note' }, 'Small: 95 % intervals over the repetitions. “Averaging needs”: samples, or time, that plain averaging of uniform samples needs to the same error, divided by this setting’s; ~ where averaging was not run to that error and its fitted line was used. “Error by averaging’s”: in the same time. ' +
      'Green and red: better and worse beyond the interval. Bold: on the Pareto front. The average is the tracer’s own image: no reconstruction time is counted for it' +
      (data.imageTimesOnly ? ' otherwise; here the renderer’s time is not known, and the time of averaging the dump is.' : '.') +
      (data.settings.some((s) => s.values.sigma) ? ' Sigma, in pixels: chosen against the reference, for the least relMSE of each image; a user without one cannot.' : '') +
      ' Peak memory: of the command that needs most; it cannot be told below that of the program that measures (tens of MB).'));
  $('targets').replaceChildren(...data.targets.flatMap((t) => [
    make('strong', {}, `${titleOf(data, t.measure)} of at most ${digits(t.value)}: `),
    t.setting === null ? 'no setting of this sweep. ' : `${settingName(data.settings[t.setting])}, ${digits(data.settings[t.setting].seconds[0])} s. `,
    t.setting === null ? '' : make('pre', {}, `${data.settings[t.setting].samplingCommand}\n${data.settings[t.setting].command}`)]));
}

function drawEqualTimes(data, state) {
  const measure = state.measure;
  if (data.equalTimes.length === 0 || data.imageTimesOnly) {
    $('equal-table').replaceChildren(make('p', { class: 'note' }, 'Needs the times of tracing and the method “mean”.'));
    return;
  }
  const rows = data.series.map((series) => make('tr', {}, make('td', {}, series.name), data.equalTimes.map((time) => {
    const entry = time.errors[series.name]?.[measure];
    const best = Math.min(...Object.values(time.errors).map((e) => e[measure]?.ratio[0] ?? Infinity));
    return make('td', entry && entry.ratio[0] === best ? { style: 'font-weight:600' } : {}, entry ? digits(entry.ratio[0]) : '–',
      make('small', {}, !entry || entry.ratio[1] === null ? '' : `${digits(entry.ratio[1], 2)} to ${digits(entry.ratio[2], 2)}`));
  })));
  $('equal-table').replaceChildren(make('div', { class: 'scroll' }, make('table', {},
    make('thead', {}, make('tr', {}, make('th', {}, titleOf(data, measure)), data.equalTimes.map((t) => make('th', {}, `${digits(t.seconds)} s`, make('small', {}, t.budget))))),
    make('tbody', {}, rows))), make('p', { class: 'note' }, 'Errors of all series at the times of averaging, read off the lines of the chart between measured settings, never beyond them (–). Bold: least.'));
}

const stageOrder = ['load scene', 'trace', 'write dump', 'read', 'statistics', 'features', 'variograms', 'factorise', 'predict', 'solve', 'write', 'other'];
const stageColours = { trace: 0, 'write dump': 5, 'load scene': 7, read: 4, statistics: 6, features: 5, variograms: 1, factorise: 2, predict: 3, solve: 2, write: 4, other: 7 };

function drawStages(data) {
  const settings = shownSettings(data).filter((s) => s.knob === '');
  const total = (s) => Object.values(s.stages).reduce((a, b) => a + b, 0);
  const most = Math.max(...settings.map(total));
  const rank = (name) => { const i = stageOrder.indexOf(name); return i < 0 ? stageOrder.length - 1.5 : i; };
  const used = [...new Set(settings.flatMap((s) => Object.keys(s.stages)))].sort((a, b) => rank(a) - rank(b));
  const fill = (name) => colour(stageColours[name] ?? used.indexOf(name)) ;
  const opacity = (name) => name === 'other' || name === 'load scene' ? .35 : name === 'write' || name === 'features' ? .6 : 1;
  $('stage-bars').replaceChildren(
    make('ul', { class: 'legend' }, used.map((name) => make('li', {}, make('span', { style: `color:${fill(name)};opacity:${opacity(name)}` }, '■ '), name))),
    ...settings.map((s) => make('div', { class: 'bar' }, make('span', {}, settingName(s)),
      make('span', { class: 'track' }, used.filter((n) => s.stages[n] > 0).map((n) => make('span', {
        style: `width:${100 * s.stages[n] / most}%;background:${fill(n)};opacity:${opacity(n)}`, title: `${n}: ${digits(s.stages[n])} s (${digits(100 * s.stages[n] / total(s))} %)` }))),
      make('span', { class: 'value' }, `${digits(total(s))} s`))),
    make('p', { class: 'note' }, 'Wall seconds, means over the repetitions. The dump is written beside tracing: of the wall time it gets its share of the processors. “Other” is the rest of the reconstruction’s time: starting the program, and what it does not report.'));
}

function drawKnobs(data, state) {
  const measure = state.measure;
  const knobs = [...new Set(shownSettings(data).map((s) => s.knob).filter((k) => k))];
  if (knobs.length === 0) { $('knob-bars').replaceChildren(make('p', { class: 'note' }, 'No variations were run (--vary).')); return; }
  $('knob-bars').replaceChildren(...knobs.flatMap((knob) => {
    const varied = shownSettings(data).filter((s) => s.knob === knob);
    const plain = shownSettings(data).filter((s) => s.knob === '' && !s.hierarchical && s.method === knob.split(' ')[0] && s.setting === varied[0].setting);
    const all = [...plain, ...varied].filter((s) => s.values[measure]?.[0] > 0);
    const mostError = Math.max(...all.map((s) => s.values[measure][0])), mostTime = Math.max(...all.map((s) => s.imageSeconds[0]));
    return [make('h3', {}, `${knob}, ${digits(varied[0].setting, 6)} samples a pixel`),
      make('div', { class: 'bar two note' }, make('span', {}, ''), make('span', {}, titleOf(data, measure)), make('span', {}), make('span', {}, 'seconds of the reconstruction'), make('span', {})),
      ...all.map((s) => make('div', { class: 'bar two' }, make('span', {}, s.knob ? s.method : `${s.method} (as it is)`),
        make('span', { class: 'track' }, make('span', { style: `width:${100 * s.values[measure][0] / mostError}%;background:${colour(1)}` })),
        make('span', { class: 'value', title: interval(s.values[measure]) }, digits(s.values[measure][0])),
        make('span', { class: 'track' }, make('span', { style: `width:${100 * s.imageSeconds[0] / mostTime}%;background:${colour(2)}` })),
        make('span', { class: 'value', title: interval(s.imageSeconds) }, digits(s.imageSeconds[0]))))];
  }));
}

function drawAbout(data) {
  const machine = data.machine, loads = data.loads.filter((l) => l !== null);
  $('about').textContent = `${data.reference ? `Measured against ${data.reference.split('/').pop()}` : 'No reference: errors are those that the error maps predict'}; ` +
    (data.frames ? `frames ${data.frames}, errors are means over them and times sums, images are of frame ${data.shownFrame}; ` : '') +
    `${data.fromDump ? 'sub-sets of one dump' : 'traced anew for each run'}, ${data.seeds} repetition${data.seeds > 1 ? 's' : ''}. ${data.date}, ${machine.processor}, ${machine.processors} processors.`;
  const commands = [...new Set(data.settings.flatMap((s) => [s.samplingCommand, s.command]).filter((c) => c))];
  $('machine').replaceChildren(
    make('p', {}, `${machine.processor}, ${machine.processors} processors, ${digits(machine.memory)} GB, ${machine.system}; threads: ${data.threads || 'all'}. ` +
      (loads.length ? `Load average when the runs began: ${digits(Math.min(...loads), 2)} to ${digits(Math.max(...loads), 2)}` +
        (Math.max(...loads) > machine.processors * 1.5 ? ': other work ran on this machine, times are too long and uneven.' : '.') : '')),
    make('p', { class: 'note' }, 'Commands of the first repetition; samples.exr and image.exr stand for the files between them.'),
    make('pre', {}, commands.join('\n')));
}
