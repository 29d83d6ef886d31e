#include "toolpath/model_above.h"

#include <algorithm>
#include <cmath>

#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup::toolpath {
namespace {

constexpr double kCell = 1.5;       // mm
constexpr double kSameLayer = 0.4;  // of a layer's thickness, between a place and the layer that it is said to lie on
constexpr double kRough = 0.05;     // mm; the same for thin layers

template <class Visit>
void for_cells(const Vec3& low, const Vec3& high, const Visit& visit) {
  const auto index = [](double x) { return static_cast<std::int64_t>(std::floor(x / kCell)) + (1 << 20); };
  for (std::int64_t x = index(low.x()); x <= index(high.x()); ++x) {
    for (std::int64_t y = index(low.y()); y <= index(high.y()); ++y) {
      for (std::int64_t z = index(low.z()); z <= index(high.z()); ++z) {
        visit(static_cast<std::uint64_t>(x) << 42 | static_cast<std::uint64_t>(y) << 21 | static_cast<std::uint64_t>(z));
      }
    }
  }
}

}  // namespace

ModelAbove::ModelAbove(const LayerStack& stack) : stack_(stack) {
  bool any = false;
  Index last = 0;
  for (const Sheet& sheet : stack.sheets) {
    if (sheet.material != Material::model) continue;
    first_layer_ = any ? std::min(first_layer_, sheet.layer) : sheet.layer;
    last = any ? std::max(last, sheet.layer) : sheet.layer;
    any = true;
  }
  if (!any) return;
  layers_.resize(last - first_layer_ + 1);
  for (const Sheet& sheet : stack.sheets) {
    if (sheet.material != Material::model) continue;
    std::vector<Entry>& entries = layers_[sheet.layer - first_layer_];
    for (Index t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) {
      const auto& [i, j, k] = stack.triangles[t];
      const Vec3 &a = stack.vertices[i], &b = stack.vertices[j], &c = stack.vertices[k];
      for_cells(a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c), [&](std::uint64_t key) { entries.emplace_back(key, t); });
    }
  }
  for (std::vector<Entry>& entries : layers_) std::sort(entries.begin(), entries.end());
}

bool ModelAbove::lies_at(Index layer, const Vec3& place, double reach) const {
  const Index at = layer - first_layer_;
  if (at < 0 || at >= static_cast<Index>(layers_.size())) return false;
  const std::vector<Entry>& entries = layers_[at];
  bool found = false;
  for_cells(place.array() - reach, place.array() + reach, [&](std::uint64_t key) {
    for (auto e = std::lower_bound(entries.begin(), entries.end(), Entry(key, 0)); !found && e != entries.end() && e->first == key; ++e) {
      const auto& [i, j, k] = stack_.triangles[e->second];
      const Vec3 nearest = closest_point_on_triangle(place, stack_.vertices[i], stack_.vertices[j], stack_.vertices[k]);
      found = (nearest - place).norm() <= reach;
    }
  });
  return found;
}

bool ModelAbove::stands_over(const PieceMesh& piece, const Sheet& sheet, int layers, double gap_mm, double area) const {
  double under = 0.0;
  for (std::size_t t = 0; t < piece.triangles.size() && under < area; ++t) {
    const auto& [a, b, c] = piece.triangles[t];
    const Vec3 centre = (piece.vertices[a] + piece.vertices[b] + piece.vertices[c]) / 3.0;
    const Vec3 up = (piece.normals[a] + piece.normals[b] + piece.normals[c]).normalized();
    const double thickness = piece.thickness[t] * sheet.passes;
    const double below_middle = 0.5 - (sheet.pass + 0.5) / sheet.passes;  // of the pass, in layers
    const int last = layers + std::min(100, static_cast<int>(std::ceil(gap_mm / thickness - 1e-9)));
    for (int i = 1; i <= last; ++i) {
      if (!lies_at(sheet.layer + i, centre + (i + below_middle) * thickness * up, kSameLayer * thickness + kRough)) continue;
      under += triangle_area(piece.vertices[a], piece.vertices[b], piece.vertices[c]);
      break;
    }
  }
  return under >= area;
}

}  // namespace curvesup::toolpath
