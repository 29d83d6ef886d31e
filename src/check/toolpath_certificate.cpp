#include "curvesup/check/toolpath_certificate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "check/toolpath_certificate_parts.h"
#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"
#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup {

namespace {

using certificate::SheetFindings;
using certificate::SheetTask;
using Place = ToolpathCertificate::PlaceOnLayer;

constexpr std::size_t kNamed = 5;
constexpr double kFewestSpacings = 20.0;
constexpr double kFewestFound = 0.05;  // of the sides of all paths have a ring beside them

bool dense(const ToolpathCertificateOptions& options, Material material) {
  return options.dense[static_cast<int>(material)];
}

bool sparse(const ToolpathCertificateOptions& options, Material material) {
  return !dense(options, material) && options.line_spacing_mm[static_cast<int>(material)] > 0.0;
}

// The paths of each sheet; paths of no sheet in a list of their own at the end.
std::vector<std::vector<Index>> paths_by_sheet(const LayerStack& printed, const Toolpaths& toolpaths) {
  using Key = std::tuple<Index, int, int, Material, Index>;
  std::vector<Key> keys;
  for (Index s = 0; s < static_cast<Index>(printed.sheets.size()); ++s) {
    const Sheet& sheet = printed.sheets[s];
    keys.emplace_back(sheet.layer, sheet.pass, sheet.passes, sheet.material, s);
  }
  std::sort(keys.begin(), keys.end());
  std::vector<std::vector<Index>> paths(printed.sheets.size() + 1);
  for (Index i = 0; i < static_cast<Index>(toolpaths.paths.size()); ++i) {
    const Path& path = toolpaths.paths[i];
    const auto at = std::lower_bound(keys.begin(), keys.end(), Key(path.layer, path.pass, path.passes, path.material, 0));
    const bool known = at != keys.end() && std::get<0>(*at) == path.layer && std::get<1>(*at) == path.pass &&
                       std::get<2>(*at) == path.passes && std::get<3>(*at) == path.material;
    paths[known ? std::get<4>(*at) : printed.sheets.size()].push_back(i);
  }
  return paths;
}

double sampled_area(const LayerStack& printed, const ToolpathCertificateOptions& options) {
  double area = 0.0;
  for (const Sheet& sheet : printed.sheets) {
    if (!dense(options, sheet.material) && !sparse(options, sheet.material)) continue;
    for (Index t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) {
      const auto& [a, b, c] = printed.triangles[t];
      area += triangle_area(printed.vertices[a], printed.vertices[b], printed.vertices[c]);
    }
  }
  return area;
}

double contour_length(const Toolpaths& toolpaths) {
  double length = 0.0;
  for (const Path& path : toolpaths.paths) {
    if (path.kind != PathKind::contour) continue;
    for (Index k = path.first_point + 1; k < path.first_point + path.point_count; ++k) {
      const double step = (toolpaths.points[k].position - toolpaths.points[k - 1].position).norm();
      if (std::isfinite(step)) length += step;
    }
  }
  return length;
}

// Paths laid out of order, by three rules:
//   inside a material, upper faces ascend: a pass of several ends below the layer that is laid in one;
//   a printed group has at most one change of material, groups ascend;
//   every layer of a group lies above every layer of the groups before.
Index count_order_violations(const std::vector<Path>& paths) {
  Index violations = 0;
  constexpr Index kNoLayer = std::numeric_limits<Index>::lowest();
  double reached[kMaterialCount] = {kNoLayer, kNoLayer};  // upper face, in layers
  Index highest_before = kNoLayer, highest = kNoLayer;
  int changes = 0;
  for (std::size_t i = 0; i < paths.size(); ++i) {
    const Path& path = paths[i];
    const double height = path.layer + (path.pass + 1.0) / std::max(1, path.passes);
    double& last = reached[static_cast<int>(path.material)];
    bool wrong = height < last;
    last = std::max(last, height);
    if (i > 0 && path.group != paths[i - 1].group) {
      wrong = wrong || path.group < paths[i - 1].group;
      highest_before = highest;
      changes = 0;
    } else if (i > 0 && path.material != paths[i - 1].material) {
      wrong = wrong || ++changes > 1;
    }
    wrong = wrong || path.layer <= highest_before;
    highest = std::max(highest, path.layer);
    violations += wrong;
  }
  return violations;
}

// Area, volume and beads of one layer in one material, over its passes.
struct LayerSum {
  double volume = 0.0, small_piece_volume = 0.0, bead_volume = 0.0;
  Vec3 place = Vec3::Zero();

