// Keys and buttons; and what the page begins with.

// ---------------------------------------------------------------- keys and buttons
const kViews = {front: [-Math.PI / 2, 0.02], side: [0, 0.02], top: [-Math.PI / 2, 1.5706], below: [-Math.PI / 2, -0.9]};
function picture() {
  draw(0, false);
  while (missing.length) drawMissing();
  const link = el('a', {href: canvas.toDataURL('image/png'), download: (scene.title || 'preview').replace(/[^\w.-]+/g, '_') + '.png'});
  link.click();
}
$('home').onclick = () => { flyTo(fitted(...kHome)); untouched = true; };
for (const name of Object.keys(kViews)) $(name).onclick = () => flyTo(fitted(...kViews[name]));
$('shot').onclick = picture;
$('help').onclick = () => { $('keys').hidden = !$('keys').hidden; };
const kKeys = [['drag', 'turn'], ['right drag, Shift drag, two fingers', 'move'], ['wheel, pinch', 'zoom'], ['H', 'show everything'],
  ['1 2 3 4', 'front, side, above, below'], ['↑ ↓', 'one layer up, down'], ['O', 'only this layer'], ['Space', 'play the print'],
  ['← →', 'back, forward in the print'], ['C', 'next colour'], ['X', 'cut open, next direction'], ['F', 'fly to the next failed check'],
  ['P', 'save a picture'], ['R', 'report'], ['? Esc', 'this list, close it']];
const failedPlaces = checks.filter((c) => (!c.ok || scene.inspect) && c.places.length);
let failedNext = 0;
document.addEventListener('keydown', (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey || ['SELECT', 'TEXTAREA'].includes(event.target.tagName)) return;
  const range = event.target.type === 'range', key = event.key.length === 1 ? event.key.toLowerCase() : event.key;
  const step = (direction) => {
    if (!toolpaths) return;
    if (!(state.show.model_paths || state.show.support_paths)) preset('paths');
    controls.setTime(state.time + direction * paths.end_s / 500);
  };
  const cycle = (select, values) => {
    select.value = values[(values.indexOf(select.value) + 1) % values.length];
    select.dispatchEvent(new Event('change'));
  };
  const actions = {
    h: () => $('home').click(), 1: () => $('front').click(), 2: () => $('side').click(), 3: () => $('top').click(), 4: () => $('below').click(),
    ArrowUp: () => controls.setLayer && controls.setLayer(state.layer + 1), ArrowDown: () => controls.setLayer && controls.setLayer(state.layer - 1),
    ArrowRight: () => step(1), ArrowLeft: () => step(-1), o: () => controls.toggleOnly && controls.toggleOnly(), ' ': () => togglePlay(!state.playing),
    c: () => controls.colour && cycle(controls.colour, Object.keys(kColours)), x: () => cycle(controls.axis, ['off', 'x', 'y', 'z']),
    f: () => { if (failedPlaces.length) visit(failedPlaces[failedNext++ % failedPlaces.length]); },
    p: picture, r: () => tab($('report').hidden), '?': () => $('help').click(), Escape: () => { $('keys').hidden = true; },
  };
  if (!actions[key] || (range && key.startsWith('Arrow')) || (event.target.tagName === 'BUTTON' && key === ' ')) return;
  event.preventDefault();
  actions[key]();
});
$('keys').append(el('table', {}, ...kKeys.map(([key, text]) => el('tr', {}, el('td', {}, el('kbd', {}, key)), el('td', {}, text)))));

function tab(report) {
  if (report && !$('report').firstChild) window.curvesupReport.build($('report'), scene, {el, short, clockText});
  $('report').hidden = !report;
  $('view').hidden = report;
  $('tab-report').classList.toggle('active', report);
  $('tab-view').classList.toggle('active', !report);
  if (!report) wake();
}
$('tab-view').onclick = () => tab(false);
$('tab-report').onclick = () => tab(true);

// ---------------------------------------------------------------- start
$('title').textContent = scene.title || 'curvesup';
const failedCount = checks.filter((c) => !c.ok).length;
if (scene.inspect) {
  const {usable, supportable} = scene.report.mesh, bare = usable && supportable === false;
  $('verdict').textContent = bare ? 'can be sliced without support only' : usable ? 'can be sliced' : 'cannot be sliced';
  $('verdict').className = usable && !bare ? 'good-back' : 'bad-back';
} else if (checks.length) {
  $('verdict').textContent = failedCount ? `${failedCount} of ${checks.length} checks failed` : `all ${checks.length} checks passed`;
  $('verdict').className = failedCount ? 'bad-back' : 'good-back';
}
buildPanel();
if (scene.inspect) { state.show.overhang = false; refresh(); } else preset('part');
window.addEventListener('resize', wake);
// It also tells the first size, which is drawn already.
new ResizeObserver(() => { if (drawnSize !== `${canvas.clientWidth} ${canvas.clientHeight}`) wake(); }).observe($('stage'));
wake();

// For tests: what the page is doing, without a way to change what it shows.
window.curvesup = {
  ready: true, loadMilliseconds: performance.now() - begun, state, adapt,
  fewTriangles, fewChains,
  pathTimes: (path) => [toolpaths.times[2 * path], toolpaths.times[2 * path + 1]],
  camera: () => ({target: view.target.toArray(), distance: view.distance}),
  still: () => !awake && drawnStill && !flight && missing.length === 0,
  averageFrame: () => averageFrame,
  triangles: () => (renderer ? renderer.info.render.triangles : 0),
};
