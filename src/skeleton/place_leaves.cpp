#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <tuple>

#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/mesh/triangle_tree.h"
#include "curvesup/skeleton/grow_skeleton.h"
#include "skeleton/point_grid.h"
#include "skeleton/sample_overhang.h"

namespace curvesup {
namespace {

constexpr double kSamplesPerSpacing = 4.0;
// In a hexagonal lattice with neighbours sqrt(3) spacings apart every point is within the spacing of a leaf.
constexpr double kStepsPerSpacing = std::numbers::sqrt3;
constexpr double kElbowRoom = 0.75;  // lattice steps that a leaf of the lattice keeps from all others
constexpr double kInset_mm = 1e-3;   // that a leaf keeps from the border of its face
constexpr double kReach = 2.0;       // spacings beyond which a sample need not know a leaf
constexpr double kEuclidean = std::numbers::sqrt2;
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// For each boundary vertex that is asked for, one face around it: an overhang face where there is one.
std::vector<Index> face_of_vertex(const Model& model, const Overhang& overhang) {
  std::vector<Index> face(model.mesh.vertices.size(), kNone);
  for (const Index f : overhang.faces) {
    for (const Index v : model.boundary[f].vertices) {
      if (face[v] == kNone) face[v] = f;
    }
  }
  for (std::size_t f = 0; f < model.boundary.size(); ++f) {
    for (const Index v : model.boundary[f].vertices) {
      if (face[v] == kNone) face[v] = static_cast<Index>(f);
    }
  }
  return face;
}

std::vector<LeafSite> vertex_sites(const Model& model, const std::vector<Index>& vertices,
                                   const std::vector<Vec3>& directions, const std::vector<Index>& face) {
  std::vector<LeafSite> sites;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Index v = vertices[i];
    sites.push_back({model.mesh.vertices[v], directions[i], face[v], v});
  }
  return sites;
}

// Squared distance that counts for coverage: across d_p at the sample, and as far along it at most. In single precision,
// so that what is equal but for rounding is equal. The Euclidean one may be kEuclidean times as long.
float coverage_distance2(const LeafSite& sample, const Vec3& leaf) {
  const Vec3 offset = leaf - sample.position;
  const double along = offset.dot(sample.direction), along2 = along * along;
  return static_cast<float>(std::max(offset.squaredNorm() - along2, along2));
}

// Lower places come first, what is nearly as high by y, then by x.
bool comes_first(const Vec3& a, const Vec3& b) {
  if (std::abs(a.z() - b.z()) > 2e-6) return a.z() < b.z();
  const auto key = [](const Vec3& p) {
    return std::tuple(std::round(p.z() * 1e6), std::round(p.y() * 1e6), std::round(p.x() * 1e6));
  };
  return key(a) < key(b);
}

std::vector<Vec3> positions_of(const std::vector<LeafSite>& sites) {
  std::vector<Vec3> result;
  result.reserve(sites.size());
  for (const LeafSite& s : sites) result.push_back(s.position);
  return result;
}

// How far each sample is from the nearest leaf. The samples of one face stand together as a block; the queue holds one entry
// a block, so stale entries cost a short scan each. Equal distances go to the lowest place, not to the first face.
class Uncovered {
 public:
  Uncovered(const std::vector<LeafSite>& samples, double spacing)
      : samples_(samples),
        grid_(positions_of(samples), spacing),
        spacing_(spacing),
        limit2_(static_cast<float>(spacing * spacing)) {
    distance2_.assign(samples.size(), static_cast<float>(kInfinity));
    for (std::size_t s = 0; s < samples.size(); ++s) {
      if (s == 0 || samples[s].face != samples[s - 1].face) blocks_.push_back(static_cast<Index>(s));
    }
    blocks_.push_back(static_cast<Index>(samples.size()));
    for (Index b = 0; b + 1 < static_cast<Index>(blocks_.size()); ++b) queue_.push_back(farthest(b));
    std::make_heap(queue_.begin(), queue_.end(), later);
  }

  // A leaf is there. Most of what it does not cover itself its neighbours will, so that who is how far waits.
  void place(const Vec3& leaf) {
    look_from(leaf, 1.0);
    placed_.push_back(leaf);
  }

  // The sample farthest from all leaves, kNone when all are covered.
  Index next() {
    for (const Vec3& leaf : placed_) look_from(leaf, kReach);
    placed_.clear();
    while (!queue_.empty() && queue_.front().distance2 > limit2_) {
      std::pop_heap(queue_.begin(), queue_.end(), later);
      const Entry entry = queue_.back();
      queue_.back() = farthest(entry.block);
      std::push_heap(queue_.begin(), queue_.end(), later);
      if (distance2_[entry.sample] == entry.distance2) return entry.sample;  // else a leaf came nearer meanwhile
    }
    return kNone;
  }

