// What stands beside the picture.

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
