#include "curvesup/solid/interface_solid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "curvesup/core/error.h"
#include "curvesup/mesh/triangle_tree.h"

namespace curvesup {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// A point under an overhang face at most 45 degrees off d_p is at most so many times nearer to it than along d_p.
constexpr double kSlant = std::numbers::sqrt2;
// mm. What a gap leaves of a strut may be as thin as one likes; strips narrower than twice this may be lost.
constexpr double kThinnestRest = 0.5;

class InterfaceSolid final : public Solid {
 public:
  InterfaceSolid(std::shared_ptr<const Solid> base, const Model& model, const ScalarField& field, const Overhang& overhang,
                 int layer_count, const InterfaceOptions& options, std::span<const Contact> contacts)
      : base_(std::move(base)), options_(options), contacts_(contacts.begin(), contacts.end()) {
    const auto part = [&](const std::vector<Index>& faces) {
      TriangleMesh mesh;
      mesh.vertices = model.mesh.vertices;
      for (const Index f : faces) mesh.triangles.push_back(model.boundary[f].vertices);
      return mesh;
    };
    for (const Index f : overhang.faces) {
      const Index tet = model.boundary[f].tet;
      const double slope = field.gradient[tet].norm();
      direction_.push_back(print_direction(field, tet));
      depth_.push_back(slope > 0.0 ? options.interface_layers / (slope * layer_count) : 0.0);
      deepest_ = std::max(deepest_, depth_.back());
    }
    if (!overhang.faces.empty()) overhang_ = TriangleTree(part(overhang.faces));
    std::vector<Index> walls;
    for (std::size_t f = 0; f < model.boundary.size() && options.side_gap_mm > 0.0; ++f) {
      const auto& v = model.boundary[f].vertices;
      const auto& p = model.mesh.vertices;
      const Vec3 normal = area_normal(p[v[0]], p[v[1]], p[v[2]]);
      if (std::abs(normal.dot(print_direction(field, model.boundary[f].tet))) < std::numbers::sqrt2 / 2 * normal.norm()) {
        walls.push_back(static_cast<Index>(f));
      }
    }
    if (!walls.empty()) walls_ = TriangleTree(part(walls));
    reach_ = std::max(deepest_, options.top_gap_mm);
  }

  [[nodiscard]] double value(const Vec3& p) const override {
    double value = base_->value(p);
    const Above above = look_up(p);
    if (above.depth > 0.0) value = std::max(value, std::min(1.0, above.depth - above.distance));
    if (options_.top_gap_mm > 0.0 && above.distance < reach_) value = std::min(value, above.distance - options_.top_gap_mm);
    if (!walls_.empty()) {
      const auto wall = walls_.nearest(p, options_.side_gap_mm + 1.0);
      if (wall) value = std::min(value, wall->distance - side_gap(p));
    }
    return value;
  }

  [[nodiscard]] Bounds bounds(const Vec3& centre, double radius) const override {
    Bounds bounds = base_->bounds(centre, radius);
    if (near_overhang(centre, radius)) return {-kInfinity, kInfinity};
    if (!walls_.empty() && walls_.nearest(centre, radius + options_.side_gap_mm + 1.0)) bounds.low = -kInfinity;
    return bounds;
  }
  [[nodiscard]] bool surely_outside(const Vec3& centre, double radius) const override {
    return base_->surely_outside(centre, radius) && (deepest_ <= 0.0 || !near_overhang(centre, radius));
  }
  [[nodiscard]] double thinnest_rest(const Vec3& centre, double radius) const override {
    return changed(centre, radius) ? kThinnestRest : 0.0;
  }
  [[nodiscard]] double thinnest_radius(const Vec3& centre, double radius, double enough) const override {
    return changed(centre, radius) ? 0.0 : base_->thinnest_radius(centre, radius, enough);
  }

 private:
  // The overhang over a point, along d_p: how far, and how deep the interface is there (0: nothing above).
  struct Above {
    double distance = kInfinity, depth = 0.0;
  };
  [[nodiscard]] Above look_up(const Vec3& p) const {
    if (overhang_.empty() || reach_ <= 0.0) return {};
    const auto near = overhang_.nearest(p, reach_);
    if (!near) return {};
    const auto hit = overhang_.first_hit(p, direction_[near->triangle], 0.0, kSlant * reach_);
    if (!hit) return {};
    return {hit->t, depth_[hit->triangle]};
  }
  [[nodiscard]] bool changed(const Vec3& centre, double radius) const {
    return near_overhang(centre, radius) || (!walls_.empty() && walls_.nearest(centre, radius + options_.side_gap_mm));
  }
  [[nodiscard]] double side_gap(const Vec3& p) const {
    double gap = options_.side_gap_mm;
    for (const Contact& contact : contacts_) gap = std::min(gap, std::max(0.0, (p - contact.centre).norm() - contact.radius_mm));
    return gap;
  }
  [[nodiscard]] bool near_overhang(const Vec3& centre, double radius) const {
    return !overhang_.empty() && overhang_.nearest(centre, radius + reach_).has_value();
  }

  std::shared_ptr<const Solid> base_;
  InterfaceOptions options_;
  std::vector<Contact> contacts_;
  TriangleTree overhang_, walls_;
  std::vector<Vec3> direction_;  // per overhang face: d_p
  std::vector<double> depth_;    // and the depth of the interface in mm
  double deepest_ = 0.0, reach_ = 0.0;
};

}  // namespace

std::vector<Contact> contacts_of(const Skeleton& skeleton, std::span<const ModelStand> stands) {
  std::vector<double> trunk(skeleton.nodes.size(), 0.0);
  for (const SkeletonEdge& e : skeleton.edges) trunk[e.lower] = std::max(trunk[e.lower], e.radius_mm);
  std::vector<Contact> contacts;
  for (const ModelStand& stand : stands) {
    const double radius = trunk[stand.node], height = std::max(0.0, radius - stand.radius_mm) / stand.slope;
    contacts.push_back({skeleton.nodes[stand.node].position, std::hypot(radius, height)});
  }
  return contacts;
}

std::shared_ptr<const Solid> with_interface(std::shared_ptr<const Solid> base, const Model& model, const ScalarField& field,
                                            const Overhang& overhang, int layer_count, const InterfaceOptions& options,
                                            std::span<const Contact> contacts) {
  if (options.interface_layers < 0) throw Error(ErrorKind::usage, "support.interface_layers", "is below 0");
  if (!(options.top_gap_mm >= 0.0)) throw Error(ErrorKind::usage, "support.top_gap_mm", "is below 0");
  if (!(options.side_gap_mm >= 0.0)) throw Error(ErrorKind::usage, "support.side_gap_mm", "is below 0");
  if (options.interface_layers == 0 && options.top_gap_mm == 0.0 && options.side_gap_mm == 0.0) return base;
  return std::make_shared<InterfaceSolid>(std::move(base), model, field, overhang, layer_count, options, contacts);
}

}  // namespace curvesup