 private:
  struct Entry {
    float distance2;
    Vec3 position;
    Index block, sample;
  };
  static bool later(const Entry& a, const Entry& b) {
    return a.distance2 != b.distance2 ? a.distance2 < b.distance2 : comes_first(b.position, a.position);
  }
  void look_from(const Vec3& leaf, double spacings) {
    grid_.near(leaf, kEuclidean * spacings * spacing_, [&](Index s) {
      distance2_[s] = std::min(distance2_[s], coverage_distance2(samples_[s], leaf));
      return distance2_[s] > limit2_;
    });
  }
  [[nodiscard]] Entry farthest(Index block) const {
    Index best = blocks_[block];
    for (Index s = best + 1; s < blocks_[block + 1]; ++s) {
      if (distance2_[s] > distance2_[best] ||
          (distance2_[s] == distance2_[best] && comes_first(samples_[s].position, samples_[best].position))) {
        best = s;
      }
    }
    return {distance2_[best], samples_[best].position, block, best};
  }
  const std::vector<LeafSite>& samples_;
  ShrinkingPointGrid grid_;  // of those that are not covered
  double spacing_;
  float limit2_;
  std::vector<float> distance2_;  // once a sample is covered, any that says so
  std::vector<Vec3> placed_;      // leaves from which only what they cover was looked at
  std::vector<Index> blocks_;  // first sample of each block, and the end
  std::vector<Entry> queue_;
};

// The places around a leaf in a hexagonal lattice that follows the overhang.
class Lattice {
 public:
  Lattice(const Model& model, const ScalarField& field, const Overhang& overhang, double step)
      : model_(model), field_(field), overhang_(overhang), step_(step), tree_(faces(model, overhang)) {}

  // The six places around a leaf; `along` points to the first of them. Not the one behind if that is where it came from.
  template <typename Emit>
  void neighbours(const LeafSite& leaf, const Vec3& along, bool first, Emit&& emit) const {
    const Vec3 across = leaf.direction.cross(along);
    for (int k = 0; k < 6; ++k) {
      if (k == 3 && !first) continue;
      const double angle = k * std::numbers::pi / 3.0;
      const Vec3 way = std::cos(angle) * along + std::sin(angle) * across;
      if (const auto site = below_or_above(leaf.position + step_ * way, leaf.direction)) emit(*site, way);
    }
  }

 private:
  static TriangleMesh faces(const Model& model, const Overhang& overhang) {
    TriangleMesh mesh{model.mesh.vertices, {}};
    for (const Index f : overhang.faces) mesh.triangles.push_back(model.boundary[f].vertices);
    return mesh;
  }
  // The nearest point of the overhang on a line.
  [[nodiscard]] std::optional<LeafSite> below_or_above(const Vec3& p, const Vec3& direction) const {
    const auto hit = tree_.nearest_hit(p, direction, step_);
    if (!hit) return std::nullopt;
    const Index face = overhang_.faces[hit->triangle];
    return LeafSite{p + hit->t * direction, -print_direction(field_, model_.boundary[face].tet), face, kNone};
  }

  const Model& model_;
  const ScalarField& field_;
  const Overhang& overhang_;
  double step_;
  TriangleTree tree_;
};

// What of a vector is across `direction`, of unit length.
Vec3 across(const Vec3& direction, const Vec3& way) { return (way - way.dot(direction) * direction).normalized(); }

// A vector that is not along `direction`, the same for directions that are nearly the same.
Vec3 any_side(const Vec3& direction) { return std::abs(direction.x()) < 0.8 ? Vec3::UnitX() : Vec3::UnitY(); }

// The leaves that have been placed, and how near to them others may come.
class ElbowRoom {
 public:
  ElbowRoom(const Model& model, double room) : room_(room), leaves_(cells(model, room)) {}

  void place(const Vec3& leaf) {
    positions_.push_back(leaf);
    leaves_.add(leaf);
  }
  [[nodiscard]] bool crowded(const LeafSite& site) const {
    const float room2 = static_cast<float>(room_ * room_);
    return leaves_.any_near(site.position, kEuclidean * room_,
                            [&](Index i) { return coverage_distance2(site, positions_[i]) < room2; });
  }

