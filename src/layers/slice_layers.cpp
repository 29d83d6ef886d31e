#include <algorithm>
#include <cmath>
#include <numeric>

#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"
#include "curvesup/layers/layers.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "layers/sheet_edges.h"

namespace curvesup {

namespace {

std::vector<Level> all_levels(const ScalarField& field, int layer_count) {
  std::vector<Level> levels;
  if (field.value.empty() || layer_count <= 0) return levels;
  const auto [low, high] = std::minmax_element(field.value.begin(), field.value.end());
  const Index first = static_cast<Index>(std::floor(*low * layer_count)) - 1;
  const Index last = static_cast<Index>(std::ceil(*high * layer_count)) + 1;
  for (Index k = first; k <= last; ++k) {
    const Level level = make_level(k, 0, 1, layer_count);
    if (level.iso_value > *low && level.iso_value <= *high) levels.push_back(level);
  }
  return levels;
}

double area(const LayerStack& stack, Index triangle) {
  const auto& t = stack.triangles[triangle];
  return triangle_area(stack.vertices[t[0]], stack.vertices[t[1]], stack.vertices[t[2]]);
}

// Thickness at three quantiles of the model's area. All triangles of a tet have the same thickness.
std::array<double, 3> thickness_quantiles(const LayerStack& stack, const Domain& domain, const ScalarField& field,
                                          const std::array<double, 3>& quantiles) {
  std::vector<double> area_in_tet(domain.model_tets, 0.0);
  for (std::size_t i = 0; i < stack.triangles.size(); ++i) {
    if (stack.triangle_tet[i] < domain.model_tets) area_in_tet[stack.triangle_tet[i]] += area(stack, static_cast<Index>(i));
  }
  std::vector<std::pair<double, double>> samples;  // thickness, area
  double total = 0.0;
  for (Index t = 0; t < domain.model_tets; ++t) {
    if (area_in_tet[t] <= 0.0) continue;
    samples.emplace_back(1.0 / (stack.count * field.gradient[t].norm()), area_in_tet[t]);
    total += area_in_tet[t];
  }
  std::sort(samples.begin(), samples.end());
  std::array<double, 3> result{};
  std::size_t next = 0;
  double sum = 0.0;
  for (const auto& [thickness, sample_area] : samples) {
    sum += sample_area;
    while (next < quantiles.size() && sum >= quantiles[next] * total) result[next++] = thickness;
  }
  while (next < quantiles.size() && !samples.empty()) result[next++] = samples.back().first;
  return result;
}

struct SheetDefects {
  Index non_manifold_edges = 0;
  Index border_gaps = 0;
  Index zero_area = 0;
};

bool in_sorted(const std::vector<SheetEdge>& edges, const SheetEdge& edge) {
  const auto found = std::lower_bound(edges.begin(), edges.end(), edge, [](const SheetEdge& a, const SheetEdge& b) {
    return a.low != b.low ? a.low < b.low : a.high < b.high;
  });
  return found != edges.end() && found->low == edge.low && found->high == edge.high && found->border();
}

// A border edge of a model sheet lies on the interface, unless it is on the platform or its tet also reaches the outside of
// the domain, where the border may be the end of the domain itself.
bool on_interface(const LayerStack& stack, const Domain& domain, const SheetEdge& edge, Index first_triangle) {
  if (stack.vertices[edge.low].z() == 0.0 && stack.vertices[edge.high].z() == 0.0) return false;
  for (const Index n : domain.topology.neighbours[stack.triangle_tet[first_triangle + edge.triangle]]) {
    if (n == kNone) return false;
  }
  return true;
}

SheetDefects inspect_level(const LayerStack& stack, const Domain& domain, std::size_t first_sheet, std::size_t end_sheet) {
  SheetDefects defects;
  std::vector<SheetEdge> model_edges, support_edges;
  Index model_first = 0;
  for (std::size_t s = first_sheet; s < end_sheet; ++s) {
    const Sheet& sheet = stack.sheets[s];
    auto& edges = sheet.material == Material::model ? model_edges : support_edges;
    if (sheet.material == Material::model) model_first = sheet.first_triangle;
    edges = sheet_edges({stack.triangles.data() + sheet.first_triangle, static_cast<std::size_t>(sheet.triangle_count)});
    for (const SheetEdge& edge : edges) defects.non_manifold_edges += !edge.manifold();
    for (Index i = 0; i < sheet.triangle_count; ++i) defects.zero_area += area(stack, sheet.first_triangle + i) == 0.0;
  }
  for (const SheetEdge& edge : model_edges) {
    if (edge.border() && on_interface(stack, domain, edge, model_first) && !in_sorted(support_edges, edge)) {
      ++defects.border_gaps;
    }
  }
  return defects;
}

void inspect(const LayerStack& stack, const Domain& domain, const RunContext& run, LayersReport& report) {
  std::vector<std::size_t> first_of_level;
  for (std::size_t s = 0; s < stack.sheets.size(); ++s) {
    if (s == 0 || stack.sheets[s].iso_value != stack.sheets[s - 1].iso_value) first_of_level.push_back(s);
  }
  first_of_level.push_back(stack.sheets.size());
  std::vector<SheetDefects> defects(first_of_level.size() - 1);
  parallel_for(defects.size(), 1, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t l = begin; l < end; ++l) {
      defects[l] = inspect_level(stack, domain, first_of_level[l], first_of_level[l + 1]);
    }
  });
  SheetDefects sum;
  for (const SheetDefects& d : defects) {
    sum.non_manifold_edges += d.non_manifold_edges;
    sum.border_gaps += d.border_gaps;
    sum.zero_area += d.zero_area;
  }
  report.degenerate_triangles = sum.zero_area;
  report.checks.push_back(check_equal("layers.non_manifold_edges", sum.non_manifold_edges, 0.0,
                                      "edges of a sheet that are not in one triangle, or in two that agree on what is up"));
  report.checks.push_back(check_equal("layers.border_gaps", sum.border_gaps, 0.0,
                                      "border edges of a model sheet on the interface that the support sheet lacks"));
  double lowest = 0.0;
  for (const Vec3& v : stack.vertices) lowest = std::min(lowest, v.z());
  report.checks.push_back(check_at_least("layers.above_platform", lowest, 0.0, "z of the lowest point of all layers, mm"));
}

}  // namespace

LayersResult slice_layers(const Domain& domain, const ScalarField& field, int layer_count, const RunContext& run) {
  const std::vector<Level> levels = all_levels(field, layer_count);
  std::vector<Index> tets(domain.mesh.tets.size());
  std::iota(tets.begin(), tets.end(), 0);

  LayersResult result;
  result.stack = extract_levels(domain, field, layer_count, levels, tets, run);
  LayersReport& report = result.report;
  for (const Sheet& sheet : result.stack.sheets) {
    ++(sheet.material == Material::model ? report.model_layers : report.support_layers);
  }
  report.triangles = static_cast<Index>(result.stack.triangles.size());
  const auto thickness = thickness_quantiles(result.stack, domain, field, {0.01, 0.50, 0.99});
  report.thickness_p1_mm = thickness[0];
  report.thickness_p50_mm = thickness[1];
  report.thickness_p99_mm = thickness[2];
  inspect(result.stack, domain, run, report);
  run.log(LogLevel::info, format("layers: %d of the model, %d of support, %d triangles", report.model_layers,
                                 report.support_layers, report.triangles));
  return result;
}

}  // namespace curvesup
