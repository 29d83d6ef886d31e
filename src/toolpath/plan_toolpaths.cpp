#include "curvesup/toolpath/plan_toolpaths.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "core/memory.h"
#include "toolpath/fill_piece.h"
#include "toolpath/model_above.h"
#include "toolpath/order.h"
#include "toolpath/toolpath_checks.h"

namespace curvesup {
namespace {

using namespace toolpath;

void require(bool holds, const char* key, double value, const char* limit) {
  if (holds) return;
  throw Error(ErrorKind::usage, "toolpath", format("%s = %g, must be %s", key, value, limit));
}

void validate(const ToolpathOptions& o) {
  require(o.bead_width_mm > 0.0, "bead_width_mm", o.bead_width_mm, "> 0");
  require(o.min_bead_mm > 0.0 && o.min_bead_mm <= o.bead_width_mm, "min_bead_mm", o.min_bead_mm, "in (0, bead_width_mm]");
  require(o.max_bead_mm >= o.bead_width_mm && o.max_bead_mm <= 2.0 * o.bead_width_mm, "max_bead_mm", o.max_bead_mm,
          "in [bead_width_mm, 2 bead_width_mm]");
  require(o.max_flow_mm3_s > 0.0, "max_flow_mm3_s", o.max_flow_mm3_s, "> 0");
  require(o.filament_diameter_mm > 0.0, "filament_diameter_mm", o.filament_diameter_mm, "> 0");
  require(o.support_batch_layers >= 1, "support_batch_layers", o.support_batch_layers, ">= 1");
  require(o.min_speed_mm_s > 0.0, "min_speed_mm_s", o.min_speed_mm_s, "> 0");
  require(o.travel_speed_mm_s > 0.0, "travel_speed_mm_s", o.travel_speed_mm_s, "> 0");
  require(o.first_layer_speed_factor > 0.0, "first_layer_speed_factor", o.first_layer_speed_factor, "> 0");
  require(o.overhang_speed_factor > 0.0, "overhang_speed_factor", o.overhang_speed_factor, "> 0");
  require(o.interface_layers >= 0, "interface_layers", o.interface_layers, ">= 0");
  for (const auto& material : o.material) {
    require(material.speed_mm_s > 0.0, "speed_mm_s", material.speed_mm_s, "> 0");
    require(material.perimeters >= 1, "perimeters", material.perimeters, ">= 1");
    if (!material.line_spacing_mm) continue;
    require(*material.line_spacing_mm >= o.bead_width_mm, "line_spacing_mm", *material.line_spacing_mm, ">= bead_width_mm");
    require(material.pattern == FillPattern::contour_zigzag, "line_spacing_mm", *material.line_spacing_mm,
            "null unless the fill is contour+zigzag");
  }
}

// What one sheet yields.
struct SheetBeads {
  std::vector<PieceBeads> pieces;
  double layer_volume = 0.0;
  Index rings = 0, centre_lines = 0, lines = 0, dots = 0, dust = 0, without_path = 0, naive_paths = 0;
  Index sparse = 0, interface = 0;  // pieces
  double overhang_mm = 0.0;
  double dust_area = 0.0;
  std::vector<UnprintedPiece> unprinted;
};

double sheet_volume(const LayerStack& stack, const Sheet& sheet, std::span<const Vec3> gradient) {
  double sum = 0.0;
  for (Index t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) {
    const auto& [a, b, c] = stack.triangles[t];
    const double slope = gradient[t].norm();
    if (slope <= 0.0) continue;
    const Vec3 &at_a = stack.vertices[a], &at_b = stack.vertices[b], &at_c = stack.vertices[c];
    const double thickness = 1.0 / (stack.count * sheet.passes * slope);
    sum += triangle_area(at_a, at_b, at_c) * mean_clipped_height(thickness, {at_a.z(), at_b.z(), at_c.z()}, gradient[t].z() / slope);
  }
  return sum;
}

// `above` is the model's layers where some of the support is sparse.
SheetBeads plan_sheet(const LayerStack& stack, Index index, std::span<const Vec3> gradient, const ToolpathOptions& options,
                      const std::optional<ModelAbove>& above) {
  const Sheet& sheet = stack.sheets[index];
  const bool may_be_sparse = sparse(options.material[static_cast<int>(sheet.material)], options);
  const double bead_area = options.bead_width_mm * options.bead_width_mm;
  SheetBeads beads;
  beads.layer_volume = sheet_volume(stack, sheet, gradient);
  const double dust_limit = 0.02 * bead_area;
  for (PieceMesh& mesh : split_into_pieces(stack, sheet, gradient)) {
    PieceBeads piece{.sheet = index, .area = mesh.area, .centre = Vec3::Zero(), .paths = {}};
    for (const Vec3& v : mesh.vertices) piece.centre += v / static_cast<double>(mesh.vertices.size());
    if (mesh.area < dust_limit) {
      ++beads.dust;
      beads.dust_area += mesh.area;
      beads.unprinted.push_back({sheet.layer, sheet.material, piece.centre, mesh.area});
      continue;
    }
    const bool interface = may_be_sparse && above && sheet.material == Material::support &&
                           above->stands_over(mesh, sheet, options.interface_layers, options.interface_gap_mm, bead_area);
    FilledPiece filled = fill_piece(std::move(mesh), sheet, options, may_be_sparse && !interface);
    beads.interface += interface;
    beads.sparse += may_be_sparse && !interface && filled.lines > 0;
    beads.rings += filled.rings;
    beads.centre_lines += filled.centre_lines;
    beads.lines += filled.lines;
    beads.dots += filled.dots;
    beads.naive_paths += filled.naive_paths;
    piece.paths = std::move(filled.paths);
    if (piece.paths.empty()) {
      ++beads.without_path;
      beads.unprinted.push_back({sheet.layer, sheet.material, piece.centre, piece.area});
    }
    beads.pieces.push_back(std::move(piece));
  }
  return beads;
}

constexpr double kUnderReach = 0.8;  // widths, from the lower side of a bead to the tips of those that carry it

double cross_distance(const PathPoint& point, const Vec3& from) { return (point.position - from).norm(); }

std::size_t seam_point(const BeadPath& path, const ToolpathOptions& options, const Vec3& at, std::uint64_t& random) {
  const std::size_t n = path.points.size() - 1;
  std::size_t best = 0;
  if (options.seam == SeamRule::random) {
    random = random * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<std::size_t>(random >> 33) % n;
  }
  if (options.seam == SeamRule::sharpest_corner) {
    double sharpest = 2.0;
    for (std::size_t i = 0; i < n; ++i) {
      const Vec3 in = path.points[i].position - path.points[i == 0 ? n - 1 : i - 1].position;
      const Vec3 out = path.points[i + 1].position - path.points[i].position;
      const double cosine = in.dot(out) / std::max(1e-12, in.norm() * out.norm());
      if (cosine < sharpest - 1e-9) sharpest = cosine, best = i;
    }
    return best;
  }
  // Aligned: always towards the same far corner, so that seams stack up; nearest: towards the nozzle.
  const Vec3 target = options.seam == SeamRule::aligned ? Vec3(0.0, 1e4, 0.0) : at;
  for (std::size_t i = 1; i < n; ++i) {
    if (cross_distance(path.points[i], target) < cross_distance(path.points[best], target)) best = i;
  }
  return best;
}

// Chooses order, direction and seam of a piece's paths from where the nozzle stands.
void arrange_paths(PieceBeads& piece, const ToolpathOptions& options, Vec3& at, std::uint64_t& random) {
  for (std::size_t done = 0; done < piece.paths.size(); ++done) {
    std::size_t best = done;
    double nearest = 1e300;
    for (std::size_t i = done; i < piece.paths.size(); ++i) {
      const BeadPath& path = piece.paths[i];
      double d = std::min(cross_distance(path.points.front(), at), cross_distance(path.points.back(), at));
      if (path.closed) {
        for (const PathPoint& p : path.points) d = std::min(d, cross_distance(p, at));
      }
      if (d < nearest) nearest = d, best = i;
    }
    std::swap(piece.paths[done], piece.paths[best]);
    BeadPath& path = piece.paths[done];
    if (path.closed) {
      start_at(path, seam_point(path, options, at, random));
    } else if (cross_distance(path.points.back(), at) < cross_distance(path.points.front(), at)) {
      reverse(path);
    }
    at = path.points.back().position;
  }
}

// What lies under the beads of a sheet: the sheets of its layer and of the one below that rise less. Asked for only where
// the speed over nothing differs.
BeadTops beads_under(std::span<const Sheet> sheets, std::span<const SheetBeads> beads, std::size_t index, const ToolpathOptions& options) {
  BeadTops under(kUnderReach * options.bead_width_mm);
  for (std::size_t s = index; s-- > 0 && sheets[s].layer + 1 >= sheets[index].layer;) {
    if (top_of(sheets[s]) < top_of(sheets[index])) under.add(beads[s].pieces);
  }
  for (std::size_t s = index + 1; s < sheets.size() && sheets[s].layer == sheets[index].layer; ++s) {
    if (top_of(sheets[s]) < top_of(sheets[index])) under.add(beads[s].pieces);
  }
  under.finish();
  return under;
}

// The speed of each segment by its material, by what it lies on and by how much plastic the nozzle melts.
void set_feeds(SheetBeads& beads, const Sheet& sheet, const ToolpathOptions& options, const BeadTops* under) {
  const double speed = options.material[static_cast<int>(sheet.material)].speed_mm_s;
  for (PieceBeads& piece : beads.pieces) {
    for (BeadPath& path : piece.paths) {
      for (std::size_t i = 0; i < path.points.size(); ++i) {
        PathPoint& p = path.points[i];
        double feed = speed;
        const bool on_platform = p.position.z() - 1.01 * p.tip_offset_mm * p.normal.z() <= 0.0;
        if (on_platform) {
          feed *= options.first_layer_speed_factor;
        } else if (under != nullptr && !under->carries(p)) {
          feed *= options.overhang_speed_factor;
          if (i > 0) beads.overhang_mm += (p.position - path.points[i - 1].position).norm();
        }
        const double section = p.width_mm * p.height_mm;
        if (section > 0.0) feed = std::min(feed, options.max_flow_mm3_s / section);
        p.feed_mm_s = feed;
      }
    }
  }
}

std::size_t count_points(std::span<const SheetBeads> sheets) {
  std::size_t count = 0;
  for (const SheetBeads& sheet : sheets) {
    for (const PieceBeads& piece : sheet.pieces) {
      for (const BeadPath& path : piece.paths) count += path.points.size();
    }
  }
  return count;
}

class Assembly {
 public:
  Assembly(const LayerStack& stack, const ToolpathOptions& options) : stack_(stack), options_(options), random_(options.seed) {}

