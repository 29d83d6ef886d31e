// The renderer, and how surfaces, lines and beads are shaded.

let canvas = $('canvas');
// A renderer that runs on the processor pays for smooth edges with half its speed.
function makeRenderer() {
  const gl = canvas.getContext('webgl', {alpha: false, depth: true, stencil: true, antialias: false, preserveDrawingBuffer: true});
  const info = gl && gl.getExtension('WEBGL_debug_renderer_info');
  const name = info ? String(gl.getParameter(info.UNMASKED_RENDERER_WEBGL)) : '';
  if (gl && /swiftshader|llvmpipe|software|basic render/i.test(name)) return new THREE.WebGLRenderer({canvas, context: gl, preserveDrawingBuffer: true});
  // What a canvas was first asked for stays: smooth edges need a new one.
  if (gl && gl.getExtension('WEBGL_lose_context')) gl.getExtension('WEBGL_lose_context').loseContext();
  const fresh = canvas.cloneNode();
  canvas.replaceWith(fresh);
  canvas = fresh;
  return new THREE.WebGLRenderer({canvas, antialias: true, preserveDrawingBuffer: true});
}
let renderer;
try {
  renderer = makeRenderer();
} catch (error) {
  $('note').textContent = 'This browser offers no WebGL, so the part cannot be drawn. The report works.';
}
const world = new THREE.Scene();
world.background = new THREE.Color('#f6f8fb');
const camera = new THREE.PerspectiveCamera(35, 1, diagonal / 500, diagonal * 30);
camera.up.set(0, 0, 1);

const uniforms = {
  uLow: {value: low}, uSize: {value: size}, uPlane: {value: new THREE.Vector4(0, 0, 0, 1)},
  uTime: {value: 1e30}, uLayers: {value: new THREE.Vector2(-1, 1e9)}, uMaterials: {value: new THREE.Vector2(1, 1)},
  uMode: {value: 0}, uFirstLayer: {value: 0}, uMaxima: {value: paths ? new THREE.Vector4(paths.max_height_mm, paths.max_width_mm, paths.max_feed_mm_s,
    Math.max(paths.end_s, 1e-9)) : new THREE.Vector4(1, 1, 1, 1)},
  uRange: {value: new THREE.Vector2(0, 1)},
  uMap: {value: kMap.map((c) => new THREE.Vector3(...c))},
  uModelColour: {value: rgb(kModel)}, uSupportColour: {value: rgb(kSupport)},
};
const kVertexCommon = `
  precision highp float;
  uniform mat4 modelViewMatrix, projectionMatrix;
  uniform vec3 uLow, uSize;
  varying vec3 vPoint, vView;
  void place(vec3 p) {
    vPoint = p;
    vec4 view = modelViewMatrix * vec4(p, 1.0);
    vView = view.xyz;
    gl_Position = projectionMatrix * view;
  }
  void nowhere() { vPoint = vec3(0.0); vView = vec3(0.0); gl_Position = vec4(2.0, 2.0, 2.0, 1.0); }`;
const kFragmentCommon = `
  precision highp float;
  uniform vec4 uPlane;
  varying vec3 vPoint, vView;
  #ifdef CUT
  void section() { if (dot(uPlane.xyz, vPoint) > uPlane.w) discard; }
  #else
  void section() {}
  #endif
  float lamp(vec3 n) { return 0.42 + 0.40 * abs(dot(n, normalize(vec3(0.25, 0.45, 0.85)))) + 0.22 * max(dot(n, normalize(vec3(-0.6, 0.7, 0.3))), 0.0); }`;