  // Small pieces may be off by as much as they hold; what is beyond that counts.
  [[nodiscard]] double volume_error() const {
    if (volume <= 0.0) return bead_volume > 0.0 ? 1.0 : 0.0;
    return std::max(0.0, std::abs(bead_volume - volume) - small_piece_volume) / volume;
  }
};

double percentile(std::vector<float>& values, double fraction) {
  const std::size_t at = static_cast<std::size_t>(fraction * (values.size() - 1) + 0.5);
  std::nth_element(values.begin(), values.begin() + at, values.end());
  return values[at];
}

// Adds the findings of all sheets, in their order.
class Summary {
 public:
  Summary(const LayerStack& printed, const ToolpathCertificateOptions& options) : printed_(printed), options_(options) {
    if (printed.sheets.empty()) return;
    // Layers of support may have numbers below 0.
    const auto [lowest, highest] = std::minmax_element(
        printed.sheets.begin(), printed.sheets.end(), [](const Sheet& a, const Sheet& b) { return a.layer < b.layer; });
    first_layer_ = lowest->layer;
    layers_.resize((highest->layer - first_layer_ + 1) * static_cast<std::size_t>(kMaterialCount));
  }

  void add(const Sheet& sheet, const SheetFindings& f) {
    add_layer(sheet, f);
    const auto place = [&](const Vec3& p, double value) { return Place{sheet.layer, sheet.material, p, value}; };
    if (dense(options_, sheet.material)) {
      result_.samples += f.samples;
      covered_ += f.covered;
      bead_covered_ += f.bead_covered;
      result_.area_mm2 += f.area;
      bead_area_ += f.bead_area;
    }
    result_.sparse_samples += f.sparse_samples;
    sparse_covered_ += f.sparse_covered;
    for (const Vec3& p : f.uncovered) keep(result_.uncovered, place(p, 0.0));
    spacing_.insert(spacing_.end(), f.spacing.begin(), f.spacing.end());
    spacing_sides_ += f.spacing_sides;
    spacing_over_width_.insert(spacing_over_width_.end(), f.spacing_over_width.begin(), f.spacing_over_width.end());
    result_.segments += f.segments;
    result_.length_mm += f.length;
    result_.wrong_volumes += f.wrong_volumes;
    result_.wrong_heights += f.wrong_heights;
    result_.wrong_height_length_mm += f.wrong_height_length;
    result_.max_volume_error = std::max(result_.max_volume_error, f.max_volume_error);
    if (f.max_height_error > result_.max_height_error) {
      result_.max_height_error = f.max_height_error;
      result_.worst_height = place(f.worst_height, f.max_height_error);
    }
    add_distance(f.max_point_distance, place(f.farthest_point, f.max_point_distance));
    result_.points_off_layer += f.points_off;
    result_.segments_off_layer += f.segments_off;
    for (const auto& l : f.leaving) keep(result_.leaving, place(l.position, l.distance));
    result_.pieces += f.pieces;
    for (const auto& m : f.missing) result_.pieces_without_path.push_back(place(m.centroid, m.area));
  }

  // A path of a layer that is not there.
  void add_stray(const Path& path, const Toolpaths& toolpaths) {
    if (path.point_count == 0) return;
    const Place place{path.layer, path.material, toolpaths.points[path.first_point].position, certificate::kFarMm};
    add_distance(certificate::kFarMm, place);
    keep(result_.leaving, place);
    result_.points_off_layer += path.point_count;
    result_.segments_off_layer += path.point_count - 1;
    result_.segments += path.point_count - 1;
  }

  ToolpathCertificate finish() {
    if (result_.samples > 0) {
      result_.covered_fraction = static_cast<double>(covered_) / result_.samples;
      result_.bead_covered_fraction = static_cast<double>(bead_covered_) / result_.samples;
    }
    if (result_.sparse_samples > 0) result_.sparse_covered_fraction = static_cast<double>(sparse_covered_) / result_.sparse_samples;
    const double covered_area = result_.covered_fraction * result_.area_mm2;
    result_.overlap = covered_area > 0.0 ? bead_area_ / covered_area - 1.0 : 0.0;
    result_.spacing_samples = static_cast<Index>(spacing_.size());
    if (static_cast<double>(spacing_.size()) >= std::max(kFewestSpacings, kFewestFound * spacing_sides_)) {
      result_.spacing_p5_mm = percentile(spacing_, 0.05);
      result_.spacing_median_mm = percentile(spacing_, 0.5);
      result_.spacing_p95_mm = percentile(spacing_, 0.95);
      result_.spacing_median_over_width = percentile(spacing_over_width_, 0.5);
      result_.spacing_off_width =
          std::max(1.0 - percentile(spacing_over_width_, 0.05), percentile(spacing_over_width_, 0.95) - 1.0);
    }
    finish_layers();
    return std::move(result_);
  }

