// The platform, and marks where something was found.

function makePlatform() {
  const step = diagonal > 700 ? 50 : 10, points = [];
  const a = [0, 1].map((k) => Math.floor((box.low[k] - step) / step) * step);
  const b = [0, 1].map((k) => Math.ceil((box.high[k] + step) / step) * step);
  for (let x = a[0]; x <= b[0] + 1e-6; x += step) points.push(x, a[1], 0, x, b[1], 0);
  for (let y = a[1]; y <= b[1] + 1e-6; y += step) points.push(a[0], y, 0, b[0], y, 0);
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(points), 3));
  world.add(parts.platform = new THREE.LineSegments(geometry, new THREE.LineBasicMaterial({color: 0xc9d1da})));
  return step;
}
const gridStep = makePlatform();

// Where x, y and z point, in the lower right corner: three arms with their letters, in pixels.
function makeAxes() {
  const strokes = [[[-3, -4, 3, 4], [-3, 4, 3, -4]], [[-3, 4, 0, 0], [3, 4, 0, 0], [0, 0, 0, -4]], [[-3, 4, 3, 4], [3, 4, -3, -4], [-3, -4, 3, -4]]];
  const arm = [], offset = [], colour = [];
  ['#c0392b', '#2e8b57', '#2f5fb3'].forEach((hex, k) => {
    const put = (length, x, y) => {
      arm.push(...[0, 1, 2].map((i) => (i === k ? length : 0)));
      offset.push(x, y);
      colour.push(...rgb(hex).toArray());
    };
    put(0, 0, 0);
    put(20, 0, 0);
    for (const [x0, y0, x1, y1] of strokes[k]) { put(29, x0, y0); put(29, x1, y1); }
  });
  const geometry = new THREE.BufferGeometry();
  for (const [name, array, items] of [['position', arm, 3], ['offset', offset, 2], ['colour', colour, 3]]) {
    geometry.setAttribute(name, new THREE.BufferAttribute(new Float32Array(array), items));
  }
  const made = add(new THREE.LineSegments(geometry, material(
    `attribute vec3 position, colour; attribute vec2 offset; uniform mat4 viewMatrix; uniform vec2 uPixels; varying vec3 vColour;
     void main() {
       vColour = colour; vPoint = vec3(0.0); vView = vec3(0.0);
       vec2 at = (mat3(viewMatrix[0].xyz, viewMatrix[1].xyz, viewMatrix[2].xyz) * position).xy + offset;
       gl_Position = vec4(vec2(1.0, -1.0) + 2.0 * (at + vec2(-42.0, 42.0)) / uPixels, 0.0, 1.0);
     }`,
    'varying vec3 vColour; void main() { gl_FragColor = vec4(vColour, 1.0); }',
    {depthTest: false, depthWrite: false, uniforms: {uPixels: {value: new THREE.Vector2(1, 1)}}})));
  made.renderOrder = 6;
  return made;
}
const axes = makeAxes();

const checks = scene.checks || [];
function makeMarks() {
  const points = [];
  for (const check of checks) if (!check.ok || scene.inspect) for (const place of check.places) points.push(...place.at);
  if (!points.length) return;
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(points), 3));
  // Rings around a dot; the one that was flown to is large and thin.
  const rings = (geometry, pixels, band) => {
    const made = add(new THREE.Points(geometry, material(
      'attribute vec3 position; uniform float uPoint; void main() { place(position); gl_PointSize = uPoint; }',
      `uniform vec3 uColour; uniform vec2 uBand;
       void main() {
         float r = length(gl_PointCoord - 0.5);
         if (r > 0.5 || (r > uBand.x && r < uBand.y)) discard;
         gl_FragColor = vec4(uColour, 1.0);
       }`,
      {depthTest: false, transparent: true, uniforms: {uColour: {value: rgb(kMark)}, uBand: {value: new THREE.Vector2(...band)},
        uPoint: {value: pixels * Math.min(window.devicePixelRatio || 1, 2)}}})));
    made.renderOrder = 5;
    return made;
  };
  parts.marks = rings(geometry, 14, [0.22, 0.36]);
  const one = new THREE.BufferGeometry();
  one.setAttribute('position', new THREE.BufferAttribute(new Float32Array(3), 3));
  parts.chosen = rings(one, 46, [0, 0.43]);
  parts.chosen.visible = false;
}
makeMarks();
