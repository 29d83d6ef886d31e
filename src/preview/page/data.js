// The page's script begins here. `scene` says what there is, `data` holds the numbers; nothing is fetched.
//
// The files become one script, in this order: data.js; what is drawn and how (materials, model, detail, layers, skeleton,
// toolpaths, nozzle, marks), each thing in a make... function that gives three.js objects, made when first shown; camera.js;
// drawing.js, which brings all of it into line with `state` and keeps 30 frames a second by levels of detail; panel.js and
// keys.js, which do nothing but change `state` and wake the drawing. What the report page says is in report.js.

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
