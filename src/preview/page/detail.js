// Lines and triangles with less detail, for while something moves.

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