  void reserve(std::size_t points) { paths_.points.reserve(points); }

  void append(const Run& run, std::vector<PieceBeads>& pieces) {
    if (started_ && run.material != material_) ++report_.material_changes;
    std::vector<Vec3> centres;
    for (const PieceBeads& piece : pieces) centres.push_back(piece.centre);
    const std::size_t first_path = paths_.paths.size();
    const double travel = report_.travel_mm;
    const Index jumps = report_.jumps;
    for (const Index i : short_tour(centres, at_)) append(run, pieces[i]);
    report_.groups = run.group + 1;
    slow_down(first_path, (report_.travel_mm - travel) / options_.travel_speed_mm_s + (report_.jumps - jumps) * options_.jump_overhead_s);
  }

  ToolpathResult finish() {
    report_.paths = static_cast<Index>(paths_.paths.size());
    report_.points = static_cast<Index>(paths_.points.size());
    const double section = 0.25 * std::numbers::pi * options_.filament_diameter_mm * options_.filament_diameter_mm;
    for (int m = 0; m < kMaterialCount; ++m) report_.filament_mm[m] = report_.volume_mm3[m] / section;
    report_.time_s = report_.laying_time_s + report_.travel_mm / options_.travel_speed_mm_s + report_.jumps * options_.jump_overhead_s +
                      report_.material_changes * options_.material_change_s;
    return {std::move(paths_), std::move(report_)};
  }

