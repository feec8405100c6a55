// Puts the page together.

const data = JSON.parse($('data').textContent);
// The headline chart alone, for a picture of it.
if (location.hash === '#figure') document.body.classList.add('figure');

const page = { measure: data.measures[0].name, hidden: new Set() };

function update() {
  drawCurves(data, page);
  drawTable(data, page);
  drawEqualTimes(data, page);
  drawKnobs(data, page);
}

const usable = data.measures.filter((m) => data.settings.some((s) => s.values[m.name]?.[0] > 0));
$('measure').append(...usable.map((m) => make('option', { value: m.name }, m.title)));
if (usable.length) page.measure = usable[0].name;
$('measure').addEventListener('change', () => { page.measure = $('measure').value; update(); });

drawAbout(data);
update();
drawStages(data);
page.viewer = startViewer(data);
startCalibration(data);
page.inspector = startInspector(data);
document.documentElement.dataset.ready = 'yes';
