#include "curvesup/solid/envelope_solid.h"

#include <CGAL/Delaunay_triangulation_3.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Fixed_alpha_shape_3.h>
#include <CGAL/Fixed_alpha_shape_cell_base_3.h>
#include <CGAL/Fixed_alpha_shape_vertex_base_3.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/mesh/triangle_tree.h"

namespace curvesup {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Fixed_alpha_shape_vertex_base_3<Kernel>;
using CellBase = CGAL::Fixed_alpha_shape_cell_base_3<Kernel>;
using Delaunay = CGAL::Delaunay_triangulation_3<Kernel, CGAL::Triangulation_data_structure_3<VertexBase, CellBase>>;
using AlphaComplex = CGAL::Fixed_alpha_shape_3<Delaunay>;

constexpr double kHorizontal = 0.25;  // a ray that falls by less than this per mm is turned half way down
constexpr double kLift = 0.02;        // mm off the face at which a ray starts
constexpr double kBlocked = 0.1;      // mm: a ray that ends sooner started into the solid
constexpr double kHintCell = 3.0;     // mm
constexpr double kCapRadii = 4.0;     // distances are exact up to so many leaf radii

Vec3 to_vec(const Kernel::Point_3& p) { return {p.x(), p.y(), p.z()}; }

Vec3 falling(Vec3 direction) {
  while (direction.z() > -kHorizontal) {
    const Vec3 half_way = direction - Vec3::UnitZ();
    direction = half_way.norm() > 1e-6 ? Vec3(half_way.normalized()) : Vec3(-Vec3::UnitZ());
  }
  return direction;
}

// Length of a ray down to the model or the platform.
double ray_length(const TriangleTree& surface, const Vec3& start, const Vec3& u) {
  const double to_platform = std::max(0.0, -start.z() / u.z());
  const auto hit = surface.first_hit(start, u, 1e-9, to_platform);
  return hit ? hit->t : to_platform;
}

// Points every `step` from the leaf to the end of its ray, both ends included.
std::vector<Vec3> sample_rays(const Model& model, std::span<const LeafSite> leaves, double step,
                              const RunContext& run) {
  const TriangleMesh mesh = boundary_surface(model);
  const TriangleTree surface(mesh);
  std::vector<Vec3> points;
  for (std::size_t i = 0; i < leaves.size(); ++i) {
    if (i % 256 == 0) run.check_stop();
    const LeafSite& leaf = leaves[i];
    const auto& v = mesh.triangles[leaf.face];
    const Vec3 normal = area_normal(mesh.vertices[v[0]], mesh.vertices[v[1]], mesh.vertices[v[2]]).normalized();
    const Vec3 u = falling(leaf.direction);
    Vec3 start = leaf.position + kLift * normal;
    double length = ray_length(surface, start, u);
    if (length < kBlocked && leaf.vertex != kNone) {  // 25 % towards the face's centroid, as for the tree
      start += 0.25 * ((mesh.vertices[v[0]] + mesh.vertices[v[1]] + mesh.vertices[v[2]]) / 3.0 - leaf.position);
      length = ray_length(surface, start, u);
    }
    points.push_back(leaf.position);
    const int n = std::max(1, static_cast<int>(std::ceil(length / step)));
    for (int s = 1; s <= n; ++s) points.push_back(start + length * s / n * u);
  }
  return points;
}

class EnvelopeSolid : public Solid {
 public:
  EnvelopeSolid(const std::vector<Vec3>& points, const EnvelopeOptions& options)
      : radius_(options.leaf_radius_mm), cap_(kCapRadii * options.leaf_radius_mm) {
    std::vector<Kernel::Point_3> input;
    input.reserve(points.size());
    for (const Vec3& p : points) input.emplace_back(p.x(), p.y(), p.z());
    Delaunay delaunay(input.begin(), input.end());
    complex_ = std::make_unique<AlphaComplex>(delaunay, options.alpha_mm * options.alpha_mm);
    collect_border();
    collect_hints(points);
  }

  [[nodiscard]] double value(const Vec3& p) const override {
    if (inside(p)) return radius_;
    const auto nearest = border_.nearest(p, cap_);
    return radius_ - (nearest ? nearest->distance : cap_);
  }

  [[nodiscard]] Bounds bounds(const Vec3& centre, double radius) const override {
    const double at = value(centre);
    const double low = at <= radius_ - cap_ ? -std::numeric_limits<double>::infinity() : at - radius;
    return {low, std::min(radius_, at + radius)};
  }

  void report(EnvelopeReport& report) const {
    report.inner_tets = inner_tets_;
    report.border_simplices = border_simplices_;
  }

 private:
  [[nodiscard]] bool is_inner(AlphaComplex::Cell_handle cell) const {
    return complex_->classify(cell) == AlphaComplex::INTERIOR;
  }