 private:
  static void keep(std::vector<Place>& list, const Place& place) {
    if (list.size() < certificate::kPlacesKept) list.push_back(place);
  }
  void add_distance(double distance, const Place& place) {
    if (distance <= result_.max_point_distance_mm) return;
    result_.max_point_distance_mm = distance;
    result_.farthest_point = place;
  }
  void add_layer(const Sheet& sheet, const SheetFindings& f) {
    const std::size_t place = static_cast<std::size_t>(sheet.layer - first_layer_) * kMaterialCount;
    LayerSum& sum = layers_[place + static_cast<int>(sheet.material)];
    if (sheet.triangle_count > 0) sum.place = printed_.vertices[printed_.triangles[sheet.first_triangle][0]];
    sum.volume += f.volume;
    sum.small_piece_volume += f.small_piece_volume;
    sum.bead_volume += f.bead_volume;
  }
  void finish_layers() {
    for (std::size_t i = 0; i < layers_.size(); ++i) {
      const auto material = static_cast<Material>(i % kMaterialCount);
      result_.layer_volume_mm3[i % kMaterialCount] += layers_[i].volume;
      result_.bead_volume_mm3[i % kMaterialCount] += layers_[i].bead_volume;
      const double error = layers_[i].volume_error();
      if (!dense(options_, material) || error <= result_.max_layer_volume_error) continue;
      result_.max_layer_volume_error = error;
      result_.worst_layer_mm3 = layers_[i].volume;
      result_.worst_layer = {first_layer_ + static_cast<Index>(i / kMaterialCount), material, layers_[i].place, error};
    }
  }

