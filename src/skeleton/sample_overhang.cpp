#include "skeleton/sample_overhang.h"

#include <algorithm>
#include <cmath>

#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup {
namespace {

constexpr double kOffset = 0.37;       // steps by which the grid lies beside the origin: models like round coordinates
constexpr double kTouch = 1e-9;        // steps within which a line meets a triangle
constexpr double kLevelEnough = 0.56;  // a normal's component below 1 / sqrt(3), so that one axis has it
constexpr double kCornerCosine = 0.94;

int projection_axis(const Vec3& normal) {
  const double enough = kLevelEnough * normal.norm();
  return std::abs(normal.z()) >= enough ? 2 : std::abs(normal.x()) >= enough ? 0 : 1;
}

// Calls emit(c) for every grid coordinate c in [low, high].
template <typename Emit>
void grid_between(double low, double high, double step, Emit&& emit) {
  const double last = std::floor(high / step - kOffset + kTouch);
  for (double i = std::ceil(low / step - kOffset - kTouch); i <= last; ++i) emit((i + kOffset) * step);
}

// Where grid lines meet a triangle, along the axis that is most normal to it.
template <typename Emit>
void sample_triangle(const std::array<Vec3, 3>& corner, double step, Emit&& emit) {
  const Vec3 normal = area_normal(corner[0], corner[1], corner[2]);
  const int w = projection_axis(normal), u = (w + 1) % 3, v = (w + 2) % 3;
  if (normal[w] == 0.0) return;
  const auto [low, high] = std::minmax({corner[0][u], corner[1][u], corner[2][u]});
  grid_between(low, high, step, [&](double x) {
    double from = std::numeric_limits<double>::infinity(), to = -from;
    for (int e = 0; e < 3; ++e) {
      const Vec3 &a = corner[e], &b = corner[(e + 1) % 3];
      const auto [left, right] = std::minmax(a[u], b[u]);
      if (x < left - kTouch * step || x > right + kTouch * step) continue;
      const double t = right > left ? std::clamp((x - a[u]) / (b[u] - a[u]), 0.0, 1.0) : 0.0;
      from = std::min(from, a[v] + t * (b[v] - a[v]));
      to = std::max(to, a[v] + t * (b[v] - a[v]));
    }
    grid_between(from, to, step, [&](double y) {
      Vec3 p;
      p[u] = x;
      p[v] = y;
      p[w] = corner[0][w] - (normal[u] * (x - corner[0][u]) + normal[v] * (y - corner[0][v])) / normal[w];
      emit(p);
    });
  });
}

struct Border {
  Index from, to, face;  // in the face's sense
};

// Edges with an overhang face on one side only.
std::vector<Border> border_of(const Model& model, const Overhang& overhang) {
  std::vector<Border> edges;
  for (const Index f : overhang.faces) {
    const auto& v = model.boundary[f].vertices;
    for (int e = 0; e < 3; ++e) edges.push_back({v[e], v[(e + 1) % 3], f});
  }
  const auto key = [](const Border& b) { return std::minmax(b.from, b.to); };
  std::sort(edges.begin(), edges.end(), [&](const Border& a, const Border& b) { return key(a) < key(b); });
  std::vector<Border> border;
  for (std::size_t i = 0; i < edges.size();) {
    std::size_t end = i + 1;
    while (end < edges.size() && key(edges[end]) == key(edges[i])) ++end;
    if (end == i + 1) border.push_back(edges[i]);
    i = end;
  }
  return border;
}

// Vertices where the border bends or branches.
std::vector<char> corners_of(const Model& model, const std::vector<Border>& border) {
  std::vector<Index> ends(model.mesh.vertices.size(), 0);
  std::vector<Vec3> bend(model.mesh.vertices.size(), Vec3::Zero());
  for (const Border& b : border) {
    const Vec3 along = (model.mesh.vertices[b.to] - model.mesh.vertices[b.from]).normalized();
    bend[b.from] += along;
    bend[b.to] -= along;
    ++ends[b.from], ++ends[b.to];
  }
  std::vector<char> corner(ends.size(), 0);
  for (std::size_t v = 0; v < ends.size(); ++v) {
    corner[v] = ends[v] > 0 && (ends[v] != 2 || bend[v].squaredNorm() > 2.0 - 2.0 * kCornerCosine);
  }
  return corner;
}

}  // namespace

std::vector<LeafSite> sample_overhang(const Model& model, const ScalarField& field, const Overhang& overhang, double step_mm) {
  const auto& at = model.mesh.vertices;
  std::vector<Border> border = border_of(model, overhang);
  const std::vector<char> corner = corners_of(model, border);
  std::sort(border.begin(), border.end(), [](const Border& a, const Border& b) {
    return a.face != b.face ? a.face < b.face : a.from < b.from;
  });
  std::vector<LeafSite> samples;
  samples.reserve(static_cast<std::size_t>(1.2 * overhang.area_mm2 / (step_mm * step_mm)));
  auto edge = border.begin();
  for (const Index f : overhang.faces) {
    const auto& v = model.boundary[f].vertices;
    const Vec3 direction = -print_direction(field, model.boundary[f].tet);
    const auto emit = [&](const Vec3& p) { samples.push_back({p, direction, f, kNone}); };
    sample_triangle({at[v[0]], at[v[1]], at[v[2]]}, step_mm, emit);
    for (; edge != border.end() && edge->face == f; ++edge) {
      const Vec3 &a = at[edge->from], &b = at[edge->to];
      for (int axis = 0; axis < 3; ++axis) {
        grid_between(std::min(a[axis], b[axis]), std::max(a[axis], b[axis]), step_mm, [&](double x) {
          if (a[axis] != b[axis]) emit(a + std::clamp((x - a[axis]) / (b[axis] - a[axis]), 0.0, 1.0) * (b - a));
        });
      }
      if (corner[edge->from]) emit(a);
      if (corner[edge->to]) emit(b);
    }
  }
  return samples;
}

}  // namespace curvesup
