// The tree inside the support.

function makeSkeleton() {
  const ends = buffer('edge_ends'), radius = buffer('edge_radius'), branches = buffer('edge_branches');
  const most = branches.reduce((a, b) => Math.max(a, b), 1);
  const values = new Float32Array(2 * radius.length);
  for (let i = 0; i < radius.length; ++i) {
    values[2 * i] = radius[i];
    values[2 * i + 1] = most > 1 ? Math.log(branches[i]) / Math.log(most) : 0;
  }
  // A tube an edge. Drawing one shape many times is slow where the processor draws, so every tube has vertices of its own.
  const sides = 6, corners = 2 * sides;
  const upper = new Uint16Array(4 * corners * radius.length), lower = new Uint16Array(upper.length);
  const value = new Float32Array(2 * corners * radius.length), index = new Uint32Array(6 * sides * radius.length);
  for (let e = 0, v = 0, at = 0; e < radius.length; ++e) {
    for (let s = 0; s < sides; ++s) {
      const i = v + 2 * s, j = v + 2 * ((s + 1) % sides);
      for (const k of [i, j, i + 1, j, j + 1, i + 1]) index[at++] = k;
    }
    for (let c = 0; c < corners; ++c, ++v) {
      for (let k = 0; k < 3; ++k) { upper[4 * v + k] = ends[6 * e + k]; lower[4 * v + k] = ends[6 * e + 3 + k]; }
      upper[4 * v + 3] = c >> 1;      // which side
      lower[4 * v + 3] = c & 1;       // which end
      value[2 * v] = values[2 * e];
      value[2 * v + 1] = values[2 * e + 1];
    }
  }
  const tubes = new THREE.BufferGeometry();
  tubes.setAttribute('position', new THREE.BufferAttribute(upper, 4, true));
  tubes.setAttribute('lower', new THREE.BufferAttribute(lower, 4, true));
  tubes.setAttribute('value', new THREE.BufferAttribute(value, 2));
  tubes.setIndex(new THREE.BufferAttribute(index, 1));
  const tube = (colour, scale, least) => add(new THREE.Mesh(tubes, material(
    `attribute vec4 position, lower; attribute vec2 value;
     uniform float uScale, uLeast, uByCount;
     ${kBeadColour}
     varying vec3 vColour, vNormal;
     void main() {
       vec3 a = uLow + uSize * position.xyz, b = uLow + uSize * lower.xyz, along = b - a;
       float turn = position.w * 65535.0 * ${(2 * Math.PI / sides).toFixed(8)};
       along = length(along) > 0.0 ? normalize(along) : vec3(0.0, 0.0, 1.0);
       vec3 u = normalize(abs(along.z) < 0.9 ? cross(along, vec3(0.0, 0.0, 1.0)) : cross(along, vec3(1.0, 0.0, 0.0)));
       vec3 out_ = cos(turn) * u + sin(turn) * cross(along, u);
       vColour = uByCount > 0.5 ? mapped(value.y) : uSupportColour;
       vNormal = mat3(modelViewMatrix[0].xyz, modelViewMatrix[1].xyz, modelViewMatrix[2].xyz) * out_;
       place((lower.w > 0.0 ? b : a) + out_ * max(value.x * uScale, uLeast));
     }`,
    'varying vec3 vColour, vNormal; void main() { section(); gl_FragColor = vec4(vColour * lamp(normalize(vNormal)), 1.0); }',
    {uniforms: {uScale: {value: scale}, uLeast: {value: least}, uByCount: {value: colour}}})));
  // One line an edge, for machines that cannot draw tubes fast enough.
  const tips = new Uint16Array(6 * radius.length), shade = new Float32Array(2 * radius.length);
  tips.set(ends);
  for (let i = 0; i < radius.length; ++i) shade[2 * i] = shade[2 * i + 1] = values[2 * i + 1];
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', positions(tips));
  geometry.setAttribute('shade', new THREE.BufferAttribute(shade, 1));
  const lines = add(new THREE.LineSegments(geometry, material(
    `attribute vec3 position; attribute float shade; uniform float uByCount;
     ${kBeadColour}
     varying vec3 vColour;
     void main() { vColour = uByCount > 0.5 ? mapped(shade) : uSupportColour; place(uLow + uSize * position); }`,
    'varying vec3 vColour; void main() { section(); gl_FragColor = vec4(vColour, 1.0); }', {uniforms: {uByCount: {value: 1}}})));
  // Thick branches first, so that the lowest level keeps the trunks.
  const order = Array.from(radius.keys()).sort((a, b) => branches[b] - branches[a]);
  lines.detail = detailed(geometry, (level) => {
    const kept = order.slice(0, Math.min(kSegments[level], order.length)), index = new Uint32Array(2 * kept.length);
    kept.forEach((edge, i) => { index[2 * i] = 2 * edge; index[2 * i + 1] = 2 * edge + 1; });
    return {index, ends: [index.length]};
  });
  return {most, thin: tube(1, 0.3, diagonal / 900), full: tube(0, 1, 0), lines};
}
const skeleton = present('edge_radius') ? lazily({}, ['most', 'thin', 'full', 'lines'], makeSkeleton) : null;