  ToolpathReport& report() { return report_; }

 private:
  void append(const Run& run, PieceBeads& piece) {
    const Index id = report_.pieces++;
    if (piece.paths.empty()) return;
    const Sheet& sheet = stack_.sheets[piece.sheet];
    Vec3 at = at_;
    arrange_paths(piece, options_, at, random_);
    bool first_of_piece = true;
    const int m = static_cast<int>(sheet.material);
    for (const BeadPath& path : piece.paths) {
      if (started_) {
        const double travel = (path.points.front().position - at_).norm();
        ++report_.jumps;
        if (!first_of_piece) ++report_.jumps_inside_pieces;
        report_.travel_mm += travel;
        if (travel > options_.retract_travel_mm || run.material != material_) ++report_.retractions;
      }
      first_of_piece = false;
      started_ = true;
      material_ = run.material;
      Path entry{.layer = sheet.layer, .pass = sheet.pass, .passes = sheet.passes, .material = sheet.material};
      entry.kind = path.kind;
      entry.closed = path.closed;
      entry.piece = id;
      entry.group = run.group;
      entry.first_point = static_cast<Index>(paths_.points.size());
      entry.point_count = static_cast<Index>(path.points.size());
      for (std::size_t i = 1; i < path.points.size(); ++i) {
        const PathPoint& p = path.points[i];
        const double length = (p.position - path.points[i - 1].position).norm();
        report_.length_mm[m] += length;
        report_.volume_mm3[m] += p.volume_mm3;
        report_.max_flow_mm3_s = std::max(report_.max_flow_mm3_s, p.width_mm * p.height_mm * p.feed_mm_s);
        report_.min_height_mm = report_.max_height_mm == 0.0 ? p.height_mm : std::min(report_.min_height_mm, p.height_mm);
        report_.max_height_mm = std::max(report_.max_height_mm, p.height_mm);
      }
      paths_.paths.push_back(entry);
      paths_.points.insert(paths_.points.end(), path.points.begin(), path.points.end());
      at_ = path.points.back().position;
    }
    piece.paths.clear();
    piece.paths.shrink_to_fit();
    // All points at once, in pieces and in order, would take twice the memory.
    memory_.at(paths_.points.size());
  }