 private:
  static constexpr double kMaxCells = 1e6;
  static CellBox cells(const Model& model, double room) {
    Vec3 low = model.mesh.vertices.front(), high = low;
    for (const Vec3& p : model.mesh.vertices) low = low.cwiseMin(p), high = high.cwiseMax(p);
    return {low, high, room, kMaxCells};
  }
  double room_;
  std::vector<Vec3> positions_;
  GrowingPointGrid leaves_;
};

// A little way into its face: on an edge a ray may start in the wrong tet.
void inset(const Model& model, LeafSite& leaf) {
  const auto& v = model.boundary[leaf.face].vertices;
  const Vec3 to_centre = (model.mesh.vertices[v[0]] + model.mesh.vertices[v[1]] + model.mesh.vertices[v[2]]) / 3.0 - leaf.position;
  const double length = to_centre.norm();
  if (length > kInset_mm) leaf.position += kInset_mm / length * to_centre;
}

// Farthest first, so that what comes early lies well apart: of branches that carry the same the earlier one is host.
std::vector<LeafSite> scattered(const std::vector<LeafSite>& leaves, double spacing) {
  const std::vector<Vec3> at = positions_of(leaves);
  const PointGrid grid(at, spacing);
  std::vector<float> distance2(leaves.size(), static_cast<float>(kInfinity));
  struct Entry {
    float distance2;  // or less by now
    Index leaf;
  };
  std::vector<Entry> queue;
  for (std::size_t i = 0; i < leaves.size(); ++i) queue.push_back({distance2[i], static_cast<Index>(i)});
  const auto later = [&](const Entry& a, const Entry& b) {
    return a.distance2 != b.distance2 ? a.distance2 < b.distance2 : comes_first(at[b.leaf], at[a.leaf]);
  };
  std::make_heap(queue.begin(), queue.end(), later);
  std::vector<LeafSite> result;
  while (!queue.empty()) {
    std::pop_heap(queue.begin(), queue.end(), later);
    Entry& last = queue.back();
    const auto [farthest2, leaf] = last;
    if (distance2[leaf] < farthest2) {
      last.distance2 = distance2[leaf];
      std::push_heap(queue.begin(), queue.end(), later);
      continue;
    }
    queue.pop_back();
    result.push_back(leaves[leaf]);
    // No other leaf is farther from its nearest than this one was.
    grid.near(at[leaf], std::sqrt(static_cast<double>(farthest2)), [&](Index i) {
      distance2[i] = std::min(distance2[i], static_cast<float>((at[i] - at[leaf]).squaredNorm()));
    });
  }
  return result;
}

}  // namespace

double effective_leaf_spacing(const SkeletonOptions& options) {
  return options.leaf_spacing_mm < 0.0 ? options.leaf_radius_mm + 0.5 * options.bead_width_mm : options.leaf_spacing_mm;
}

std::vector<LeafSite> place_leaves(const Model& model, const ScalarField& field, const Overhang& overhang,
                                   double spacing_mm, const RunContext& run) {
  const std::vector<Index> face = face_of_vertex(model, overhang);
  std::vector<LeafSite> leaves = vertex_sites(model, overhang.minima, overhang.minimum_direction, face);
  if (spacing_mm <= 0.0) {
    const auto vertices = vertex_sites(model, overhang.vertices, overhang.vertex_direction, face);
    leaves.insert(leaves.end(), vertices.begin(), vertices.end());
    return leaves;
  }
  const std::vector<LeafSite> samples = sample_overhang(model, field, overhang, spacing_mm / kSamplesPerSpacing);
  const double step = kStepsPerSpacing * spacing_mm;
  const Lattice lattice(model, field, overhang, step);
  Uncovered uncovered(samples, spacing_mm);
  ElbowRoom elbow_room(model, kElbowRoom * step);
  const auto place = [&](const LeafSite& leaf) {
    uncovered.place(leaf.position);
    elbow_room.place(leaf.position);
  };
  std::for_each(leaves.begin(), leaves.end(), place);
  for (Index s = uncovered.next(); s != kNone; s = uncovered.next()) {
    run.check_stop();
    // From this leaf the lattice spreads as far as there is room.
    std::vector<std::pair<LeafSite, Vec3>> front;
    const auto add = [&](const LeafSite& site, const Vec3& along) {
      leaves.push_back(site);
      place(site);
      front.emplace_back(site, along);
    };
    add(samples[s], across(samples[s].direction, any_side(samples[s].direction)));
    for (std::size_t i = 0; i < front.size(); ++i) {
      const auto [leaf, along] = front[i];
      lattice.neighbours(leaf, along, i == 0, [&](const LeafSite& site, const Vec3& way) {
        if (!elbow_room.crowded(site)) add(site, across(site.direction, way));
      });
    }
  }
  for (LeafSite& leaf : leaves) {
    if (leaf.vertex == kNone) inset(model, leaf);
  }
  return scattered(leaves, spacing_mm);
}

}  // namespace curvesup
