// Where one looks from, and how the pointer changes it.

const kHome = [-0.9, 0.42];
const view = {target: new THREE.Vector3(), distance: 1, azimuth: kHome[0], elevation: kHome[1]};
let flight = null, untouched = true;  // nobody has turned or moved the first view
// Some of the points that are drawn, from the middle of the box: what a view of everything has to hold.
const fitPoints = [];
for (const name of ['model_vertices', 'support_layers_vertices', 'model_layers_vertices', 'path_positions', 'edge_ends']) {
  const b = scene.buffers[name], count = b ? b.count : 0, step = 3 * Math.ceil(count / 3 / 1500);
  for (let i = 0; i + 2 < count; i += step) {
    const p = known.has(name) ? known.get(name).subarray(i, i + 3) : decoded(b, i, 3);
    fitPoints.push([0, 1, 2].map((k) => (p[k] / 65535 - 0.5) * size.getComponent(k)));
  }
}
function fitted(azimuth, elevation) {
  const aspect = Math.max(canvas.clientWidth, 1) / Math.max(canvas.clientHeight, 1);
  const half = Math.tan(camera.fov * Math.PI / 360), wide = 0.88 * half * aspect;
  const tall = Math.min(0.88, 1 - 88 / Math.max(canvas.clientHeight, 200)) * half;  // the buttons above stay free
  const [ca, sa, ce, se] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(elevation), Math.sin(elevation)];
  // Seen along the view: to the right, up, and towards the eye.
  const seen = fitPoints.map(([x, y, z]) => [-sa * x + ca * y, ce * z - se * (ca * x + sa * y), ce * (ca * x + sa * y) + se * z]);
  const middle = [0, 1].map((k) => seen.reduce(([a, b], p) => [Math.min(a, p[k]), Math.max(b, p[k])], [Infinity, -Infinity]))
    .map(([a, b]) => (a + b) / 2);
  let distance = 0.1 * diagonal;
  for (const [x, y, near] of seen) {
    distance = Math.max(distance, near + Math.abs(x - middle[0]) / wide, near + Math.abs(y - middle[1]) / tall);
  }
  const target = new THREE.Vector3().addVectors(low, high).multiplyScalar(0.5)
    .add(new THREE.Vector3(-sa, ca, 0).multiplyScalar(middle[0])).add(new THREE.Vector3(-se * ca, -se * sa, ce).multiplyScalar(middle[1]));
  return {target, distance, azimuth, elevation};
}
function applyCamera() {
  const c = Math.cos(view.elevation);
  camera.position.set(Math.cos(view.azimuth) * c, Math.sin(view.azimuth) * c, Math.sin(view.elevation))
    .multiplyScalar(view.distance).add(view.target);
  camera.near = Math.max(view.distance / 200, diagonal / 5000);
  camera.far = view.distance + 6 * diagonal;
  camera.updateProjectionMatrix();
  camera.lookAt(view.target);
  camera.updateMatrixWorld();
  camera.matrixWorldInverse.getInverse(camera.matrixWorld);
}
// Pixels between two layers: where they are close, their borders would hide them.
function layerPixels() {
  const thickness = ((scene.report || {}).layers || {}).thickness_p50_mm || size.z / Math.max(layerRange.high - layerRange.low, 1);
  return thickness * canvas.clientHeight / (2 * view.distance * Math.tan(camera.fov * Math.PI / 360));
}
function flyTo(goal) {
  untouched = false;
  const from = {target: view.target.clone(), distance: view.distance, azimuth: view.azimuth, elevation: view.elevation};
  const still = window.matchMedia && window.matchMedia('(prefers-reduced-motion: reduce)').matches;
  flight = {from, goal, begin: performance.now(), length: still ? 1 : 450};
  wake();
}
function stepFlight(now) {
  const f = Math.min((now - flight.begin) / flight.length, 1), e = f * f * (3 - 2 * f);
  view.target.lerpVectors(flight.from.target, flight.goal.target, e);
  for (const key of ['distance', 'azimuth', 'elevation']) view[key] = flight.from[key] + e * (flight.goal[key] - flight.from[key]);
  if (f >= 1) flight = null;
}
function turn(dx, dy) {
  untouched = false;
  view.azimuth -= dx * 0.008;
  view.elevation = Math.min(Math.max(view.elevation + dy * 0.008, -1.5707), 1.5707);
  moved();
}
function pan(dx, dy) {
  untouched = false;
  const scale = 2 * view.distance * Math.tan(camera.fov * Math.PI / 360) / canvas.clientHeight;
  const right = new THREE.Vector3().setFromMatrixColumn(camera.matrix, 0), up = new THREE.Vector3().setFromMatrixColumn(camera.matrix, 1);
  view.target.addScaledVector(right, -dx * scale).addScaledVector(up, dy * scale);
  moved();
}
function zoom(factor) {
  untouched = false;
  view.distance = Math.min(Math.max(view.distance * factor, diagonal / 300), diagonal * 10);
  moved();
}
const pointers = new Map();
canvas.addEventListener('pointerdown', (event) => {
  canvas.setPointerCapture(event.pointerId);
  pointers.set(event.pointerId, {x: event.clientX, y: event.clientY});
  flight = null;
});
canvas.addEventListener('pointermove', (event) => {
  const before = pointers.get(event.pointerId);
  if (!before) return;
  const dx = event.clientX - before.x, dy = event.clientY - before.y;
  if (pointers.size === 2) {
    const other = [...pointers].find(([id]) => id !== event.pointerId)[1];
    const span = (p) => Math.hypot(p.x - other.x, p.y - other.y);
    zoom(span(before) / Math.max(span({x: event.clientX, y: event.clientY}), 1));
    pan(dx / 2, dy / 2);
  } else if (event.buttons & 2 || event.shiftKey) {
    pan(dx, dy);
  } else {
    turn(dx, dy);
  }
  pointers.set(event.pointerId, {x: event.clientX, y: event.clientY});
});
for (const name of ['pointerup', 'pointercancel']) canvas.addEventListener(name, (event) => pointers.delete(event.pointerId));
canvas.addEventListener('contextmenu', (event) => event.preventDefault());
canvas.addEventListener('wheel', (event) => { event.preventDefault(); flight = null; zoom(Math.exp(event.deltaY * 0.0012)); }, {passive: false});
