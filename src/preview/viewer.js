// The page's script. `scene` says what there is, `data` holds the numbers; nothing is fetched.
//
// In this order, each under a heading of its own: the data; what is drawn and how (materials, model, layers, skeleton, toolpaths,
// nozzle, marks), each thing in a make... function that gives three.js objects, made when first shown; the camera; `draw`, which
// brings all of it into line with `state` and keeps 30 frames a second by levels of detail; the panel and the keys, which do
// nothing but change `state` and wake the drawing. What the report page says is in report.js.
(function () {
  'use strict';
  const begun = performance.now();

  // ---------------------------------------------------------------- data
  const scene = JSON.parse(document.getElementById('scene').textContent);

  const dataElement = document.getElementById('data');
  const data = dataElement.textContent;
  dataElement.remove();

  const kTypes = {Uint8Array, Int8Array, Uint16Array, Int16Array, Uint32Array, Int32Array, Float32Array};
  // `count` numbers of a buffer, decoded from the text that holds them: three bytes are four letters.
  function decoded(b, first, count) {
    const type = kTypes[b.type], from = b.offset + first * type.BYTES_PER_ELEMENT, skipped = from % 3;
    const bytes = new Uint8Array(count * type.BYTES_PER_ELEMENT);
    const binary = atob(data.slice((from - skipped) / 3 * 4, Math.ceil((from + bytes.length) / 3) * 4));
    for (let i = 0; i < bytes.length; ++i) bytes[i] = binary.charCodeAt(i + skipped);
    return new type(bytes.buffer);
  }
  const known = new Map();
  function buffer(name) {
    const b = scene.buffers[name];
    if (!b) return null;
    if (!known.has(name)) known.set(name, decoded(b, 0, b.count));
    return known.get(name);
  }
  function present(name) { return !!scene.buffers[name] && scene.buffers[name].count > 0; }
  // Adds fields to an object that are made, all at once, when one of them is first asked for; `made` says whether they are.
  function lazily(object, names, make) {
    object.made = false;
    for (const name of names) {
      Object.defineProperty(object, name, {configurable: true, get() {
        const fields = make();
        object.made = true;
        for (const each of names) Object.defineProperty(object, each, {value: fields[each], writable: true});
        return object[name];
      }});
    }
    return object;
  }

  const box = scene.box;
  const low = new THREE.Vector3().fromArray(box.low), high = new THREE.Vector3().fromArray(box.high);
  const size = new THREE.Vector3().subVectors(high, low);
  const diagonal = Math.max(size.length(), 1);

  // ---------------------------------------------------------------- page helpers
  function $(id) { return document.getElementById(id); }
  function el(tag, attributes, ...children) {
    const node = document.createElement(tag);
    for (const [key, value] of Object.entries(attributes || {})) {
      if (key.startsWith('on')) node.addEventListener(key.slice(2), value);
      else if (value === true) node.setAttribute(key, '');
      else if (value !== false && value !== null) node.setAttribute(key, value);
    }
    node.append(...children.filter((c) => c !== null && c !== undefined));
    return node;
  }
  function clockText(seconds) {
    const s = seconds < 3600 ? Math.round(seconds) : 60 * Math.round(seconds / 60), h = Math.floor(s / 3600), m = Math.floor(s / 60) % 60;
    const two = (n) => String(n).padStart(2, '0');
    return h > 0 ? `${h} h ${two(m)} min` : m > 0 ? `${m} min ${two(s % 60)} s` : `${s} s`;
  }
  function short(value) {
    if (!Number.isFinite(value)) return String(value);
    if (value !== 0 && Math.abs(value) < 0.001) return Number(value.toPrecision(3)).toExponential();
    return value === 0 ? '0' : Math.abs(value) >= 1000 ? value.toFixed(0) : String(parseFloat(value.toPrecision(3)));
  }

  // ---------------------------------------------------------------- colours
  const kModel = '#8fa9c9', kSupport = '#e9a13b', kOverhang = '#d33f33', kMark = '#c2179b', kTravel = '#7a8694', kNozzle = '#3b4652', kCut = '#55606e';
  const kMap = [[0.27, 0.05, 0.40], [0.24, 0.34, 0.62], [0.13, 0.57, 0.55], [0.48, 0.80, 0.32], [0.99, 0.86, 0.14]];
  function rgb(hex) { return new THREE.Color(hex); }
  function mapColour(f) {
    const x = Math.min(Math.max(f, 0), 1) * 4, i = Math.min(Math.floor(x), 3), t = x - i;
    return kMap[i].map((c, k) => c + t * (kMap[i + 1][k] - c));
  }

  // ---------------------------------------------------------------- state
  const paths = scene.paths || null;
  const layerRange = {low: 0, high: 0};  // support begins below 0, the first layer of the part
  const state = {
    preset: 'part', glass: false,
    show: {model: true, overhang: true, model_layers: false, support_layers: false, model_paths: false, support_paths: false,
      travel: false, skeleton: false, struts: false, marks: true, platform: true},
    layer: 0, only: false, time: paths ? paths.end_s : 0, playing: false, colour: 'material',
    axis: 'off', cut: 0.5, flip: false, quality: 0,
  };

  // ---------------------------------------------------------------- renderer and shaders
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

  // ---------------------------------------------------------------- model and overhang
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

  // ---------------------------------------------------------------- the same with less detail
  // Line index over chains of the given lengths, keeping every `stride`-th point and the ends of every `skip`-th chain.
  // ends: where each chain ends in it.
  function chainIndex(counts, stride, skip) {
    let size = 0, first = 0, at = 0;
    const drawn = (c) => c % (skip || 1) === 0;
    counts.forEach((count, c) => { if (drawn(c)) size += 2 * Math.ceil(Math.max(count - 1, 0) / stride); });
    const index = new Uint32Array(size), ends = new Uint32Array(counts.length);
    counts.forEach((count, c) => {
      for (let i = 0; drawn(c) && i + 1 < count; i += stride) {
        index[at++] = first + i;
        index[at++] = first + Math.min(i + stride, count - 1);
      }
      first += count;
      ends[c] = at;
    });
    return {index, ends};
  }
  // Not many more than `most` segments; whole chains go only when four segments of each are too many.
  function fewChains(counts, most) {
    const total = counts.reduce((sum, count) => sum + Math.max(count - 1, 0), 0);
    const skip = Math.max(Math.ceil(4 * counts.length / most), 1);
    return chainIndex(counts, Math.max(Math.ceil(total / skip / most), 1), skip);
  }
  // Not many more than `most` triangles: vertices in one cell of a grid become the first of them. `ends` is where the parts
  // of the index end whose vertices are not mixed; the result has its own.
  function fewTriangles(vertices, index, ends, most) {
    let made = {index, ends}, cells = Math.sqrt(most);
    if (index.length <= 3 * most) return made;
    for (let round = 0; round < 3; ++round) {
      made = clustered(vertices, index, ends, cells);
      const share = made.index.length / (3 * most);
      if (share < 1.3 && share > 0.5) break;
      cells /= Math.sqrt(share);
    }
    return made;
  }
  // Every so manieth of the parts of an index, so that about `most` are left; the others become empty.
  function fewSheets(index, ends, most) {
    const every = Math.ceil(ends.length / most), kept = [], keptEnds = [];
    ends.forEach((end, s) => {
      if ((ends.length - 1 - s) % every === 0) for (let i = s > 0 ? ends[s - 1] : 0; i < end; ++i) kept.push(index[i]);
      keptEnds.push(kept.length);
    });
    return {index: new Uint32Array(kept), ends: keptEnds};
  }
  function clustered(vertices, index, ends, cells) {
    const out = [], outEnds = [], scale = cells / 65535;
    const flat = [0, 1, 2].map((k) => size.getComponent(k) / Math.max(size.x, size.y, size.z) * scale);
    let i = 0;
    for (const end of ends) {
      const first = new Map();
      const kept = (v) => {
        const key = (Math.floor(vertices[3 * v] * flat[0]) * 2048 + Math.floor(vertices[3 * v + 1] * flat[1])) * 2048 + Math.floor(vertices[3 * v + 2] * flat[2]);
        const found = first.get(key);
        if (found !== undefined) return found;
        first.set(key, v);
        return v;
      };
      const seen = new Set();
      for (; i < end; i += 3) {
        const a = kept(index[i]), b = kept(index[i + 1]), c = kept(index[i + 2]);
        if (a === b || b === c || c === a) continue;
        const least = Math.min(a, b, c), key = least * 4294967296 + (a + b + c - least);
        if (seen.has(key)) continue;
        seen.add(key);
        out.push(a, b, c);
      }
      outEnds.push(out.length);
    }
    return {index: new Uint32Array(out), ends: outEnds};
  }
  // What is drawn at each level of detail (see `adapt`): at most so many triangles, or segments, of each thing.
  const kTriangles = [Infinity, Infinity, 30000, 8000, 1600, 500], kSegments = [Infinity, Infinity, 120000, 25000, 3500, 1000];
  // Keeps one index a level, made when it is first needed, and puts the wanted one into the geometry.
  function detailed(geometry, make) {
    const made = [];
    return (level) => {
      const l = Math.max(level, 1);
      if (!made[l]) { const m = make(l); made[l] = {ends: m.ends, attribute: new THREE.BufferAttribute(m.index, 1)}; }
      if (geometry.index !== made[l].attribute) geometry.setIndex(made[l].attribute);
      return made[l].ends;
    };
  }
  function detailedMesh(mesh, vertices, index, ends) {
    mesh.detail = detailed(mesh.geometry, (level) => fewTriangles(vertices, index, ends || [index.length], kTriangles[level]));
    return mesh;
  }

  // ---------------------------------------------------------------- layers
  function makeLayers(name, colour, dark) {
    if (!scene.buffers[name + '_triangles']) return null;
    const sheetLayer = buffer(name + '_sheet_layer');
    if (!sheetLayer.length) return null;
    layerRange.low = Math.min(layerRange.low, sheetLayer[0]);
    layerRange.high = Math.max(layerRange.high, sheetLayer[sheetLayer.length - 1]);
    return lazily({}, ['fill', 'lines', 'range'], () => drawnLayers(name, sheetLayer, colour, dark));
  }
  function drawnLayers(name, sheetLayer, colour, dark) {
    const triangles = buffer(name + '_sheet_triangles'), chains = buffer(name + '_sheet_chains'), counts = buffer(name + '_outline_counts');
    const vertices = buffer(name + '_vertices'), index = buffer(name + '_triangles');
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', positions(buffer(name + '_outline')));
    const lines = add(new THREE.LineSegments(geometry, lineMaterial(dark, {transparent: true, depthWrite: false})));
    // Where each sheet ends in both indices.
    const triangleEnd = [], chainEnd = [];
    for (let s = 0; s < sheetLayer.length; ++s) {
      triangleEnd.push((triangleEnd[s - 1] || 0) + 3 * triangles[s]);
      chainEnd.push((chainEnd[s - 1] || 0) + chains[s]);
    }
    // The last sheet first: seen from above it hides the others, which then cost little.
    const fill = indexed(vertices, index, surfaceMaterial(colour, {sheets: true}));
    fill.detail = detailed(fill.geometry, (level) => {
      const some = level < 3 ? {index, ends: triangleEnd} : fewSheets(index, triangleEnd, 40);
      const few = fewTriangles(vertices, some.index, some.ends, kTriangles[level]);
      const last = few.index.length - 3;
      return {index: few.index.map((_, i) => few.index[last - i + 2 * (i % 3)]), ends: few.ends};
    });
    lines.detail = detailed(geometry, (level) => fewChains(counts, kSegments[level]));
    return {
      fill, lines,
      range(from, to, wanted) {
        const level = from === to ? Math.min(wanted, 2) : wanted;
        let a = 0, b = sheetLayer.length;
        while (a < b && sheetLayer[a] < from) ++a;
        while (b > a && sheetLayer[b - 1] > to) --b;
        const fillEnd = fill.detail(level), lineEnd = lines.detail(level);
        const fillAt = (s) => (s > 0 ? fillEnd[s - 1] : 0), lineAt = (s) => (s > 0 && chainEnd[s - 1] > 0 ? lineEnd[chainEnd[s - 1] - 1] : 0);
        fill.geometry.setDrawRange(fillAt(sheetLayer.length) - fillAt(b), fillAt(b) - fillAt(a));
        lines.geometry.setDrawRange(lineAt(a), lineAt(b) - lineAt(a));
      },
    };
  }
  const layers = {model: makeLayers('model_layers', kModel, '#5b7391'), support: makeLayers('support_layers', kSupport, '#8e5a0c')};

  // ---------------------------------------------------------------- skeleton
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

  // ---------------------------------------------------------------- toolpaths
  const kChunk = 10000;  // beads: at most 60 000 vertices
  function makePaths() {
    if (!present('path_positions')) return null;
    const counts = buffer('path_counts'), kinds = buffer('path_kinds'), layer = buffer('path_layers'), times = buffer('path_times');
    const first = new Uint32Array(counts.length + 1);
    counts.forEach((points, p) => { first[p + 1] = first[p] + points; });
    const [lowest, highest] = layer.reduce(([a, b], k) => [Math.min(a, k), Math.max(b, k)], [0, 0]);
    layerRange.low = Math.min(layerRange.low, lowest);
    layerRange.high = Math.max(layerRange.high, highest);
    uniforms.uFirstLayer.value = lowest;
    const all = {counts, first, times, kinds, layer};
    return lazily(all, ['chunks', 'lines', 'time', 'at', 'axis', 'ranges'], () => drawnPaths(all, lowest));
  }
  function drawnPaths({counts, first, times, kinds, layer}, lowest) {
    const position = buffer('path_positions'), axis = buffer('path_axes');
    const heights = buffer('path_heights'), widths = buffer('path_widths'), feeds = buffer('path_feeds');
    const count = heights.length;
    const where = new Uint16Array(4 * count), bytes = new Uint8Array(4 * count), turned = new Int8Array(4 * count);
    const time = new Float32Array(count);
    const at = (i, k) => low.getComponent(k) + size.getComponent(k) * position[3 * i + k] / 65535;
    const [sx, sy, sz] = size.toArray().map((s) => s / 65535);
    const distance = (i, j) => {
      const x = sx * (position[3 * i] - position[3 * j]), y = sy * (position[3 * i + 1] - position[3 * j + 1]);
      const z = sz * (position[3 * i + 2] - position[3 * j + 2]);
      return Math.sqrt(x * x + y * y + z * z);
    };
    const heightCount = new Uint32Array(256);
    let leastUp = 1, leastFeed = 255;
    for (let p = 0; p < counts.length; ++p) {
      let length = 0;
      for (let i = first[p]; i < first[p + 1]; ++i) {
        where[4 * i] = position[3 * i]; where[4 * i + 1] = position[3 * i + 1]; where[4 * i + 2] = position[3 * i + 2];
        where[4 * i + 3] = layer[p] - lowest;
        bytes[4 * i] = heights[i]; bytes[4 * i + 1] = widths[i]; bytes[4 * i + 2] = feeds[i]; bytes[4 * i + 3] = kinds[p];
        turned[4 * i] = axis[2 * i]; turned[4 * i + 1] = axis[2 * i + 1];
        turned[4 * i + 2] = i === first[p] ? 127 : 0;
        if (i > first[p]) length += distance(i, i - 1);
        time[i] = length;
        ++heightCount[heights[i]];
        leastFeed = Math.min(leastFeed, i > first[p] ? feeds[i] : 255);
        leastUp = Math.min(leastUp, upOf(axis[2 * i], axis[2 * i + 1]));
      }
      const begin = times[2 * p], end = times[2 * p + 1];
      for (let i = first[p]; i < first[p + 1]; ++i) time[i] = begin + (length > 0 ? time[i] / length : 0) * (end - begin);
    }

    // Beads are roofs along the paths: left, top and right of every point, twice where a path turns back. In chunks, in the
    // order of the print: only those are drawn that a choice of layers or time needs, a slow machine draws one after the
    // other, and each is made when it is first drawn.
    const beadMaterial = material(
      `attribute vec4 position, bytes, turned; attribute float time;
       ${kBeadColour}
       varying vec3 vColour, vNormal;
       varying float vTime;
       void main() {
         vTime = time; vColour = vec3(0.0); vNormal = vec3(0.0, 0.0, 1.0);
         float corner = floor((bytes.w * 255.0 + 0.5) / 64.0) - 1.0;
         if (hidden(position.w * 65535.0 + uFirstLayer, bytes.w, -1.0)) { nowhere(); return; }
         vec3 axis = direction(turned.xy), side = normalize(cross(direction(turned.zw), axis) + vec3(1e-6, 0.0, 0.0));
         float up = corner == 0.0 ? 1.0 : -0.7;
         vColour = bead_colour(bytes, axis, time);
         vNormal = mat3(modelViewMatrix[0].xyz, modelViewMatrix[1].xyz, modelViewMatrix[2].xyz) * (side * corner + axis * (up * 0.5 + 0.5));
         place(uLow + uSize * position.xyz + 0.5 * side * corner * bytes.y * uMaxima.y + 0.5 * axis * up * bytes.x * uMaxima.x);
       }`,
      `uniform float uTime; varying vec3 vColour, vNormal; varying float vTime;
       void main() { section(); if (vTime > uTime) discard; gl_FragColor = vec4(vColour * lamp(normalize(vNormal)), 1.0); }`);
    // Two bytes for the way from one point to another.
    const putWay = (i, j, into, o) => {
      const x = sx * (position[3 * j] - position[3 * i]), y = sy * (position[3 * j + 1] - position[3 * i + 1]);
      const z = sz * (position[3 * j + 2] - position[3 * i + 2]), sum = (Math.abs(x) + Math.abs(y) + Math.abs(z)) || 1;
      let u = x / sum, v = y / sum;
      if (z < 0) [u, v] = [(1 - Math.abs(v)) * (u < 0 ? -1 : 1), (1 - Math.abs(u)) * (v < 0 ? -1 : 1)];
      into[o] = Math.round(127 * u);
      into[o + 1] = Math.round(127 * v);
    };
    const turnsBack = (i) => {
      let dot = 0;
      for (const [k, step] of [sx, sy, sz].entries()) {
        dot += step * step * (position[3 * i + k] - position[3 * i - 3 + k]) * (position[3 * i + 3 + k] - position[3 * i + k]);
      }
      return dot <= 0;
    };
    const starts = (i) => turned[4 * i + 2] > 0;
    const makeChunk = (begin, end) => {
      const most = 6 * (end - begin + 1), index = [];
      const vWhere = new Uint16Array(4 * most), vBytes = new Uint8Array(4 * most), vTurned = new Int8Array(4 * most), vTime = new Float32Array(most);
      let v = 0;
      const roof = (i, from, to) => {
        for (let corner = 0; corner < 3; ++corner, ++v) {
          for (let k = 0; k < 4; ++k) { vWhere[4 * v + k] = where[4 * i + k]; vBytes[4 * v + k] = bytes[4 * i + k]; }
          vBytes[4 * v + 3] += 64 * corner;  // above the bits of material and kind
          vTurned[4 * v] = turned[4 * i];
          vTurned[4 * v + 1] = turned[4 * i + 1];
          putWay(from, to, vTurned, 4 * v + 2);
          vTime[v] = time[i];
        }
      };
      for (let i = begin; i <= end; ++i) {
        const isFirst = i === begin || starts(i), isLast = i === end || starts(i + 1);
        // The neighbours beyond the ends of the chunk still say where the path is going.
        const before = starts(i) ? i : i - 1, after = i + 1 >= count || starts(i + 1) ? i : i + 1;
        const twice = !isFirst && !isLast && turnsBack(i);
        if (twice) {
          roof(i, before, i);
          joined(index, v);
          roof(i, i, after);
        } else {
          const back = before < i && after > i && turnsBack(i);
          roof(i, back && isFirst ? i : before, back && isLast ? i : after);
          if (!isFirst) joined(index, v);
        }
      }
      const geometry = new THREE.BufferGeometry();
      const put = (name, array, items, normalized) => {
        const attribute = new THREE.BufferAttribute(array.slice(0, items * v), items, normalized);
        attribute.onUpload(function () { this.array = null; });
        geometry.setAttribute(name, attribute);
      };
      put('position', vWhere, 4, true);
      put('bytes', vBytes, 4, true);
      put('turned', vTurned, 4, true);
      put('time', vTime, 1, false);
      geometry.setIndex(new THREE.BufferAttribute(new Uint16Array(index), 1));
      return geometry;
    };
    // The two slopes between the last two roofs of `v` vertices.
    function joined(index, v) {
      for (const k of [-6, -3, -5, -3, -2, -5, -5, -2, -4, -2, -1, -4]) index.push(v + k);
    }
    const chunks = [];
    for (let i = 0; i + 1 < count; i += kChunk) {
      const end = Math.min(i + kChunk, count - 1);
      chunks.push({begin: i, end, from: Infinity, to: -Infinity, kinds: new Set(), mesh: add(new THREE.Mesh(new THREE.BufferGeometry(), beadMaterial)),
        make() { if (!this.made) { this.mesh.geometry = makeChunk(this.begin, this.end); this.made = true; } return this.mesh; }});
      chunks[chunks.length - 1].mesh.visible = false;
    }
    for (let p = 0; p < counts.length; ++p) {
      for (let c = Math.floor(first[p] / kChunk); c < chunks.length && chunks[c].begin < first[p + 1]; ++c) {
        chunks[c].from = Math.min(chunks[c].from, layer[p]);
        chunks[c].to = Math.max(chunks[c].to, layer[p]);
        chunks[c].kinds.add(kinds[p] & 1);
      }
    }

    // The same as thin lines, for machines that cannot draw beads fast enough.
    const shared = new THREE.BufferGeometry();
    const lineAttributes = {position: [where, 4, true], bytes: [bytes, 4, true], turned: [turned, 4, true], time: [time, 1, false]};
    for (const [name, [array, items, normalized]] of Object.entries(lineAttributes)) {
      shared.setAttribute(name, new THREE.BufferAttribute(array, items, normalized));
    }
    const lineShader = material(
      `attribute vec4 position, bytes, turned; attribute float time;
       ${kBeadColour}
       varying vec3 vColour;
       void main() {
         vColour = vec3(0.0);
         if (hidden(position.w * 65535.0 + uFirstLayer, bytes.w, time)) { nowhere(); return; }
         vec3 axis = direction(turned.xy);
         vColour = bead_colour(bytes, axis, time) * (0.62 + 0.38 * abs(axis.z));
         place(uLow + uSize * position.xyz);
       }`,
      'varying vec3 vColour; void main() { section(); gl_FragColor = vec4(vColour, 1.0); }');
    const lines = add(new THREE.LineSegments(shared, lineShader));
    lines.detail = detailed(shared, (level) => fewChains(counts, kSegments[level]));
    // The colours of heights span all but the thinnest and thickest hundredth; the few beyond would hide the differences.
    const heightAt = (share) => {
      let below = 0, h = 0;
      for (; h < 255 && below + heightCount[h] <= share * count; ++h) below += heightCount[h];
      return h / 255 * paths.max_height_mm;
    };
    return {chunks, lines, time, at, axis,
      ranges: {height: [heightAt(0.01), heightAt(0.99)], tilt: [0, Math.acos(leastUp) * 180 / Math.PI],
        speed: [leastFeed / 255 * paths.max_feed_mm_s, paths.max_feed_mm_s], order: [0, paths.end_s]}};
  }
  // z of the direction that two bytes stand for.
  function upOf(a, b) {
    const x = Math.abs(a / 127), y = Math.abs(b / 127), z = 1 - x - y;
    const square = z < 0 ? (1 - y) * (1 - y) + (1 - x) * (1 - x) : x * x + y * y;
    return z / (Math.sqrt(square + z * z) || 1);
  }
  function directionOf(axes, i) {
    let x = axes[2 * i] / 127, y = axes[2 * i + 1] / 127;
    const z = 1 - Math.abs(x) - Math.abs(y);
    if (z < 0) {
      const fx = (1 - Math.abs(y)) * (x < 0 ? -1 : 1);
      y = (1 - Math.abs(x)) * (y < 0 ? -1 : 1);
      x = fx;
    }
    return new THREE.Vector3(x, y, z).normalize();
  }
  const toolpaths = makePaths();

  function makeTravels() {
    const source = buffer('travel_points'), counts = buffer('travel_counts'), times = buffer('travel_times');
    const a = new THREE.Vector3().fromArray(scene.travel_box.low);
    const s = new THREE.Vector3().fromArray(scene.travel_box.high).sub(a);
    const points = new Float32Array(source.length), time = new Float32Array(source.length / 3), first = [0];
    const layer = new Float32Array(source.length / 3);  // of the path that it leads to
    source.forEach((v, i) => { points[i] = a.getComponent(i % 3) + s.getComponent(i % 3) * v / 65535; });
    for (let t = 0, i = 0; t < counts.length; ++t) {
      const next = toolpaths ? toolpaths.layer[Math.min(lastAtMost(toolpaths.times, 2, times[2 * t]) + 1, toolpaths.layer.length - 1)] : 0;
      for (let k = 0; k < counts[t]; ++k, ++i) { time[i] = times[2 * t]; layer[i] = next; }
      first.push(i);
    }
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(points, 3));
    geometry.setAttribute('time', new THREE.BufferAttribute(time, 1));
    geometry.setAttribute('layer', new THREE.BufferAttribute(layer, 1));
    const lines = add(new THREE.LineSegments(geometry, material(
      `attribute vec3 position; attribute float time, layer; uniform float uTime, uSince; uniform vec2 uLayers;
       void main() { if (time > uTime || time < uSince || layer < uLayers.x - 0.5 || layer > uLayers.y + 0.5) nowhere(); else place(position); }`,
      'uniform vec3 uColour; void main() { section(); gl_FragColor = vec4(uColour, 1.0); }', {uniforms: {uColour: {value: rgb(kTravel)}, uSince: {value: -1}}})));
    lines.detail = detailed(geometry, (level) => fewChains(counts, kSegments[level]));
    return {lines, points, times, counts, first};
  }
  // While the print goes on only its latest moves are shown: all of them would hide it.
  const recentTravel = paths ? paths.end_s / 50 : 0;
  const travels = present('travel_points') ? lazily({}, ['lines', 'points', 'times', 'counts', 'first'], makeTravels) : null;

  // ---------------------------------------------------------------- nozzle
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

  // ---------------------------------------------------------------- platform and marks
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

  // ---------------------------------------------------------------- camera
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

  // ---------------------------------------------------------------- drawing
  // Detail while something moves: 0 all, 1 fewer pixels, 2 beads and branches as lines, from then on ever fewer lines and
  // triangles; 3 no borders of layers, 4 half the pixels, 5 a third.
  // Frames slower than 30 a second lower it, much faster ones raise it; a picture that stands still always has all detail,
  // and what it costs says where to begin when something moves again.
  const kSlow = 33, kFast = 11, kLowest = 5;
  function levelFor(cost) { return [kSlow, 60, 150, 500, 1500].filter((limit) => cost > limit).length; }
  let averageFrame = 16, fastFrames = 0;
  function adapt(frame) {
    averageFrame += 0.35 * (Math.min(frame, 400) - averageFrame);
    fastFrames = averageFrame < kFast ? fastFrames + 1 : 0;
    if (averageFrame > kSlow && state.quality < kLowest) { ++state.quality; averageFrame = 20; }
    if (fastFrames > 60 && state.quality > 0) { --state.quality; fastFrames = 0; averageFrame = 20; }
  }

  let awake = false, lastMove = 0, lastFrame = 0, ratio = 0, drawnStill = false, drawnSize = '';
  function wake() { drawnStill = false; if (!awake) { awake = true; lastFrame = 0; requestAnimationFrame(frame); } }
  function moved() { lastMove = performance.now(); wake(); }

  function resize(level) {
    const wanted = Math.min(window.devicePixelRatio || 1, 2) * [1, 0.75, 0.75, 0.75, 0.5, 0.33][level];
    const w = canvas.clientWidth, h = canvas.clientHeight;
    if (wanted !== ratio || canvas.width !== Math.floor(w * wanted) || canvas.height !== Math.floor(h * wanted)) {
      ratio = wanted;
      renderer.setPixelRatio(ratio);
      renderer.setSize(w, h, false);
    }
    if (untouched && drawnSize !== `${w} ${h}`) Object.assign(view, fitted(...kHome));
    camera.aspect = w / Math.max(h, 1);
    drawnSize = `${w} ${h}`;
  }
  function applyState(level, moving) {
    const show = state.show, from = state.only ? state.layer : -1e9, to = state.layer;
    const set = (object, on) => { if (object) object.visible = on; };
    set(parts.model, show.model);
    set(parts.overhang, show.overhang);
    set(parts.platform, show.platform);
    set(parts.marks, show.marks);
    set(parts.chosen, show.marks && !!state.chosen);
    const glass = state.glass || !!scene.inspect, closed = !scene.inspect && state.axis === 'off';
    for (const object of [parts.model, parts.overhang]) {
      if (!object) continue;
      object.material.uniforms.uOpacity.value = glass ? 0.3 : 1;
      object.material.transparent = glass;
      object.material.depthWrite = !glass;
      object.material.side = glass || closed ? THREE.FrontSide : THREE.DoubleSide;
      object.renderOrder = glass ? 3 : 0;
    }
    for (const name of ['model', 'support']) {
      const on = show[name + '_layers'];
      if (!layers[name] || !(on || layers[name].made)) continue;
      if (on) layers[name].range(from, to, level);
      set(layers[name].fill, on);
      set(layers[name].lines, on && level < 3);
      layers[name].lines.material.uniforms.uOpacity.value = Math.min(Math.max(layerPixels() / 6, 0.2), 1);
    }
    for (const part of [parts.model, parts.overhang]) if (part && part.visible) part.detail(level);
    if (skeleton && (show.skeleton || show.struts || skeleton.made)) {
      set(skeleton.thin, show.skeleton && level < 2);
      set(skeleton.full, show.struts && level < 2);
      set(skeleton.lines, (show.skeleton || show.struts) && level >= 2);
      skeleton.lines.material.uniforms.uByCount.value = show.skeleton ? 1 : 0;
      if (skeleton.lines.visible) skeleton.lines.detail(level);
    }
    if (travels && (show.travel || travels.made)) {
      set(travels.lines, show.travel);
      if (show.travel) travels.lines.detail(level);
      travels.lines.material.uniforms.uSince.value = state.time < paths.end_s ? state.time - recentTravel : -1;
    }
    uniforms.uTime.value = state.time >= (paths ? paths.end_s : 0) ? 1e30 : state.time;
    uniforms.uLayers.value.set(from, to);
    uniforms.uMaterials.value.set(show.model_paths ? 1 : 0, show.support_paths ? 1 : 0);
    if (toolpaths) {
      const any = show.model_paths || show.support_paths;
      if (any || toolpaths.made) showPaths(any, from, to, level, moving);
      const text = placeNozzle();
      if (nozzle.visible !== (any && state.time < paths.end_s)) { nozzle.visible = !nozzle.visible; legend(); }
      if (controls.clock && controls.clock.textContent !== text) controls.clock.textContent = text;
    }
    axes.material.uniforms.uPixels.value.set(canvas.clientWidth, canvas.clientHeight);
    const k = 'xyz'.indexOf(state.axis);
    useCut(k >= 0);
    if (k < 0) uniforms.uPlane.value.set(0, 0, 0, 1);
    else {
      const sign = state.flip ? -1 : 1, at = low.getComponent(k) + state.cut * size.getComponent(k), n = [0, 0, 0];
      n[k] = sign;
      uniforms.uPlane.value.set(n[0], n[1], n[2], sign * at);
    }
  }
  function showPaths(any, from, to, level, moving) {
    const done = lastAtMost(toolpaths.times, 2, state.time);
    const last = toolpaths.first[done + 1] || 0;
    wantedChunks = any ? toolpaths.chunks.filter((c) => c.begin < last && c.from <= to && c.to >= from &&
      (c.kinds.has(0) && state.show.model_paths || c.kinds.has(1) && state.show.support_paths)) : [];
    const asBeads = level < 2 && beadsAffordable(kChunk * wantedChunks.length, moving);
    for (const chunk of toolpaths.chunks) chunk.mesh.visible = false;
    if (asBeads) for (const chunk of wantedChunks) chunk.make().visible = true;
    toolpaths.lines.visible = any && !asBeads;
    if (toolpaths.lines.visible) toolpaths.lines.detail(level);
    const modes = ['material', 'height', 'tilt', 'speed', 'order'];
    uniforms.uMode.value = modes.indexOf(state.colour);
    const range = toolpaths.ranges[state.colour];
    if (range) uniforms.uRange.value.set(range[0], range[1]);
  }
  // What a bead costs here is measured when the first ones are drawn over the lines of a still picture.
  let beadCost = 0, wantedChunks = [];  // ms a bead
  function beadsAffordable(beads, moving) {
    return beadCost > 0 && beadCost * beads < (moving ? 25 : 100);
  }
  // Milliseconds until the picture is there: reading a pixel waits for it.
  function timedRender() {
    const gl = renderer.getContext(), begin = performance.now();
    renderer.render(world, camera);
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
    return performance.now() - begin;
  }
  // Beads that are still to be drawn over the lines of a picture that stands still.
  let missing = [];
  function draw(level, moving) {
    missing = [];
    if (!renderer) return;
    resize(level);
    applyCamera();
    applyState(level, moving);
    if (moving) { renderer.render(world, camera); return; }
    // What was printed last hides most of the rest.
    if (toolpaths && toolpaths.made && toolpaths.lines.visible) missing = wantedChunks.slice().reverse();
    const nozzleLast = missing.length > 0 && nozzle.visible;  // see-through, so it comes after the beads
    if (nozzleLast) nozzle.visible = false;
    state.quality = levelFor(timedRender());
    if (nozzleLast) nozzle.visible = true;
    averageFrame = 20;
  }
  // Draws these alone over the picture that is there; milliseconds that took.
  function drawOver(objects) {
    const background = world.background, shown = world.children.filter((object) => object.visible);
    for (const object of shown) object.visible = false;
    for (const object of objects) object.visible = true;
    world.background = null;
    renderer.autoClear = false;
    const cost = timedRender();
    renderer.autoClear = true;
    world.background = background;
    for (const object of objects) object.visible = false;
    for (const object of shown) object.visible = true;
    return cost;
  }
  // Adds some of the missing beads: as many as keep the page answering.
  function drawMissing() {
    for (const begin = performance.now(); missing.length && performance.now() - begin < 60;) {
      const batch = missing.splice(0, beadCost > 0 ? Math.max(Math.floor(30 / (beadCost * kChunk)), 1) : 1).map((c) => c.make());
      if (beadCost === 0) drawOver(batch);  // the first picture uploads the numbers; the second one is timed
      const cost = drawOver(batch) / (kChunk * batch.length);
      beadCost = beadCost > 0 ? 0.7 * beadCost + 0.3 * cost : cost;
    }
    if (missing.length) return;
    drawOver([nozzle, parts.marks, parts.chosen].filter((object) => object && object.visible));
  }
  function frame(now) {
    if (flight) { stepFlight(now); lastMove = now; }
    if (state.playing) play(now);
    // Slow frames come late themselves: that is no standing still.
    const moving = !!flight || state.playing || now - lastMove < Math.max(250, 3 * averageFrame);
    if (moving && lastFrame) adapt(now - lastFrame);
    if (moving || !drawnStill) draw(moving ? state.quality : 0, moving);
    else if (missing.length) drawMissing();
    drawnStill = !moving;
    lastFrame = now;
    awake = moving || missing.length > 0;
    if (awake) requestAnimationFrame(frame);
  }

  // ---------------------------------------------------------------- playing the print
  let lastPlay = 0;
  function play(now) {
    const speed = paths.end_s / 60 * Number(controls.rate ? controls.rate.value : 1);
    if (lastPlay) state.time = Math.min(state.time + speed * (now - lastPlay) / 1000, paths.end_s);
    lastPlay = now;
    controls.time.value = state.time / paths.end_s;
    if (state.time >= paths.end_s) togglePlay(false);
  }
  function togglePlay(on) {
    if (!toolpaths) return;
    if (on && !(state.show.model_paths || state.show.support_paths)) preset('paths');
    if (on && state.time >= paths.end_s) state.time = 0;
    state.playing = on;
    lastPlay = 0;
    controls.play.textContent = on ? 'Pause' : 'Play';
    moved();
  }

  // ---------------------------------------------------------------- panel
  const controls = {boxes: {}, presets: {}};
  const kPresets = {
    part: {label: 'Part, support', title: 'The part and the printed support', on: ['model', 'overhang', 'support_layers']},
    overhang: {label: 'Overhang', title: 'The part from below, with the surface that would sag without support', on: ['model', 'overhang'], from: [-0.9, -0.42]},
    tree: {label: 'Tree', title: 'The support tree in the see-through part', on: ['model', 'overhang', 'skeleton'], glass: true},
    support: {label: 'Support', title: 'The printed support in the see-through part', on: ['model', 'overhang', 'support_layers'], glass: true},
    layers: {label: 'Layers', title: 'Curved layers of part and support', on: ['model_layers', 'support_layers']},
    paths: {label: 'Toolpaths', title: 'Beads as the robot lays them', on: ['model_paths', 'support_paths']},
  };
  function possible(name) {
    return {model: !!parts.model, overhang: !!parts.overhang, model_layers: !!layers.model, support_layers: !!layers.support,
      model_paths: !!toolpaths, support_paths: !!toolpaths, travel: !!travels, skeleton: !!skeleton, struts: !!skeleton,
      marks: !!parts.marks, platform: true}[name];
  }
  function preset(name) {
    const before = kPresets[state.preset];
    if (kPresets[name].from) flyTo(fitted(...kPresets[name].from));
    else if (before && before.from && view.elevation < 0) flyTo(fitted(...kHome));
    state.preset = name;
    state.glass = !!kPresets[name].glass;
    state.chosen = null;
    $('note').textContent = '';
    if (controls.allLayers && name !== 'layers' && name !== 'paths') controls.allLayers();
    for (const key of Object.keys(state.show)) {
      if (key !== 'marks' && key !== 'platform' && key !== 'travel') state.show[key] = kPresets[name].on.includes(key) && possible(key);
    }
    if (name === 'part' && !layers.support && toolpaths) state.show.support_paths = true;
    refresh();
  }
  function refresh() {
    for (const [name, input] of Object.entries(controls.boxes)) input.checked = name === 'glass' ? state.glass : state.show[name];
    for (const [name, button] of Object.entries(controls.presets)) button.classList.toggle('active', name === state.preset);
    legend();
    wake();
  }
  const kLabels = {
    model: ['Part surface', kModel], overhang: ['Overhang: needs support', kOverhang], model_layers: ['Layers of the part', kModel],
    support_layers: ['Layers of the support', kSupport], model_paths: ['Toolpaths of the part', kModel],
    support_paths: ['Toolpaths of the support', kSupport], travel: ['Travel moves (nothing is laid)', kTravel],
    skeleton: ['Tree, coloured by branches', '#3f7f8c'], struts: ['Tree at its printed thickness', kSupport],
    marks: [scene.inspect ? 'Marks of problems' : 'Marks of failed checks', kMark], platform: [`Platform, squares of ${gridStep} mm`, '#c9d1da'],
  };
  function showSection() {
    const list = el('div');
    for (const [name, [label, colour]] of Object.entries(kLabels)) {
      if (!possible(name)) continue;
      const input = controls.boxes[name] = el('input', {type: 'checkbox', id: 'show-' + name, onchange: () => {
        state.show[name] = input.checked;
        if ((name === 'skeleton' || name === 'struts') && input.checked) state.glass = true;
        state.preset = '';
        refresh();
      }});
      list.append(el('label', {}, input, el('span', {class: 'swatch', style: `background:${colour}`}), label));
      if (name !== 'model' || scene.inspect) continue;
      const glass = controls.boxes.glass = el('input', {type: 'checkbox', id: 'show-glass', onchange: () => {
        state.glass = glass.checked;
        if (glass.checked) state.show.model = true;
        state.preset = '';
        refresh();
      }});
      list.append(el('label', {}, glass, el('span', {class: 'swatch', style: `background:${colour};opacity:.35`}), 'Part see-through'));
    }
    return list;
  }
  function layerSection() {
    const {low: firstLayer, high: last} = layerRange;
    state.layer = last;
    const text = el('span', {}), sign = (k) => String(k).replace('-', '−');
    const say = () => {
      text.textContent = state.only ? `only layer ${sign(state.layer)}` : state.layer === last ? `all layers, ${sign(firstLayer)} to ${last}` :
        `layers ${sign(firstLayer)} to ${sign(state.layer)} of ${last}`;
    };
    const hint = firstLayer < 0 ? el('div', {class: 'hint'}, 'Layer 0 is the first of the part; support begins before it.') : null;
    controls.setLayer = (value) => {
      state.layer = Math.min(Math.max(value, firstLayer), last);
      controls.layer.value = state.layer;
      if (!['layers', 'paths', ''].includes(state.preset)) preset('layers');
      say();
      moved();
    };
    controls.layer = el('input', {type: 'range', id: 'layer', min: firstLayer, max: last, value: last, 'aria-label': 'layer',
      oninput: () => controls.setLayer(Number(controls.layer.value))});
    const only = el('input', {type: 'checkbox', id: 'only', onchange: () => { state.only = only.checked; controls.setLayer(state.layer); }});
    controls.allLayers = () => {
      state.only = only.checked = false;
      controls.layer.value = state.layer = last;
      say();
    };
    controls.toggleOnly = () => { only.checked = !only.checked; state.only = only.checked; controls.setLayer(state.layer); };
    say();
    return [el('h2', {}, 'Layers'), text, controls.layer, el('label', {}, only, 'only this layer'), hint].filter(Boolean);
  }
  const kColours = {material: 'material', height: 'bead height', tilt: 'nozzle tilt', speed: 'speed', order: 'order in time'};
  function pathSection() {
    const colour = controls.colour = el('select', {id: 'colour', onchange: () => {
      state.colour = colour.value;
      if (!(state.show.model_paths || state.show.support_paths)) preset('paths');
      refresh();
    }});
    for (const [value, label] of Object.entries(kColours)) colour.append(el('option', {value}, label));
    controls.time = el('input', {type: 'range', id: 'time', min: 0, max: 1, step: 0.0001, value: 1, 'aria-label': 'time of the print', oninput: () => {
      if (!(state.show.model_paths || state.show.support_paths)) preset('paths');
      state.time = paths.end_s * Number(controls.time.value);
      moved();
    }});
    controls.setTime = (seconds) => {
      state.time = Math.min(Math.max(seconds, 0), paths.end_s);
      controls.time.value = state.time / paths.end_s;
      moved();
    };
    controls.play = el('button', {id: 'play', onclick: () => togglePlay(!state.playing)}, 'Play');
    controls.rate = el('select', {'aria-label': 'speed of playing'});
    for (const [value, label] of [[0.1, 'the print in 10 min'], [1, 'the print in 1 min'], [4, 'the print in 15 s']]) {
      controls.rate.append(el('option', {value, selected: value === 1}, label));
    }
    controls.clock = el('div', {class: 'hint', id: 'clock'});
    return [el('h2', {}, 'Print'), el('div', {class: 'row'}, controls.play, controls.rate), controls.time, controls.clock,
      el('div', {class: 'row'}, 'Colour by', colour)];
  }
  function sectionSection() {
    const axis = controls.axis = el('select', {id: 'axis', onchange: () => { state.axis = axis.value; legend(); moved(); }});
    for (const [value, label] of [['off', 'no cut'], ['x', 'across x'], ['y', 'across y'], ['z', 'across z (height)']]) {
      axis.append(el('option', {value}, label));
    }
    const cut = el('input', {type: 'range', id: 'cut', min: 0, max: 1, step: 0.002, value: 0.5, 'aria-label': 'place of the cut', oninput: () => {
      state.cut = Number(cut.value);
      if (state.axis === 'off') { state.axis = axis.value = 'x'; legend(); }
      moved();
    }});
    const flip = el('input', {type: 'checkbox', onchange: () => { state.flip = flip.checked; moved(); }});
    return [el('h2', {}, 'Cut open'), el('div', {class: 'row'}, axis, el('label', {}, flip, 'other half')), cut];
  }
  function visit(check) {
    if (!check.places.length) return;
    check.next = ((check.next === undefined ? -1 : check.next) + 1) % check.places.length;
    const place = check.places[check.next], target = new THREE.Vector3().fromArray(place.at);
    state.show.marks = true;
    const then = place.path !== undefined && toolpaths && place.path < toolpaths.counts.length;
    if (then) {
      preset('paths');
      controls.setTime(timeAt(place.path, target));
    } else if (place.layer !== undefined && (layers.model || layers.support)) {
      preset('layers');
      controls.setLayer(place.layer);
    }
    state.chosen = place;
    if (parts.chosen) {
      parts.chosen.geometry.attributes.position.array.set(place.at);
      parts.chosen.geometry.attributes.position.needsUpdate = true;
    }
    refresh();
    $('note').textContent = `${check.name}, place ${check.next + 1} of ${check.places.length}: ${place.text}` + (then ? '. Shown as it stands at that moment.' : '');
    flyTo({target, distance: 0.35 * diagonal, azimuth: view.azimuth, elevation: Math.max(view.elevation, 0.2)});
  }
  // When the path comes nearest to a place.
  function timeAt(path, place) {
    let best = Infinity, time = toolpaths.times[2 * path];
    for (let i = toolpaths.first[path]; i < toolpaths.first[path + 1]; ++i) {
      const distance = Math.hypot(...[0, 1, 2].map((k) => toolpaths.at(i, k) - place.getComponent(k)));
      if (distance < best) { best = distance; time = toolpaths.time[i]; }
    }
    return time;
  }
  function checkButton(check) {
    const places = check.places.length;
    const where = places ? ` Click: fly to ${places > 1 ? `the next of ${places} places` : 'the place'}.` : '';
    return el('button', {class: 'check' + (check.ok ? '' : ' bad') + (check.severity ? ' ' + check.severity : ''), 'data-check': check.name,
      onclick: () => visit(check)},
      scene.inspect ? `${check.name}: ${check.value} (${check.severity})` : check.name,
      el('small', {}, (scene.inspect ? check.detail : `${short(check.value)}, limit ${window.curvesupReport.limitText(check, short)}. ${window.curvesupReport.sentence(check)}`) + where));
  }
  function checkSection() {
    const failed = checks.filter((c) => !c.ok), passed = checks.filter((c) => c.ok);
    if (scene.inspect) {
      const rank = (c) => ['refused', 'no support', 'mended', 'note'].indexOf(c.severity);
      checks.sort((a, b) => rank(a) - rank(b));
      return [el('h2', {}, 'Problems of this mesh'), checks.length ? null : el('div', {class: 'hint'}, 'None was found.'), ...checks.map(checkButton)];
    }
    if (!checks.length) return [];
    const more = el('details', {}, el('summary', {}, `${passed.length} passed`), ...passed.map(checkButton));
    const rest = failed.slice(4);
    const others = rest.length ? el('details', {}, el('summary', {}, `${rest.length} more failed`), ...rest.map(checkButton)) : null;
    return [el('h2', {}, `Checks: ${failed.length ? failed.length + ' failed' : 'all passed'}`), ...failed.slice(0, 4).map(checkButton), others, more];
  }
  function buildPanel() {
    const panel = $('panel');
    const failed = checks.some((c) => !c.ok);
    if (scene.inspect) panel.append(...checkSection().filter(Boolean));
    const usable = Object.entries(kPresets).filter(([, p]) => p.on.filter((n) => n !== 'model').some(possible));
    if (!scene.inspect && usable.length > 1) {
      const grid = el('div', {class: 'presets'});
      for (const [name, p] of usable) {
        controls.presets[name] = el('button', {id: 'preset-' + name, title: p.title, onclick: () => preset(name)}, p.label);
        grid.append(controls.presets[name]);
      }
      panel.append(el('h2', {}, 'Look at'), grid);
    }
    if (failed && !scene.inspect) panel.append(...checkSection().filter(Boolean));
    if (layers.model || layers.support || toolpaths) panel.append(...layerSection());
    if (toolpaths) panel.append(...pathSection());
    panel.append(...sectionSection());
    panel.append(el('h2', {}, 'Show'), showSection());
    if (!failed && !scene.inspect) panel.append(...checkSection().filter(Boolean));
  }

  // ---------------------------------------------------------------- legend
  function legend() {
    const box = $('legend');
    box.textContent = '';
    const swatch = (colour, text) => box.append(el('div', {class: 'row'}, el('span', {class: 'swatch', style: `background:${colour}`}), text));
    const scale = (title, from, to) => {
      const strip = el('canvas', {width: 150, height: 1}), pen = strip.getContext('2d');
      for (let x = 0; x < 150; ++x) {
        pen.fillStyle = `rgb(${mapColour(x / 149).map((c) => Math.round(255 * c)).join()})`;
        pen.fillRect(x, 0, 1, 1);
      }
      box.append(el('div', {}, title), strip, el('div', {class: 'ends'}, el('span', {}, from), el('span', {}, to)));
    };
    if (!scene.inspect && parts.model && state.axis !== 'off' && state.show.model) swatch('#b4b9bf', 'where the cut goes through the part');
    const s = state.show, byPath = (s.model_paths || s.support_paths) && state.colour !== 'material';
    if (!byPath && (s.model || s.model_layers || s.model_paths)) swatch(kModel, 'part');
    if (!byPath && (s.support_layers || s.support_paths || s.struts)) swatch(kSupport, 'support');
    if (s.overhang && parts.overhang) swatch(kOverhang, 'overhang: would sag without support');
    if (scene.inspect && (parts.bad || parts.bad_lines)) swatch(kOverhang, 'bad elements');
    if (s.marks && parts.marks) swatch(kMark, scene.inspect ? 'places of problems' : 'failed checks');
    if (s.travel && travels) swatch(kTravel, state.time < paths.end_s ? `travel of the last ${clockText(recentTravel)}` : 'travel');
    if (nozzle && nozzle.visible) swatch(kNozzle, 'nozzle');
    if (s.skeleton && skeleton) scale('branches carried (logarithmic)', '1', String(skeleton.most));
    if (byPath) {
      const range = toolpaths.ranges[state.colour];
      const unit = {height: 'mm', tilt: '°', speed: 'mm/s'}[state.colour];
      const text = (v) => state.colour === 'order' ? clockText(v) : `${short(v)} ${unit}`;
      const beyond = state.colour === 'height';
      scale({height: 'bead height', tilt: 'nozzle tilt from vertical', speed: 'speed of the nozzle', order: 'time of the print'}[state.colour],
        (beyond ? '≤ ' : '') + text(range[0]), (beyond ? '≥ ' : '') + text(range[1]));
    }
  }

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
})();
