// The model, and what of it overhangs.

function indexed(vertices, index, mat) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', positions(vertices));
  geometry.setIndex(new THREE.BufferAttribute(index, 1));
  return add(new THREE.Mesh(geometry, mat));
}
if (present('model_faces')) {
  const vertices = buffer('model_vertices'), faces = buffer('model_faces');
  parts.model = detailedMesh(indexed(vertices, faces, surfaceMaterial(kModel, {solid: !scene.inspect})), vertices, faces);
  const chosen = buffer('overhang_faces'), index = new Uint32Array(3 * chosen.length);
  chosen.forEach((f, i) => { for (let k = 0; k < 3; ++k) index[3 * i + k] = faces[3 * f + k]; });
  if (chosen.length) parts.overhang = detailedMesh(indexed(vertices, index, surfaceMaterial(kOverhang, {shift: 2e-4, solid: true})), vertices, index);
}
if (present('bad_triangles')) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', positions(buffer('bad_triangles')));
  parts.bad = add(new THREE.Mesh(geometry, surfaceMaterial(kOverhang, {shift: 4e-4})));
}
function lineMaterial(colour, extra) {
  return material('attribute vec3 position; void main() { place(uLow + uSize * position); gl_Position.z -= 2e-4 * gl_Position.w; }',
    'uniform vec3 uColour; uniform float uOpacity; void main() { section(); gl_FragColor = vec4(uColour, uOpacity); }',
    Object.assign({uniforms: {uColour: {value: rgb(colour)}, uOpacity: {value: 1}}}, extra || {}));
}
if (present('bad_lines')) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', positions(buffer('bad_lines')));
  parts.bad_lines = add(new THREE.LineSegments(geometry, lineMaterial(kOverhang, {depthTest: false})));
}
