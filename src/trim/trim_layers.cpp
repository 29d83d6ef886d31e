#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <optional>
#include <span>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/trim/trim.h"
#include "trim/coarsen.h"
#include "trim/divide_slab.h"
#include "trim/drop_floating.h"
#include "trim/reachable_tets.h"
#include "trim/sheet_cutter.h"
#include "trim/trimmed_sheet.h"

namespace curvesup {

namespace {

// Without a limit, spots that are so many times as high as wanted get passes of their own.
constexpr double kSpot = 1.5;

void check_options(const TrimOptions& options) {
  const auto refuse = [](const char* name, double value, const char* limit) {
    throw Error(ErrorKind::usage, "trim", format("%s = %g, it must be %s", name, value, limit));
  };
  if (!(options.edge_length_mm > 0.0)) refuse("edge_length_mm", options.edge_length_mm, "positive");
  if (!(options.min_piece_area_mm2 >= 0.0)) refuse("min_piece_area_mm2", options.min_piece_area_mm2, "0 or more");
  if (!(options.max_height_mm >= 0.0)) refuse("max_height_mm", options.max_height_mm, "0 or more");
  if (options.max_passes < 1) refuse("max_passes", options.max_passes, "1 or more");
}

// The lowest vertex of a sheet, and how far from it the others reach: vertices of a sheet have ids close together.
struct VertexRange {
  Index low = std::numeric_limits<Index>::max(), count = 0;
};
VertexRange vertex_range(const LayerStack& stack, const Sheet& sheet) {
  VertexRange range;
  Index high = -1;
  for (Index i = sheet.first_triangle; i < sheet.first_triangle + sheet.triangle_count; ++i) {
    for (const Index v : stack.triangles[i]) {
      range.low = std::min(range.low, v);
      high = std::max(high, v);
    }
  }
  range.count = std::max(0, high - range.low + 1);
  return range;
}

// The quadrilateral in which a tet is cut, if two triangles are its halves: they meet in the diagonal from its first corner.
std::optional<std::array<Index, 4>> joined(const LayerStack& stack, Index first, Index second) {
  const auto &t = stack.triangles[first], &u = stack.triangles[second];
  if (stack.triangle_tet[first] != stack.triangle_tet[second]) return std::nullopt;
  if (t[0] == u[0] && t[2] == u[1]) return std::array{t[0], t[1], t[2], u[2]};
  if (t[1] == u[0] && t[2] == u[2]) return std::array{u[0], u[1], u[2], t[0]};
  return std::nullopt;
}

TrimmedSheet trim_sheet(const LayerStack& stack, const Sheet& sheet, const ReachableTets& reachable, const Solid& solid,
                        const TrimOptions& options) {
  TrimmedSheet result;
  result.head = sheet;
  const VertexRange range = vertex_range(stack, sheet);
  std::vector<Index> local(range.count, kNone);
  SheetCutter cutter(solid, options.edge_length_mm);
  const auto local_vertex = [&](Index v) {
    Index& id = local[v - range.low];
    if (id == kNone) {
      id = cutter.add_vertex(stack.vertices[v]);
      result.source.resize(id + 1, kNone);
      result.source[id] = v;
    }
    return id;
  };
  const Index end = sheet.first_triangle + sheet.triangle_count;
  for (Index i = sheet.first_triangle; i < end; ++i) {
    const auto& t = stack.triangles[i];
    const Index tet = stack.triangle_tet[i];
    if (!reachable[tet]) {
      result.cut_away_area += triangle_area(stack.vertices[t[0]], stack.vertices[t[1]], stack.vertices[t[2]]);
      continue;
    }
    if (auto ring = i + 1 < end ? joined(stack, i, i + 1) : std::nullopt) {
      for (Index& v : *ring) v = local_vertex(v);
      cutter.add_polygon(*ring, tet, reachable.around(tet));
      ++i;
    } else {
      cutter.add_polygon(std::array{local_vertex(t[0]), local_vertex(t[1]), local_vertex(t[2])}, tet, reachable.around(tet));
    }
  }
  result.cut_away_area += cutter.cut_away_area();
  result.vertices = cutter.vertices();
  result.triangles = cutter.triangles();
  result.triangle_tet = cutter.triangle_tet();
  result.source.resize(result.vertices.size(), kNone);
  return result;
}

struct Quantiles {
  double p50 = 0.0, p99 = 0.0, min = 0.0, max = 0.0;
};

// Of values[i] with weight[i]; values with no weight do not count.
Quantiles quantiles(std::vector<std::pair<double, double>> samples) {
  Quantiles q;
  std::erase_if(samples, [](const auto& s) { return s.second <= 0.0; });
  if (samples.empty()) return q;
  std::sort(samples.begin(), samples.end());
  double total = 0.0, sum = 0.0;
  for (const auto& s : samples) total += s.second;
  q.min = samples.front().first;
  q.p50 = q.p99 = q.max = samples.back().first;
  bool half = false;
  for (const auto& [value, weight] : samples) {
    sum += weight;
    if (!half && sum >= 0.5 * total) {
      q.p50 = value;
      half = true;
    }
    if (sum >= 0.99 * total) {
      q.p99 = value;
      break;
    }
  }
  return q;
}

// Heights of the triangles of one material, with their areas; and the volume over them, clipped at the platform.
struct Heights {
  std::vector<std::pair<double, double>> samples;
  double area = 0.0, volume = 0.0;
};

Heights heights(const LayerStack& stack, const ScalarField& field, Material material) {
  Heights result;
  std::vector<double> area_in_tet(field.gradient.size());
  for (const Sheet& sheet : stack.sheets) {
    if (sheet.material != material) continue;
    for (Index i = sheet.first_triangle; i < sheet.first_triangle + sheet.triangle_count; ++i) {
      const auto& t = stack.triangles[i];
      const Vec3 &a = stack.vertices[t[0]], &b = stack.vertices[t[1]], &c = stack.vertices[t[2]];
      const Index tet = stack.triangle_tet[i];
      const double thickness = 1.0 / (stack.count * sheet.passes * field.gradient[tet].norm());
      const double area = triangle_area(a, b, c);
      const double tip = (a.z() + b.z() + c.z()) / 3.0 + 0.5 * thickness * print_direction(field, tet).z();
      result.area += area;
      result.volume += area * std::clamp(tip, 0.0, thickness);
      if (sheet.passes == 1) {
        area_in_tet[tet] += area;
      } else {
        result.samples.emplace_back(thickness, area);
      }
    }
  }
  for (std::size_t t = 0; t < area_in_tet.size(); ++t) {
    if (area_in_tet[t] > 0.0) result.samples.emplace_back(1.0 / (stack.count * field.gradient[t].norm()), area_in_tet[t]);
  }
  return result;
}

std::array<Heights, kMaterialCount> heights(const LayerStack& stack, const ScalarField& field, const RunContext& run) {
  std::array<Heights, kMaterialCount> result;
  parallel_for(kMaterialCount, 1, run, [&](std::size_t m, std::size_t, std::size_t) {
    result[m] = heights(stack, field, static_cast<Material>(m));
  });
  return result;
}

// Puts all sheets into one stack in the order of printing.
LayerStack assemble(const LayerStack& untrimmed, std::vector<TrimmedSheet> sheets) {
  std::erase_if(sheets, [](const TrimmedSheet& sheet) { return sheet.triangles.empty(); });
  std::stable_sort(sheets.begin(), sheets.end(), [](const TrimmedSheet& x, const TrimmedSheet& y) {
    const Sheet &a = x.head, &b = y.head;
    if (a.layer != b.layer) return a.layer < b.layer;
    // (2 j + 1) / m as exact fractions
    const long left = (2L * a.pass + 1) * b.passes, right = (2L * b.pass + 1) * a.passes;
    if (left != right) return left < right;
    return a.material != b.material ? a.material < b.material : a.passes < b.passes;
  });

  LayerStack stack;
  stack.count = untrimmed.count;
  std::vector<Index> id(untrimmed.vertices.size(), kNone), own;
  for (TrimmedSheet& sheet : sheets) {
    Sheet head = sheet.head;
    const Index first = static_cast<Index>(stack.triangles.size());
    own.assign(sheet.vertices.size(), kNone);
    for (std::size_t i = 0; i < sheet.triangles.size(); ++i) {
      std::array<Index, 3> t = sheet.triangles[i];
      for (Index& v : t) {
        // What another sheet may have too goes by its id in the untrimmed stack.
        Index& known = sheet.source[v] != kNone ? id[sheet.source[v]] : own[v];
        if (known == kNone) {
          known = static_cast<Index>(stack.vertices.size());
          stack.vertices.push_back(sheet.vertices[v]);
        }
        v = known;
      }
      stack.triangles.push_back(t);
      stack.triangle_tet.push_back(sheet.triangle_tet[i]);
    }
    sheet = {};
    head.first_triangle = first;
    head.triangle_count = static_cast<Index>(stack.triangles.size()) - first;
    stack.sheets.push_back(head);
  }
  return stack;
}

// Volume up to one factor, before and after sheets got as few triangles as will do.
struct Coarsening {
  double before = 0.0, after = 0.0;
  void operator+=(const Coarsening& other) {
    before += other.before;
    after += other.after;
  }
};

// What is printed of one layer, its passes among it.
struct TrimmedLayer {
  std::vector<TrimmedSheet> sheets;
  std::vector<RemovedPiece> removed;
  TrimAreas areas;
  Coarsening coarsening;
  Index pieces = 0, pieces_in_passes = 0;
};

// Removes what is too small, and, where asked for, what nothing carries.
void remove_pieces(const Domain& domain, const ScalarField& field, int layer_count, const Solid& solid,
                   const TrimOptions& options, std::vector<TrimmedLayer>& layers, const RunContext& run) {
  std::vector<TrimmedSheet*> sheets;
  std::vector<TrimmedLayer*> layer_of;
  for (TrimmedLayer& layer : layers) {
    for (TrimmedSheet& sheet : layer.sheets) {
      sheets.push_back(&sheet);
      layer_of.push_back(&layer);
    }
  }
  if (!options.remove_floating) {
    for (TrimmedSheet* sheet : sheets) {
      std::vector<char> keep(sheet->pieces.size());
      for (std::size_t p = 0; p < keep.size(); ++p) keep[p] = !sheet->pieces[p].too_small;
      keep_pieces(*sheet, keep);
    }
    return;
  }
  for (const Floating& gone : drop_floating(domain, field, layer_count, solid, options.min_piece_area_mm2, sheets, run)) {
    const Sheet& head = sheets[gone.sheet]->head;
    TrimmedLayer& layer = *layer_of[gone.sheet];
    layer.removed.push_back({head.layer, head.pass, head.passes, gone.area, gone.centroid, true});
    layer.pieces -= gone.pieces_less;
    if (head.passes > 1) {
      layer.pieces_in_passes -= gone.pieces_less;
    } else {
      layer.areas.kept_mm2 -= gone.area;
      layer.areas.removed_mm2 += gone.area;
    }
  }
}

// A sheet of the model, with vertices of its own.
TrimmedSheet model_sheet(const LayerStack& stack, const Sheet& head) {
  TrimmedSheet sheet;
  sheet.head = head;
  const VertexRange range = vertex_range(stack, head);
  std::vector<Index> local(range.count, kNone);
  const Index first = head.first_triangle, last = first + head.triangle_count;
  sheet.triangles.assign(stack.triangles.begin() + first, stack.triangles.begin() + last);
  sheet.triangle_tet.assign(stack.triangle_tet.begin() + first, stack.triangle_tet.begin() + last);
  for (auto& t : sheet.triangles) {
    for (Index& v : t) {
      Index& id = local[v - range.low];
      if (id == kNone) {
        id = static_cast<Index>(sheet.vertices.size());
        sheet.vertices.push_back(stack.vertices[v]);
        sheet.source.push_back(v);
      }
      v = id;
    }
  }
  return sheet;
}

Coarsening make_coarse(const ScalarField& field, TrimmedSheet& sheet) {
  const CoarsenReport report = coarsen(sheet, field.gradient);
  compact(sheet);
  return {report.volume_before / sheet.head.passes, report.volume_after / sheet.head.passes};
}

// For which height regions are laid in passes, and what no bead may be higher than.
struct PassHeights {
  double usual_mm, limit_mm;
};

// Without a limit: support as the model's layers are, but no bead higher than wide for that, else thin layers would be laid in
// needlessly many passes. Without a model to take it from, nothing is divided.
PassHeights pass_heights(const TrimOptions& options, double model_median_mm) {
  if (options.max_height_mm > 0.0) return {options.max_height_mm, options.max_height_mm};
  constexpr double kNothing = std::numeric_limits<double>::infinity();
  if (model_median_mm == 0.0) return {kNothing, kNothing};
  const double usual = std::clamp(options.bead_width_mm, 1.2 * model_median_mm, 1.5 * model_median_mm);
  return {usual, kSpot * usual};
}

// Divides a trimmed layer into what is laid at once and what in passes; marks and lists the pieces below the smallest area.
TrimmedLayer divide_layer(const Domain& domain, const ScalarField& field, int layer_count, const ReachableTets& reachable,
                          const Solid& solid, TrimmedSheet middle, const TrimOptions& options, const PassHeights& heights) {
  TrimmedLayer layer;
  layer.areas.cut_away_mm2 = middle.cut_away_area;
  DividedSlab slab = divide_slab(domain, field, layer_count, reachable, solid, std::move(middle),
                                 {options.edge_length_mm, heights.usual_mm, heights.limit_mm, options.max_passes});
  layer.areas.in_passes_mm2 = slab.in_passes_mm2;
  layer.sheets.push_back(std::move(slab.in_one_pass));
  for (TrimmedSheet& sheet : slab.passes) layer.sheets.push_back(std::move(sheet));
  for (TrimmedSheet& sheet : layer.sheets) {
    const bool in_passes = sheet.head.passes > 1;
    std::vector<char> present(sheet.pieces.size(), 0);
    for (const Index p : sheet.triangle_piece) present[p] = 1;
    for (std::size_t p = 0; p < present.size(); ++p) {
      if (!present[p]) continue;
      Piece& piece = sheet.pieces[p];
      if (piece.area < options.min_piece_area_mm2) {
        piece.too_small = true;
        if (!in_passes) layer.areas.removed_mm2 += piece.area;
        layer.removed.push_back({sheet.head.layer, sheet.head.pass, sheet.head.passes, piece.area, piece.centroid});
      } else {
        if (!in_passes) layer.areas.kept_mm2 += piece.area;
        ++layer.pieces;
        layer.pieces_in_passes += in_passes;
      }
    }
  }
  return layer;
}

// Adds what is printed of a layer to the report, and its sheets to what is printed.
void take(TrimmedLayer layer, TrimReport& report, std::vector<TrimmedSheet>& printed) {
  report.areas.kept_mm2 += layer.areas.kept_mm2;
  report.areas.in_passes_mm2 += layer.areas.in_passes_mm2;
  report.areas.cut_away_mm2 += layer.areas.cut_away_mm2;
  report.areas.removed_mm2 += layer.areas.removed_mm2;
  report.removed.insert(report.removed.end(), layer.removed.begin(), layer.removed.end());
  report.support_pieces += layer.pieces;
  report.pieces_in_passes += layer.pieces_in_passes;
  bool any = false;
  for (TrimmedSheet& sheet : layer.sheets) {
    any = any || !sheet.triangles.empty();
    if (!sheet.triangles.empty()) report.passes_max = std::max<Index>(report.passes_max, sheet.head.passes);
    printed.push_back(std::move(sheet));
  }
  report.support_layers += any;
}

void report_support_heights(Heights support, TrimReport& report) {
  const Quantiles height = quantiles(std::move(support.samples));
  report.support_height_min_mm = height.min;
  report.support_height_p50_mm = height.p50;
  report.support_height_p99_mm = height.p99;
  report.support_height_max_mm = height.max;
}

// The largest change of a material's volume by coarsening, relative.
double largest_change(std::span<const Coarsening> materials) {
  double change = 0.0;
  for (const Coarsening& c : materials) {
    if (c.before > 0.0) change = std::max(change, std::abs(c.after / c.before - 1.0));
  }
  return change;
}

std::vector<Check> trim_checks(const TrimReport& report, const TrimOptions& options, double coarsened) {
  const TrimAreas& a = report.areas;
  const double lost = a.untrimmed_mm2 - (a.kept_mm2 + a.in_passes_mm2 + a.cut_away_mm2 + a.removed_mm2);
  std::vector<Check> checks = {
      check_at_most("trim.area_conserved", std::abs(lost) / std::max(a.untrimmed_mm2, 1.0), 1e-9,
                    "untrimmed area less kept, in passes, cut away and removed, relative"),
      check_at_most("trim.coarsening_volume", coarsened, 1e-3,
                    "change of a material's volume by making its triangles fewer, relative"),
  };
  if (report.max_height_mm > 0.0) {
    const double most = options.max_height_mm > 0.0 ? 1.25 * options.max_height_mm : 1.5 * report.model_thickness_p50_mm;
    checks.push_back(check_at_most("trim.support_height_p99", report.support_height_p99_mm, most,
                                   "99th percentile of the printed support's height by area, mm"));
  }
  return checks;
}

}  // namespace

TrimResult trim_layers(const Domain& domain, const ScalarField& field, const LayerStack& untrimmed, const Solid& solid,
                       const TrimOptions& options, const RunContext& run) {
  check_options(options);
  const ReachableTets reachable(domain, field, solid, run);
  std::vector<const Sheet*> model_sheets, support_sheets;
  for (const Sheet& sheet : untrimmed.sheets) {
    (sheet.material == Material::model ? model_sheets : support_sheets).push_back(&sheet);
  }
  constexpr int kModel = static_cast<int>(Material::model), kSupport = static_cast<int>(Material::support);

  TrimResult result;
  TrimReport& report = result.report;
  std::array<Heights, kMaterialCount> before = heights(untrimmed, field, run);
  report.areas.untrimmed_mm2 = before[kSupport].area;
  report.model_thickness_p50_mm = quantiles(std::move(before[kModel].samples)).p50;
  const PassHeights pass_height = pass_heights(options, report.model_thickness_p50_mm);
  if (std::isfinite(pass_height.usual_mm)) report.max_height_mm = pass_height.usual_mm;

  // Each sheet is made coarse at once, while it is in the cache.
  std::vector<TrimmedLayer> layers(support_sheets.size());
  std::vector<TrimmedSheet> printed_sheets(model_sheets.size());
  std::vector<Coarsening> model_coarsening(model_sheets.size());
  const std::size_t tasks = layers.size() + model_sheets.size();
  std::atomic<std::size_t> done{0};
  parallel_for(tasks, 1, run, [&](std::size_t task, std::size_t, std::size_t) {
    if (task < layers.size()) {
      TrimmedSheet sheet = trim_sheet(untrimmed, *support_sheets[task], reachable, solid, options);
      find_pieces(sheet, field, untrimmed.count);
      TrimmedLayer& layer = layers[task];
      layer = divide_layer(domain, field, untrimmed.count, reachable, solid, std::move(sheet), options, pass_height);
      for (TrimmedSheet& printed : layer.sheets) layer.coarsening += make_coarse(field, printed);
    } else {
      const std::size_t m = task - layers.size();
      printed_sheets[m] = model_sheet(untrimmed, *model_sheets[m]);
      model_coarsening[m] = make_coarse(field, printed_sheets[m]);
    }
    run.progress(static_cast<double>(++done) / static_cast<double>(tasks));
  });
  remove_pieces(domain, field, untrimmed.count, solid, options, layers, run);

  std::array<Coarsening, kMaterialCount> coarsening;
  for (const Coarsening& sheet : model_coarsening) coarsening[kModel] += sheet;
  for (TrimmedLayer& layer : layers) {
    coarsening[kSupport] += layer.coarsening;
    take(std::move(layer), report, printed_sheets);
  }
  result.stack = assemble(untrimmed, std::move(printed_sheets));
  report.triangles = static_cast<Index>(result.stack.triangles.size());
  std::array<Heights, kMaterialCount> printed = heights(result.stack, field, run);
  for (int m = 0; m < kMaterialCount; ++m) {
    report.untrimmed_volume_mm3[m] = before[m].volume;
    report.printed_volume_mm3[m] = printed[m].volume;
  }
  report_support_heights(std::move(printed[kSupport]), report);
  report.checks = trim_checks(report, options, largest_change(coarsening));
  run.log(LogLevel::info, format("trim: %d layers of support, %d pieces, %zu small or floating ones removed",
                                 report.support_layers, report.support_pieces, report.removed.size()));
  return result;
}

}  // namespace curvesup