  // Gives what was laid since `first_path`, with so much time between its paths, the least time of a layer: on it the next
  // one may be laid at once.
  void slow_down(std::size_t first_path, double other_s) {
    const auto for_segments = [&](const auto& use) {
      for (std::size_t i = first_path; i < paths_.paths.size(); ++i) {
        const Path& path = paths_.paths[i];
        for (Index k = path.first_point; k < path.first_point + path.point_count; ++k) {
          const bool first = k == path.first_point;
          use(paths_.points[k], first ? 0.0 : (paths_.points[k].position - paths_.points[k - 1].position).norm());
        }
      }
    };
    double laying_s = 0.0;
    for_segments([&](const PathPoint& p, double length) { laying_s += length / p.feed_mm_s; });
    const double wanted_s = options_.min_layer_time_s - other_s;
    if (laying_s > 0.0 && laying_s < wanted_s) {
      const double factor = laying_s / wanted_s;
      laying_s = 0.0;
      for_segments([&](PathPoint& p, double length) {
        const double slow = std::max(std::min(options_.min_speed_mm_s, p.feed_mm_s), p.feed_mm_s * factor);
        if (slow < p.feed_mm_s) report_.slowed_mm += length;
        p.feed_mm_s = slow;
        laying_s += length / slow;
      });
    }
    report_.laying_time_s += laying_s;
  }

  const LayerStack& stack_;
  const ToolpathOptions& options_;
  Toolpaths paths_;
  ReleasedInSteps memory_{500'000};  // points
  ToolpathReport report_;
  Vec3 at_ = Vec3::Zero();
  Material material_ = Material::model;
  bool started_ = false;
  std::uint64_t random_;
};

// By sheet: 1 for the lower passes of a layer's support beside which its model would already stand, half a bead or more
// above the nozzle's tip, if the model were laid first.
std::vector<char> find_support_first(std::span<const Sheet> sheets, std::span<const SheetBeads> beads,
                                     const ToolpathOptions& options, const RunContext& run) {
  std::vector<char> first(sheets.size(), 0);
  std::vector<std::size_t> layers;  // first sheet of each
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    if (s == 0 || sheets[s].layer != sheets[s - 1].layer) layers.push_back(s);
  }
  parallel_for(layers.size(), 1, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t l = begin; l < end; ++l) {
      const std::size_t last = l + 1 < layers.size() ? layers[l + 1] : sheets.size();
      BeadTops model(1.5 * options.bead_width_mm);
      for (std::size_t s = layers[l]; s < last; ++s) {
        if (sheets[s].material == Material::model) model.add(beads[s].pieces);
      }
      model.finish();
      for (std::size_t s = layers[l]; s < last; ++s) {
        const bool lower = sheets[s].material == Material::support && sheets[s].pass + 1 < sheets[s].passes;
        first[s] = lower && model.rise_beside(beads[s].pieces);
      }
    }
  });
  return first;
}

// Whether the model of layers first .. layer - 1 may wait for the support of `layer`: the nozzle finds none of it above itself.
bool model_may_wait(std::span<const Sheet> sheets, std::span<const SheetBeads> beads, Index first, Index layer, double clearance) {
  BeadTops support(clearance);
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    if (sheets[s].layer == layer && sheets[s].material == Material::support) support.add(beads[s].pieces);
  }
  support.finish();
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    if (sheets[s].layer < first || sheets[s].layer >= layer || sheets[s].material != Material::model) continue;
    if (support.rise_beside(beads[s].pieces)) return false;
  }
  return true;
}