  const LayerStack& printed_;
  const ToolpathCertificateOptions& options_;
  ToolpathCertificate result_;
  Index first_layer_ = 0;
  std::vector<LayerSum> layers_;  // by layer, then material
  std::vector<float> spacing_, spacing_over_width_;
  double spacing_sides_ = 0.0;
  Index covered_ = 0, bead_covered_ = 0, sparse_covered_ = 0;
  double bead_area_ = 0.0;
};

std::string text_of(const Place& place, const char* unit = nullptr) {
  std::string text = format("%s layer %d at (%.2f %.2f %.2f)", place.material == Material::model ? "model" : "support",
                            place.layer, place.position.x(), place.position.y(), place.position.z());
  if (unit != nullptr) text += format(" %.3g %s", place.value, unit);
  return text;
}

std::string first_of(const std::vector<Place>& list, const char* unit = nullptr) {
  std::string text;
  for (std::size_t i = 0; i < list.size() && i < kNamed; ++i) text += "; " + text_of(list[i], unit);
  return text;
}

void add_area_checks(const ToolpathCertificateOptions& options, ToolpathCertificate& c) {
  c.checks.push_back(check_at_least(
      "certificate.toolpath_coverage", c.covered_fraction, options.min_covered_fraction,
      format("part of %.0f mm2 of layers within 0.55 w of a path or inside of a bead, by %d samples; %.4f within 0.55 of the bead's own width",
             c.area_mm2, c.samples, c.bead_covered_fraction)));
  if (sparse(options, Material::model) || sparse(options, Material::support)) {
    c.checks.push_back(check_at_least("certificate.toolpath_sparse_coverage", c.sparse_covered_fraction, options.min_covered_fraction,
                                      format("part of the sparse layers as near to a line as is meant there, by %d samples", c.sparse_samples)));
  }
  c.checks.push_back(check_at_most("certificate.toolpath_overlap", c.overlap, options.max_overlap,
                                   "sum of width times length over covered area, less 1"));
}

void add_spacing_checks(const ToolpathCertificateOptions& options, ToolpathCertificate& c) {
  const std::string what = format("distance of neighbouring rings, %d samples: p5 %.3f, median %.3f, p95 %.3f mm",
                                  c.spacing_samples, c.spacing_p5_mm, c.spacing_median_mm, c.spacing_p95_mm);
  c.checks.push_back(check_at_most("certificate.toolpath_spacing_median", std::abs(c.spacing_median_over_width - 1.0),
                                   options.max_spacing_median, what + "; median over the mean width of both beads, less 1"));
  c.checks.push_back(check_at_most("certificate.toolpath_spacing_spread", c.spacing_off_width, options.max_spacing_spread,
                                   what + "; 5 and 95 % over the mean width of both beads, less 1; the farther one"));
}

void add_bead_checks(const ToolpathCertificateOptions& options, ToolpathCertificate& c) {
  c.checks.push_back(check_at_most("certificate.toolpath_segment_volume", c.max_volume_error, options.max_volume_error,
                                   format("volume against width * height * length, relative; %d of %d segments differ",
                                          c.wrong_volumes, c.segments)));
  c.checks.push_back(check_at_most(
      "certificate.toolpath_height", c.max_height_error, options.max_height_error,
      format("height against local thickness, relative; %d of %d segments (%.3g of the length) beyond the limit",
             c.wrong_heights, c.segments, c.length_mm > 0.0 ? c.wrong_height_length_mm / c.length_mm : 0.0) +
          (c.max_height_error > 0.0 ? "; worst in " + text_of(c.worst_height) : std::string())));
  for (int m = 0; m < kMaterialCount; ++m) {
    if (!options.dense[m] || (c.layer_volume_mm3[m] <= 0.0 && c.bead_volume_mm3[m] <= 0.0)) continue;
    const double error =
        c.layer_volume_mm3[m] > 0.0 ? std::abs(c.bead_volume_mm3[m] / c.layer_volume_mm3[m] - 1.0) : 1.0;
    c.checks.push_back(
        check_at_most(m == 0 ? "certificate.toolpath_model_volume" : "certificate.toolpath_support_volume", error,
                      options.max_material_volume_error,
                      format("beads %.1f mm3 against area times thickness %.1f mm3, relative", c.bead_volume_mm3[m],
                             c.layer_volume_mm3[m])));
  }
  c.checks.push_back(check_at_most(
      "certificate.toolpath_layer_volume", c.max_layer_volume_error, options.max_layer_volume_error,
      "beads against area times thickness of the worst layer, relative, beyond its pieces smaller than a bead squared" +
          (c.max_layer_volume_error > 0.0 ? "; " + text_of(c.worst_layer) + format(", %.2f mm3", c.worst_layer_mm3)
                                      : std::string())));
}

void add_place_checks(const ToolpathCertificateOptions& options, ToolpathCertificate& c) {
  c.checks.push_back(check_at_most("certificate.toolpath_points_on_layer", c.max_point_distance_mm,
                                   options.max_distance_mm,
                                   format("mm from the layer, %d points beyond the limit", c.points_off_layer) +
                                       (c.points_off_layer > 0 ? "; " + text_of(c.farthest_point) : std::string())));
  c.checks.push_back(check_equal("certificate.toolpath_segments_on_layer", c.segments_off_layer, 0.0,
                                 format("of %d extruded segments leave their layer", c.segments) +
                                     first_of(c.leaving, "mm")));
  c.checks.push_back(check_equal("certificate.toolpath_pieces", static_cast<double>(c.pieces_without_path.size()), 0.0,
                                 format("of %d pieces of at least half a bead squared have no path", c.pieces) +
                                     first_of(c.pieces_without_path, "mm2")));
  c.checks.push_back(check_equal("certificate.toolpath_order", c.order_violations, 0.0,
                                 "paths below what was laid before, or after a second change of material in a group"));
}

}  // namespace

ToolpathCertificate certify_toolpaths(const Domain&, const ScalarField& field, const LayerStack& printed,
                                      const Toolpaths& toolpaths, const ToolpathCertificateOptions& options,
                                      const RunContext& run) {
  const std::vector<std::vector<Index>> paths = paths_by_sheet(printed, toolpaths);
  const SheetTask task{
      .field = field,
      .printed = printed,
      .toolpaths = toolpaths,
      .options = options,
      .samples_per_mm2 =
          std::min(options.samples_per_mm2, options.most_samples / std::max(1e-9, sampled_area(printed, options))),
      .samples_per_mm =
          std::min(options.samples_per_mm, options.most_spacing_samples / std::max(1e-9, contour_length(toolpaths)))};
  std::vector<SheetFindings> findings(printed.sheets.size());
  parallel_for(findings.size(), 1, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t s = begin; s < end; ++s)
      findings[s] = certificate::measure_sheet(task, static_cast<Index>(s), paths[s]);
  });
  run.progress(0.95);
  Summary summary(printed, options);
  for (std::size_t s = 0; s < findings.size(); ++s) summary.add(printed.sheets[s], findings[s]);
  for (const Index i : paths.back()) summary.add_stray(toolpaths.paths[i], toolpaths);
  ToolpathCertificate result = summary.finish();
  result.order_violations = count_order_violations(toolpaths.paths);
  add_area_checks(options, result);
  add_spacing_checks(options, result);
  add_bead_checks(options, result);
  add_place_checks(options, result);
  run.progress(1.0);
  return result;
}

}  // namespace curvesup
