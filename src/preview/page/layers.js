// Printed layers, of the model and of the support.

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