// Adds what was planned of each sheet to the report.
void report_sheets(std::span<const Sheet> heads, std::span<const SheetBeads> sheets, ToolpathReport& report) {
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    const SheetBeads& from = sheets[s];
    report.layer_volume_mm3[static_cast<int>(heads[s].material)] += from.layer_volume;
    report.rings += from.rings;
    report.centre_lines += from.centre_lines;
    report.lines += from.lines;
    report.sparse_pieces += from.sparse;
    report.interface_pieces += from.interface;
    report.overhang_mm += from.overhang_mm;
    report.dots += from.dots;
    report.dust_pieces += from.dust;
    report.dust_area_mm2 += from.dust_area;
    report.pieces_without_path += from.without_path;
    report.naive_jumps += from.naive_paths;
    report.naive_jumps_inside_pieces += from.naive_paths;
    report.unprinted.insert(report.unprinted.end(), from.unprinted.begin(), from.unprinted.end());
  }
  report.naive_jumps = std::max<Index>(0, report.naive_jumps - 1);
  report.naive_jumps_inside_pieces -= report.pieces - report.pieces_without_path;
  std::stable_sort(report.unprinted.begin(), report.unprinted.end(),
                   [](const UnprintedPiece& x, const UnprintedPiece& y) { return x.area_mm2 > y.area_mm2; });
  if (report.unprinted.size() > 100) report.unprinted.resize(100);
}

}  // namespace

ToolpathResult plan_toolpaths(std::span<const Vec3> triangle_gradient, const LayerStack& printed,
                              const ToolpathOptions& options, const RunContext& run) {
  validate(options);
  const std::size_t sheet_count = printed.sheets.size();
  std::vector<SheetBeads> sheets(sheet_count);
  std::optional<ModelAbove> above;
  if (sparse(options.material[static_cast<int>(Material::support)], options)) above.emplace(printed);
  parallel_for(sheet_count, 1, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t s = begin; s < end; ++s) {
      sheets[s] = plan_sheet(printed, static_cast<Index>(s), triangle_gradient, options, above);
    }
  });
  parallel_for(sheet_count, 1, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t s = begin; s < end; ++s) {
      std::optional<BeadTops> under;
      if (options.overhang_speed_factor != 1.0) under = beads_under(printed.sheets, sheets, s, options);
      set_feeds(sheets[s], printed.sheets[s], options, under ? &*under : nullptr);
    }
  });
  release_free_memory();
  run.progress(0.9);

  const std::vector<char> support_first = find_support_first(printed.sheets, sheets, options, run);
  Assembly assembly(printed, options);
  assembly.reserve(count_points(sheets));
  ToolpathReport& report = assembly.report();
  const auto may_wait = [&](Index first, Index layer) {
    const bool may = model_may_wait(printed.sheets, sheets, first, layer, options.batch_clearance_mm);
    report.batched_layers += may;
    return may;
  };
  for (const Run& material_run : order_runs(printed.sheets, options.support_batch_layers, support_first, may_wait)) {
    run.check_stop();
    std::vector<PieceBeads> pieces;
    const Sheet* laid = nullptr;
    const auto flush = [&] {
      if (!pieces.empty()) assembly.append(material_run, pieces);
      pieces.clear();
    };
    for (const Index s : material_run.sheets) {
      // Pieces are put in order of travel only where they rise to one iso-surface: what is lower comes first.
      if (laid != nullptr && top_of(printed.sheets[s]) != top_of(*laid)) flush();
      laid = &printed.sheets[s];
      for (PieceBeads& piece : sheets[s].pieces) pieces.push_back(std::move(piece));
      sheets[s].pieces.clear();
    }
    flush();
  }
  report_sheets(printed.sheets, sheets, report);
  ToolpathResult result = assembly.finish();
  result.report.checks = toolpath_checks(result.report, options);
  run.progress(1.0);
  return result;
}

ToolpathResult plan_toolpaths(const Domain&, const ScalarField& field, const LayerStack& printed,
                              const ToolpathOptions& options, const RunContext& run) {
  std::vector<Vec3> gradient(printed.triangles.size());
  for (std::size_t t = 0; t < gradient.size(); ++t) gradient[t] = field.gradient[printed.triangle_tet[t]];
  return plan_toolpaths(gradient, printed, options, run);
}

}  // namespace curvesup