// Colour of a bead from its numbers; bytes = height, width, feed (fractions of their maxima), kind.
const kBeadColour = `
  uniform float uTime, uMode, uFirstLayer;
  uniform vec2 uLayers, uMaterials, uRange;
  uniform vec4 uMaxima;
  uniform vec3 uMap[5], uModelColour, uSupportColour;
  vec3 mapped(float f) {
    float x = clamp(f, 0.0, 1.0) * 4.0;
    vec3 c = mix(uMap[0], uMap[1], clamp(x, 0.0, 1.0));
    c = mix(c, uMap[2], clamp(x - 1.0, 0.0, 1.0));
    c = mix(c, uMap[3], clamp(x - 2.0, 0.0, 1.0));
    return mix(c, uMap[4], clamp(x - 3.0, 0.0, 1.0));
  }
  vec3 direction(vec2 o) {
    vec3 n = vec3(o, 1.0 - abs(o.x) - abs(o.y));
    if (n.z < 0.0) n.xy = (1.0 - abs(n.yx)) * vec2(n.x < 0.0 ? -1.0 : 1.0, n.y < 0.0 ? -1.0 : 1.0);
    return normalize(n);
  }
  bool is_support(float kind) { return mod(floor(kind * 255.0 + 0.5), 2.0) > 0.5; }
  vec3 bead_colour(vec4 bytes, vec3 axis, float time) {
    float span = max(uRange.y - uRange.x, 1e-9);
    if (uMode < 0.5) return is_support(bytes.w) ? uSupportColour : uModelColour;
    if (uMode < 1.5) return mapped((bytes.x * uMaxima.x - uRange.x) / span);
    if (uMode < 2.5) return mapped((degrees(acos(clamp(axis.z, -1.0, 1.0))) - uRange.x) / span);
    if (uMode < 3.5) return mapped((bytes.z * uMaxima.z - uRange.x) / span);
    return mapped(time / uMaxima.w);
  }
  bool hidden(float layer, float kind, float time) {
    return layer < uLayers.x - 0.5 || layer > uLayers.y + 0.5 || time > uTime ||
           (is_support(kind) ? uMaterials.y : uMaterials.x) < 0.5;
  }`;

function material(vertex, fragment, extra) {
  const options = Object.assign({side: THREE.DoubleSide}, extra || {});
  const own = options.uniforms || {};
  delete options.uniforms;
  const made = new THREE.RawShaderMaterial(Object.assign({
    vertexShader: kVertexCommon + vertex, fragmentShader: kFragmentCommon + fragment,
    uniforms: Object.assign({}, uniforms, own)}, options));
  made.extensions.derivatives = true;
  if (cutting) made.defines = {CUT: 1};
  materials.push(made);
  return made;
}
// A program that may throw pixels away is slow everywhere, so only a cut has one.
const materials = [];
let cutting = false;
function useCut(on) {
  if (on === cutting) return;
  cutting = on;
  for (const each of materials) {
    each.defines = on ? {CUT: 1} : {};
    each.needsUpdate = true;
  }
}
function add(object) {
  object.frustumCulled = false;
  world.add(object);
  return object;
}

// Flat surfaces of one colour; the far side is darker. With `solid` it bounds something full: what a section shows of the
// far side is what the cut goes through, and is hatched. Of a stack of `sheets` either side is seen, here one and there the
// other where they are steep: the same light falls on both, and no steep one is dark.
function surfaceMaterial(colour, extra) {
  return material(
    'attribute vec3 position; uniform float uShift; void main() { place(uLow + uSize * position); gl_Position.z -= uShift * gl_Position.w; }',
    `uniform vec3 uColour, uCut; uniform float uOpacity, uSolid, uSheets;
     void main() {
       section();
       vec3 n = normalize(cross(dFdx(vView), dFdy(vView)));
       float light = lamp(n);
       gl_FragColor = vec4(uColour * (uSheets > 0.5 ? mix(0.8, light, 0.5) : gl_FrontFacing ? light : 0.78 * light), uOpacity);
       #ifdef CUT
       if (uSolid > 0.5 && !gl_FrontFacing) {
         gl_FragColor = vec4(mod(gl_FragCoord.x + gl_FragCoord.y, 9.0) < 1.5 ? uCut : mix(uCut, vec3(1.0), 0.62), uOpacity);
       }
       #endif
     }`,
    Object.assign({uniforms: {uColour: {value: rgb(colour)}, uCut: {value: rgb(kCut)}, uOpacity: {value: 1},
      uShift: {value: (extra && extra.shift) || 0}, uSolid: {value: extra && extra.solid ? 1 : 0}, uSheets: {value: extra && extra.sheets ? 1 : 0}}},
      extra && extra.side !== undefined ? {side: extra.side} : {}));
}
function positions(array) { return new THREE.BufferAttribute(array, 3, true); }

const parts = {};