  // Border triangles, and as degenerate triangles the edges and points that no triangle holds.
  void collect_border() {
    TriangleMesh mesh;
    const auto add = [&](const Vec3& a, const Vec3& b, const Vec3& c) {
      const Index first = static_cast<Index>(mesh.vertices.size());
      mesh.vertices.insert(mesh.vertices.end(), {a, b, c});
      mesh.triangles.push_back({first, first + 1, first + 2});
    };
    const auto at = [](const auto& cell, int i) { return to_vec(cell->vertex(i)->point()); };
    for (auto f = complex_->finite_facets_begin(); f != complex_->finite_facets_end(); ++f) {
      const auto type = complex_->classify(*f);
      if (type != AlphaComplex::REGULAR && type != AlphaComplex::SINGULAR) continue;
      const auto& [cell, i] = *f;
      add(at(cell, (i + 1) & 3), at(cell, (i + 2) & 3), at(cell, (i + 3) & 3));
    }
    for (auto e = complex_->finite_edges_begin(); e != complex_->finite_edges_end(); ++e) {
      if (complex_->classify(*e) != AlphaComplex::SINGULAR) continue;
      const Vec3 a = at(e->first, e->second), b = at(e->first, e->third);
      add(a, b, b);
    }
    for (auto v = complex_->finite_vertices_begin(); v != complex_->finite_vertices_end(); ++v) {
      if (complex_->classify(v) != AlphaComplex::SINGULAR) continue;
      const Vec3 p = to_vec(v->point());
      add(p, p, p);
    }
    for (auto c = complex_->finite_cells_begin(); c != complex_->finite_cells_end(); ++c) inner_tets_ += is_inner(c);
    border_simplices_ = static_cast<Index>(mesh.triangles.size());
    border_ = TriangleTree(mesh);
  }

  // A cell of the triangulation near each place, where the search for a point starts.
  void collect_hints(const std::vector<Vec3>& points) {
    Vec3 high = low_ = points[0];
    for (const Vec3& p : points) low_ = low_.cwiseMin(p), high = high.cwiseMax(p);
    for (int a = 0; a < 3; ++a) count_[a] = static_cast<int>((high - low_)[a] / kHintCell) + 1;
    AlphaComplex::Cell_handle near;
    for (int z = 0; z < count_[2]; ++z) {
      for (int y = 0; y < count_[1]; ++y) {
        for (int x = 0; x < count_[0]; ++x) {
          const Vec3 p = low_ + kHintCell * Vec3(x + 0.5, y + 0.5, z + 0.5);
          near = complex_->locate({p.x(), p.y(), p.z()}, near);
          hints_.push_back(near);
        }
      }
    }
    high_ = high;
  }

  [[nodiscard]] bool inside(const Vec3& p) const {
    if (complex_->dimension() < 3 || (p.array() < low_.array()).any() || (p.array() > high_.array()).any())
      return false;
    int at[3];
    for (int a = 0; a < 3; ++a) at[a] = std::min(count_[a] - 1, static_cast<int>((p[a] - low_[a]) / kHintCell));
    const auto hint = hints_[(static_cast<std::size_t>(at[2]) * count_[1] + at[1]) * count_[0] + at[0]];
    const auto cell = complex_->locate({p.x(), p.y(), p.z()}, hint);
    return !complex_->is_infinite(cell) && is_inner(cell);
  }

  std::unique_ptr<AlphaComplex> complex_;
  TriangleTree border_;
  std::vector<AlphaComplex::Cell_handle> hints_;
  Vec3 low_ = Vec3::Zero(), high_ = Vec3::Zero();
  int count_[3] = {1, 1, 1};
  double radius_, cap_;
  Index inner_tets_ = 0, border_simplices_ = 0;
};

class NoSolid : public Solid {
 public:
  [[nodiscard]] double value(const Vec3&) const override { return -1.0; }
  [[nodiscard]] Bounds bounds(const Vec3&, double) const override { return {-1.0, -1.0}; }
};

void require_positive(double value, const char* key) {
  if (!(value > 0.0)) throw Error(ErrorKind::usage, key, format("is %g, must be above 0", value));
}

}  // namespace

EnvelopeResult build_envelope(const Model& model, std::span<const LeafSite> leaves, const EnvelopeOptions& options,
                              const RunContext& run) {
  require_positive(options.alpha_mm, "support.alpha_mm");
  require_positive(options.leaf_radius_mm, "support.leaf_radius_mm");
  require_positive(options.sample_step_mm, "support.sample_step_mm");
  EnvelopeResult result;
  if (leaves.empty()) {
    result.solid = std::make_unique<NoSolid>();
    return result;
  }
  const std::vector<Vec3> points = sample_rays(model, leaves, options.sample_step_mm, run);
  auto solid = std::make_unique<EnvelopeSolid>(points, options);
  result.report.rays = static_cast<Index>(leaves.size());
  result.report.samples = static_cast<Index>(points.size());
  solid->report(result.report);
  result.solid = std::move(solid);
  return result;
}

}  // namespace curvesup
