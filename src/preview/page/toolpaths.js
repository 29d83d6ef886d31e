// Beads as they are laid, and which of them are at a time of the print.

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
