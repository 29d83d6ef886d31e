// The report page: the numbers of the report with what they mean. Builds elements only; draws nothing.
window.curvesupReport = (function () {
  'use strict';

  // What a check proves, for somebody who has not read the paper.
  const kMeaning = {
    'hull.model_clearance_mm': 'The region where support may grow keeps its distance from the part all around.',
    'hull.low_z_mm': 'The support region reaches below the platform, so that the tree can end exactly on it.',
    'domain.interface_faces_conform': 'Every face of the part is also a face of the support mesh: layers meet without a gap.',
    'domain.hull_faces_kept': 'The mesher kept the outer surface of the support region as given.',
    'domain.volume_rel_error': 'Volumes of part and support region add up to the whole.',
    'domain.inverted_tets': 'No element of the support mesh is inside out.',
    'extension.false_extrema': 'Layers of the support have no start or end in mid air.',
    'extension.residual': 'The equations for the layers of the support were solved accurately.',
    'layers.non_manifold_edges': 'Every layer is a clean sheet.',
    'layers.border_gaps': 'Layers of part and support meet point for point.',
    'layers.above_platform': 'Nothing lies below the platform.',
    'skeleton.leaves_conserved': 'No branch of the tree vanishes: what starts under an overhang arrives at an end.',
    'skeleton.edges_through_model': 'No branch runs through the part.',
    'skeleton.edge_angle_deg': 'No branch leans more than the material can carry by itself.',
    'skeleton.loose_nodes': 'Branches end on the platform or on the part, nowhere else.',
    'skeleton.short_branches': 'Branches that end on the part are at least one layer long.',
    'trim.support_height_p99': 'Layers of support are hardly thicker than those of the part: thicker ones are laid in passes.',
    'trim.area_conserved': 'Cutting the layers lost no area.',
    'trim.coarsening_volume': 'Cut layers have no more triangles than they need, and as much volume as before.',
    'certificate.coverage': 'Share of the overhanging area with support, part or platform right below it, measured anew.',
    'certificate.floating_pieces': 'No piece of support is printed in mid air.',
    'certificate.edge_angle_deg': 'No branch leans too far, measured anew.',
    'certificate.edges_through_model': 'No branch runs through the part, measured anew.',
    'certificate.leaves_grounded': 'Every branch leads to an end.',
    'certificate.branch_counts': 'Where branches join, their counts add up.',
    'certificate.leaf_count_at_ends': 'The ends carry exactly as many branches as started.',
    'certificate.ends': 'Ends lie on the platform or on an upward face of the part.',
    'certificate.toolpath_coverage': 'Beads cover the layers, measured anew at hundreds of thousands of places.',
    'certificate.toolpath_sparse_coverage': 'Sparse support has its lines as near to each other as was asked for, and is full under the part.',
    'certificate.toolpath_overlap': 'Beads hardly lie over one another.',
    'certificate.toolpath_spacing_median': 'Neighbouring lines are a bead apart.',
    'certificate.toolpath_spacing_spread': 'Nowhere are neighbouring lines much nearer or farther than a bead.',
    'certificate.toolpath_segment_volume': 'Each short stretch gets exactly the plastic of its width, height and length.',
    'certificate.toolpath_height': 'Each bead is as high as its layer is thick there.',
    'certificate.toolpath_model_volume': 'Plastic laid for the part fills its layers, measured anew.',
    'certificate.toolpath_support_volume': 'Plastic laid for the support fills its layers, measured anew.',
    'certificate.toolpath_layer_volume': 'In every single layer the plastic fills the layer; the value is that of the worst one.',
    'certificate.toolpath_points_on_layer': 'Every point of every line lies on its curved layer.',
    'certificate.toolpath_segments_on_layer': 'No line leaves its layer while plastic is laid.',
    'certificate.toolpath_pieces': 'Every piece of a layer that is large enough for a bead has a line.',
    'certificate.toolpath_order': 'Nothing is laid below what is already there.',
    'toolpath.pieces_without_path': 'Every piece of every layer that a bead can fill has a path.',
    'toolpath.max_flow_mm3_s': 'The nozzle never lays more plastic than it melts.',
    'toolpath.model_volume': 'Plastic laid for the part fills its layers.',
    'toolpath.support_volume': 'Plastic laid for the support fills its layers.',
    'toolpath.min_height_mm': 'No bead is thinner than the nozzle can lay.',
    'toolpath.max_height_mm': 'No bead is thicker than the nozzle can lay.',
    'motion.unreachable': 'The arm reaches every point of every path.',
    'motion.collisions': 'Nozzle, head and arm touch nothing that is printed, and not the platform.',
    'motion.forward_kinematics_m': 'The joint angles put the nozzle tip where it should be.',
    'motion.forward_kinematics_rad': 'The joint angles turn the nozzle as it should be.',
    'motion.branch_jumps': 'No joint swings suddenly while printing.',
    'motion.joint_speed_ratio': 'No joint needs more than its allowed share of full speed.',
    'motion.singularity_metric': 'The arm keeps away from poses in which it loses a direction.',
    'motion.volume_error': 'Plastic per path is the same before and after planning the arm.',
    'motion.near_waypoints': 'Waypoints are far enough apart for the controller.',
    'motion.tilt_deviation_deg': 'The nozzle stays near the layer normal.',
    'emit.volume': 'The programs lay the volume of the toolpaths.',
    'emit.parts_over_cap': 'Every robot program is small enough for the controller.',
    'emit.chunk_mismatch_s': 'Arm and extruder stay in step between two waits for each other.',
    'emit.flow_ratio': 'The extruder never needs more flow than the filament allows.',
  };
  // What a check that holds tells, and what one that failed should.
  function sentence(check) {
    const text = kMeaning[check.name];
    if (!text) return check.detail;
    return check.ok ? text : `Wanted: ${text[0].toLowerCase()}${text.slice(1)}`;
  }

  // The limit with the side on which the value has to be, where value and verdict tell it.
  function limitText(check, short) {
    const side = check.severity || check.limit === 0 || check.value === check.limit ? '' : (check.value < check.limit) === check.ok ? '≤ ' : '≥ ';
    return side + short(check.limit);
  }

  const kSections = {
    input: ['Input', 'The file that was sliced.'],
    mesh: ['Mesh', 'The mesh as it came from its file.'],
    model: ['Part', 'The part as a mesh of tetrahedra, placed on the platform.'],
    field: ['Growth field', 'The number G that grows through the part in printing order; layers are its level surfaces.'],
    overhang: ['Overhang', 'Surface that would sag without something below it.'],
    domain: ['Support region', 'The space between part and platform in which support may grow.'],
    extension: ['Layers outside the part', 'The growth field carried on into the support region.'],
    layers: ['Layers', 'Curved layers of part and support; one number k for both.'],
    skeleton: ['Tree', 'The support tree before it gets its thickness.'],
    support: ['Support', 'What is printed to hold the overhang.'],
    toolpath: ['Toolpaths', 'Lines that the nozzle follows while it lays plastic.'],
    motion: ['Arm', 'How the robot arm moves.'],
    print: ['Print', 'An estimate of the whole print.'],
    robot: ['Robot', 'How the robot arm moves.'],
  };
  const kKeys = {
    'input.model': 'file that was sliced', 'field.inverted_tets': 'tetrahedra in which G points down', 'overhang.vertices': 'points of those triangles',
    'overhang.blocked_area_mm2': 'overhanging area that the configuration leaves without support',
    'support.area_mm2': 'area of all printed layers of support', 'support.pieces': 'connected regions of printed support',
    'support.max_height_mm': 'thickest layer of support', 'support.blocked_area_mm2': 'overhanging area that the configuration leaves without support',
    'toolpath.max_height_mm': 'thickest bead', 'toolpath.max_flow_mm3_s': 'most plastic that the nozzle lays at a time', 'toolpath.points': 'points of all lines',
    'toolpath.covered_fraction': 'share of the layers under a bead', 'layers.triangles': 'triangles of all layers',
    low_mm: 'lowest corner of the box around it', high_mm: 'highest corner of the box around it', size_mm: 'size of the box around it',
    flipped_tets: 'tetrahedra that were inside out and have been mended', duplicate_vertices: 'points that were given twice and have been joined',
    unreferenced_vertices: 'points that no tetrahedron uses', weak_tets: 'tetrahedra in which G hardly grows: layers are thick there',
    interior_minima: 'places inside the part where G starts', interior_maxima: 'places inside the part where G ends', layer_count: 'layers that the part is cut into',
    minima: 'lowest points in mid air, which need support too', enforced_area_mm2: 'area that the configuration wants supported',
    hull_margin_mm: 'distance of the region from the part', hull_attempts: 'tries until the region kept its distance',
    unknowns: 'numbers that were solved for', residual: 'how far the equations are from being met', false_extrema: 'starts or ends of layers in mid air',
    hull_extrema: 'starts or ends of layers at the outer border, which do no harm', degenerate_triangles: 'triangles without area, which do no harm',
    pieces_in_passes: 'regions that are laid in several passes, being too thick for one', passes_max: 'most passes of one layer',
    height_p50_mm: 'middle thickness of the support', height_p99_mm: 'thickness that 99 % of the support stay below',
    removed_pieces: 'regions too small to print, left out', covered_without_support_fraction: 'share of the overhang that the platform or the part itself holds',
    floating: 'pieces in mid air, each with its place', uncovered_faces: 'triangles of the overhang without support, each with its area',
    dots: 'regions as small as a bead, laid as one short line', dust_pieces: 'specks far smaller than a bead, left out', dust_area_mm2: 'area of those specks',
    rings: 'closed lines, from the border inwards', centre_lines: 'lines in the middle, where no ring fits', lines: 'lines inside of rings, for fills with lines',
    sparse_pieces: 'regions whose lines leave room between them', sparse_covered_fraction: 'share of these regions as near to a line as their spacing promises', interface_pieces: 'regions filled all over because the model lies right over them',
    overhang_mm: 'length of beads over nothing, when they have a speed of their own', slowed_mm: 'length of beads that are laid slower so that a layer can cool',
    laying_time_s: 'time while plastic flows', groups: 'runs of one material without a change', batched_layers: 'support layers laid ahead of the model, to save changes of material', jumps: 'moves without laying between lines',
    jumps_inside_pieces: 'of these inside one region', naive_jumps: 'moves there would be if rings were not joined', naive_jumps_inside_pieces: 'of these inside one region',
    retractions: 'times that the filament is pulled back before a move', min_height_mm: 'thinnest bead', unprinted: 'regions without a line, each with its place',
    overlap: 'plastic laid over plastic, share of the whole', spacing_mm: 'distance between neighbouring lines',
    max_point_distance_mm: 'farthest that a point of a line is from its layer', segments_off_layer: 'stretches that leave their layer',
    max_layer_volume_error: 'worst layer: plastic against volume, relative', printed_filament_mm: 'filament that ends up in the print, without purging',
    tilt_deviation_median_deg: 'middle angle between nozzle and layer normal', tilt_deviation_p95_deg: 'angle that 95 % of the points stay below',
    tilt_deviation_max_deg: 'largest angle between nozzle and layer normal', raised_points: 'points that the nozzle passes higher to keep its head off', max_raise_mm: 'by how much at most', rotation_limited: 'points where turning the nozzle, not moving it, sets the pace',
    stops: 'places inside lines where arm and extruder stop', gates: 'places where arm and extruder wait for each other',
    unreachable_places: 'first point out of reach of each line', collision_places: 'first contact of each line', triangles: 'triangles of the surface',
    shells: 'closed surfaces', min_edge_mm: 'shortest edge', max_edge_mm: 'longest edge', worst_tet: 'number of the worst tetrahedron',
    sha256: 'fingerprint of the file', vertices: 'points of the mesh', tets: 'tetrahedra', boundary_faces: 'triangles of the surface',
    volume_mm3: 'volume', genus: 'holes that go through', components: 'separate bodies', cavities: 'closed voids',
    flipped: 'G ran downwards and was turned over', grad_min: 'least gradient of G', grad_median: 'middle gradient of G', grad_max: 'largest gradient of G',
    faces: 'triangles that overhang', area_mm2: 'overhanging area', points_added: 'branches started inside large faces',
    dropped: 'places that got no branch, with the reason', support_tets: 'tetrahedra outside the part', interface_faces: 'triangles between part and support region',
    volume_rel_error: 'volume that does not add up, relative', min_dihedral_deg: 'sharpest angle of a tetrahedron', max_dihedral_deg: 'bluntest angle of a tetrahedron',
    min_quality: 'worst tetrahedron: 1 is regular, 0 is flat', usable: 'slice accepts this mesh', supportable: 'the space around the part can be meshed, so it can have support',
    model: 'of the part', support: 'of the support', support_printed: 'layers with printed support',
    thickness_p1_mm: 'thinnest: 1 % of the area is thinner', thickness_p50_mm: 'middle thickness', thickness_p99_mm: 'thickest: 1 % of the area is thicker',
    leaves: 'branch tips under the overhang', nodes: 'joints of the tree', edges: 'pieces of branches', platform_ends: 'feet on the platform', model_ends: 'feet on the part',
    leaf_count_at_ends: 'branch tips counted at the feet', max_branch_count: 'most tips carried by one foot', max_edge_angle_deg: 'steepest lean of a branch', length_mm: 'length',
    method: 'kind of support', untrimmed_volume_mm3: 'volume if the region were filled', covered_overhang_fraction: 'share of the overhang that is held',
    unsupported_area_mm2: 'overhang without support', floating_pieces: 'pieces in mid air', paths: 'separate lines', layer_volume_mm3: 'volume of the layers that the beads fill',
    pieces: 'connected regions of layers', pieces_without_path: 'regions without a line', waypoints: 'poses sent to the arm', parts: 'robot program files',
    travel_mm: 'way without laying', max_tilt_deg: 'most that the nozzle leans', unreachable: 'points out of reach', collisions: 'contacts',
    min_singularity_metric: 'nearest to a pose that loses a direction; larger is better', max_joint_speed_ratio: 'fastest joint, share of its limit',
    time_s: 'time of the print', filament_mm: 'filament used', material_changes: 'changes between the two materials',
  };
  // Ends of keys, their units, and the larger unit that so many of them make.
  const kUnits = [['_mm3_s', 'mm³/s'], ['_mm3', 'mm³', 1000, 'cm³'], ['_mm2', 'mm²', 100, 'cm²'], ['length_mm', 'mm', 1000, 'm'],
    ['travel_mm', 'mm', 1000, 'm'], ['filament_mm', 'mm', 1000, 'm'], ['_mm', 'mm'], ['_deg', '°'], ['_s', 's']];
  function unit(key, value, tools) {
    if (/(^|_)time_s$/.test(key) && typeof value === 'number') return tools.clockText(value);
    if (typeof value === 'boolean') return value ? 'yes' : 'no';
    if (Array.isArray(value)) return `(${value.map((v) => unit('', v, tools)).join(', ')})`;
    if (typeof value !== 'number') return typeof value === 'string' ? value : JSON.stringify(value);
    if (/(^|_)(tet|face|path|layer)$/.test(key)) return String(value);  // which one, not how many
    if (/_fraction$/.test(key)) return `${(100 * value).toFixed(2)} %`;
    const [, name, many, larger] = kUnits.find(([end]) => key.endsWith(end)) || [];
    if (name) return many && Math.abs(value) >= many ? `${tools.short(value / many)} ${larger}` : `${tools.short(value)} ${name}`;
    return Number.isInteger(value) ? value.toLocaleString('en') : tools.short(value);
  }
  // What a list says of one place: "position (1, 2, 3), face 7, reason ...".
  function entryText(entry, tools) {
    const name = (key) => key.replace(/_(mm\d?|deg|s)$/, '').replace(/_/g, ' ');
    return Object.entries(entry).map(([key, value]) => `${name(key)} ${unit(key, value, tools)}`).join(', ');
  }

  // A dotted name that may break after its dots and underscores.
  function nameCell(name, tools) {
    const cell = tools.el('td', {class: 'name'});
    for (const piece of name.split(/(?<=[._])/)) cell.append(piece, tools.el('wbr'));
    return cell;
  }

  const kEntries = 100;  // of a list
  function sectionTable(name, section, tools) {
    const {el} = tools, table = el('table', {class: 'numbers'});
    const sentence = (key) => kKeys[`${name}.${key}`] || kKeys[key] || '';
    for (const [key, value] of Object.entries(section)) {
      if (Array.isArray(value) && value.length && typeof value[0] === 'object') {
        const shown = value.slice(0, kEntries).map((entry) => el('li', {}, entryText(entry, tools)));
        if (value.length > kEntries) shown.push(el('li', {}, `and ${value.length - kEntries} more in report.json`));
        table.append(el('tr', {}, nameCell(key, tools), el('td', {class: 'number'}, `${value.length} ${value.length > 1 ? 'entries' : 'entry'}`),
          el('td', {class: 'meaning'}, sentence(key), el('details', {}, el('summary', {}, 'show'), el('ul', {}, ...shown)))));
        continue;
      }
      let text;
      if (Array.isArray(value)) text = value.length ? value.map((v) => unit(key, v, tools)).join(', ') : 'none';
      else if (value && typeof value === 'object') text = Object.entries(value).map(([k, v]) => `${k} ${unit(key, v, tools)}`).join(', ');
      else text = unit(key, value, tools);
      const long = text.length > 40;
      table.append(el('tr', {}, nameCell(key, tools), el('td', {class: long ? '' : 'number'}, text), el('td', {class: 'meaning'}, sentence(key))));
    }
    return table;
  }

  function tiles(report, tools) {
    const {el} = tools, out = el('div', {class: 'tiles'});
    const add = (label, value) => { if (value !== undefined && value !== null) out.append(el('div', {class: 'tile'}, el('b', {}, value), label)); };
    const get = (section, key) => (report[section] || {})[key];
    const with_ = (value, f) => (value === undefined || value === null ? null : f(value));
    add('time of the print', with_(get('print', 'time_s'), tools.clockText));
    add('volume of the part', with_(get('model', 'volume_mm3'), (v) => `${tools.short(v / 1000)} cm³`));
    add('volume of the support', with_(get('support', 'volume_mm3'), (v) => `${tools.short(v / 1000)} cm³`));
    add('of the overhang is held', with_(get('support', 'covered_overhang_fraction'), (v) => `${(100 * v).toFixed(2)} %`));
    add('layers of the part', with_(get('layers', 'model'), String));
    add('layers of the support', with_(get('layers', 'support_printed'), String));
    const filament = get('print', 'filament_mm');
    if (filament && filament.model !== undefined) add('filament, part and support', `${tools.short(filament.model / 1000)} + ${tools.short(filament.support / 1000)} m`);
    add('material changes', with_(get('print', 'material_changes'), String));
    add('most that the nozzle leans', with_(get('motion', 'max_tilt_deg'), (v) => `${tools.short(v)}°`));
    return out.childElementCount ? out : null;
  }

  function checkTable(scene, tools) {
    const {el, short} = tools, table = el('table', {class: 'checks'});
    table.append(el('tr', {}, ...['', ...(scene.inspect ? ['problem', 'how many', 'allowed'] : ['check', 'value', 'limit']), 'what it means'].map((h) => el('th', {}, h))));
    const ordered = [...scene.checks].sort((a, b) => Number(a.ok) - Number(b.ok));
    for (const check of ordered) {
      const text = scene.inspect ? check.detail : sentence(check);
      const extra = !scene.inspect && kMeaning[check.name] && check.detail ? el('details', {open: !check.ok}, el('summary', {}, check.ok ? 'how it was measured' : 'what was measured'), check.detail) : null;
      table.append(el('tr', {},
        el('td', {}, el('span', {class: `pill ${check.severity === 'note' ? 'note-back' : check.severity === 'mended' ? 'mended-back' : check.ok ? 'good-back' : 'bad-back'}`}, scene.inspect ? check.severity : check.ok ? 'passed' : 'failed')),
        nameCell(check.name, tools), el('td', {class: 'number'}, short(check.value)), el('td', {class: 'number'}, check.severity === 'note' || check.severity === 'mended' ? 'any' : limitText(check, short)),
        el('td', {class: 'meaning'}, text, extra)));
    }
    return table;
  }

  function bytesText(n) {
    return n >= 1e6 ? `${(n / 1e6).toFixed(1)} MB` : n >= 1e3 ? `${(n / 1e3).toFixed(1)} kB` : `${n} B`;
  }

  // Files that differ in their number only become one line: hundreds of parts would hide the others.
  function grouped(files) {
    const groups = new Map();
    for (const file of files) {
      const key = file.path.replace(/\d+S?(?=\.\w+$)/, '#');
      if (!groups.has(key)) groups.set(key, []);
      groups.get(key).push(file);
    }
    return [...groups.values()].flatMap((group) => (group.length < 4 ? group : [{
      path: `${group[0].path} ... ${group[group.length - 1].path.split('/').pop()}`,
      bytes: group.reduce((sum, file) => sum + file.bytes, 0),
      what: `${group.length} files: ${group[0].what}, and so on`,
    }]));
  }

  function build(root, scene, tools) {
    const {el} = tools, report = scene.report || {};
    const contents = el('p', {class: 'contents'});
    root.append(contents);
    const head = (text) => {
      const heading = el('h2', {}, text);
      root.append(heading);
      contents.append(el('button', {onclick: () => heading.scrollIntoView()}, text.split(':')[0]));
    };
    const top = tiles(report, tools);
    if (top) { head('In short'); root.append(top); }
    if (scene.checks && scene.checks.length) {
      const failed = scene.checks.filter((c) => !c.ok).length;
      head(scene.inspect ? 'Problems of this mesh' : failed ? `Checks: ${failed} of ${scene.checks.length} failed` : `Checks: all ${scene.checks.length} passed`);
      root.append(checkTable(scene, tools));
    }
    if (scene.plots && scene.plots.length) {
      head('Plots');
      for (const plot of scene.plots) {
        root.append(el('figure', {}, el('img', {src: 'data:image/png;base64,' + plot.png, alt: plot.title}), el('figcaption', {class: 'hint'}, plot.caption)));
      }
    }
    for (const [name, section] of Object.entries(report)) {
      if (!section || typeof section !== 'object' || Array.isArray(section) || name === 'program') continue;
      const [title, sentence] = kSections[name] || [name, ''];
      head(title);
      if (sentence) root.append(el('p', {class: 'hint'}, sentence));
      root.append(sectionTable(name, section, tools));
    }
    if (scene.files && scene.files.length) {
      head('Files');
      const table = el('table', {class: 'numbers'});
      for (const file of grouped(scene.files)) {
        table.append(el('tr', {}, nameCell(file.path, tools), el('td', {class: 'number'}, bytesText(file.bytes)), el('td', {class: 'meaning'}, file.what)));
      }
      root.append(table);
    }
    if (scene.config) {
      head('Configuration');
      root.append(el('p', {class: 'hint'}, 'Every key with the value that was used.'),
        el('details', {}, el('summary', {}, 'show'), el('pre', {}, JSON.stringify(scene.config, null, 2))));
    }
    if (report.program) root.append(el('p', {class: 'hint'}, `${report.program.name} ${report.program.version}`));
  }

  return {build, sentence, limitText};
})();
