// The nozzle where it is at a time of the print.

function makeNozzle() {
  if (!toolpaths) return null;
  const length = Math.min(scene.nozzle.length_mm, 0.35 * diagonal);
  const geometry = new THREE.ConeBufferGeometry(length * Math.tan(scene.nozzle.half_angle_rad), length, 24, 1, false);
  geometry.rotateX(-Math.PI / 2);
  geometry.translate(0, 0, length / 2);
  const mesh = new THREE.Mesh(geometry, new THREE.MeshBasicMaterial({color: kNozzle, transparent: true, opacity: 0.55}));
  const group = new THREE.Group();
  group.add(mesh, new THREE.LineSegments(new THREE.EdgesGeometry(geometry, 40), new THREE.LineBasicMaterial({color: 0x20262d})));
  world.add(group);
  return group;
}
const nozzle = makeNozzle();

// Last entry of an ascending list (every `step`-th number) that is not above `value`.
function lastAtMost(list, step, value) {
  let a = 0, b = list.length / step;
  while (a < b) {
    const middle = (a + b) >> 1;
    if (list[step * middle] <= value) a = middle + 1; else b = middle;
  }
  return a - 1;
}
// The report's time holds heating and changes of material too, during which nothing moves.
const printTime = ((scene.report || {}).print || {}).time_s || 0;
const withoutChanges = paths && printTime > 1.01 * paths.end_s ? ' (without material changes)' : '';
// Where the nozzle is at state.time, and what it does there.
function placeNozzle() {
  const finished = `finished after ${clockText(paths.end_s)}${withoutChanges} · ${toolpaths.counts.length} paths`;
  if (state.time >= paths.end_s) return finished;
  const path = Math.max(lastAtMost(toolpaths.times, 2, state.time), 0);
  const axis = new THREE.Vector3(0, 0, 1), position = new THREE.Vector3();
  const travel = travels ? lastAtMost(travels.times, 2, state.time) : -1;
  const moving = travel >= 0 && state.time < travels.times[2 * travel + 1] && travels.times[2 * travel] >= toolpaths.times[2 * path + 1] - 1e-3;
  let i = toolpaths.first[path];
  const end = toolpaths.first[path + 1] - 1;
  while (i < end && toolpaths.time[i + 1] <= state.time) ++i;
  if (end >= i) axis.copy(directionOf(toolpaths.axis, i));
  if (moving) {
    const [begin, finish] = [travels.times[2 * travel], travels.times[2 * travel + 1]];
    const f = (state.time - begin) / Math.max(finish - begin, 1e-9) * (travels.counts[travel] - 1);
    const k = travels.first[travel] + Math.min(Math.floor(f), travels.counts[travel] - 2), t = f - Math.floor(f);
    position.fromArray(travels.points, 3 * k).lerp(new THREE.Vector3().fromArray(travels.points, 3 * k + 3), t);
  } else if (end >= i) {
    const j = Math.min(i + 1, end), step = toolpaths.time[j] - toolpaths.time[i];
    const t = step > 0 ? Math.min((state.time - toolpaths.time[i]) / step, 1) : 0;
    for (let k = 0; k < 3; ++k) position.setComponent(k, toolpaths.at(i, k) * (1 - t) + toolpaths.at(j, k) * t);
  }
  nozzle.position.copy(position);
  nozzle.quaternion.setFromUnitVectors(new THREE.Vector3(0, 0, 1), axis);
  const material = toolpaths.kinds[path] & 1 ? 'support' : 'part';
  const tilt = Math.acos(Math.min(Math.max(axis.z, -1), 1)) * 180 / Math.PI;
  return `${clockText(state.time)} of ${clockText(paths.end_s)}${withoutChanges} · ${moving ? 'travel' : material} · layer ${toolpaths.layer[path]} · ` +
    `path ${path + 1} of ${toolpaths.counts.length} · tilt ${tilt.toFixed(0)}°`;
}
