// Brings the picture into line with `state`.

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
