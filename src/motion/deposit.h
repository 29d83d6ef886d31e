#pragma once

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <span>
#include <vector>

#include "curvesup/core/run_context.h"
#include "curvesup/toolpath/toolpaths.h"
#include "motion/deposit_bounds.h"
#include "motion/head_shape.h"

namespace curvesup {

// What a body touches: the toolpath point whose bead it is, and by how much the wanted distance is missed.
struct Contact {
  Index point = kNone;
  Vec3 position = Vec3::Zero();
  double depth_mm = 0.0;
};

// Everything that the toolpaths will lay, as samples of the beads' upper faces, each with the toolpath point that lays
// it. A query names how much of it is printed already: "before point p" is what lies there when point p is reached. One
// hierarchy serves all moments, since every node knows the earliest point below it, and what is laid together lies
// together: a node is a patch of one layer, or of a few.
class Deposit {
 public:
  Deposit() = default;
  // Samples every bead at least every `spacing_mm` along its path. Tips must be those of the points.
  Deposit(std::span<const Path> paths, std::span<const PathPoint> points, std::span<const Vec3> tips,
          double spacing_mm);
  // The same, path after path; finish() comes before any query.
  explicit Deposit(double spacing_mm) : spacing_mm_(spacing_mm) {}
  void add_path(std::span<const PathPoint> points, std::span<const Vec3> tips);
  // Another's paths come behind these.
  void append(Deposit&& other);
  void finish();
  // Path first + i becomes the one that was first + order[i]; points are numbered anew.
  void reorder(std::size_t first, std::span<const Index> order);

  // First contact found with the head at `tip`, `axis`, or none. What lies no higher than `free_height` above the tip
  // plane is the nozzle's own business and never counts.
  [[nodiscard]] bool touches_head(const HeadShape& head, const Vec3& tip, const Vec3& axis, double free_height,
                                  double clearance, Index before, Contact* contact = nullptr) const;
  // The distance between the head and the nearest of what counts, or `most` where that is farther; negative inside.
  [[nodiscard]] double head_gap(const HeadShape& head, const Vec3& tip, const Vec3& axis, double free_height, double most,
                                Index before) const;
  // touches_head() for many poses of the head along a path: touches[i] becomes 1 where it touches. Poses near each other go
  // through the hierarchy together, so a pose that is far from contact costs a fraction of touches_head().
  struct HeadPose {
    Vec3 tip = Vec3::Zero(), axis = Vec3::UnitZ();
    double free_height = 0.0;
    Index before = 0;
  };
  void touches_head(const HeadShape& head, std::span<const HeadPose> poses, double clearance,
                    std::span<char> touches) const;
  // head_gap() for poses that are all near each other.
  void head_gaps(const HeadShape& head, std::span<const HeadPose> poses, double most, std::span<double> gaps) const;
  // The same for a capsule from a to b.
  [[nodiscard]] bool touches_capsule(const Vec3& a, const Vec3& b, double radius, double clearance, Index before,
                                     Contact* contact = nullptr) const;
  // Points of all beads that the head touches.
  void contacts_of_head(const HeadShape& head, const Vec3& tip, const Vec3& axis, double free_height, double clearance,
                        Index before, std::vector<Index>& points) const;
  // Highest z laid before a point; 0 when nothing is.
  [[nodiscard]] double top_before(Index before) const;
  [[nodiscard]] std::size_t size() const { return samples_; }

 private:
  struct Sample {
    float x, y, z;
    Index point;
    [[nodiscard]] Vec3 position() const { return {x, y, z}; }
  };
  // Before it is built in, with the direction across its layer in steps of 1/127.
  struct LooseSample : Sample {
    std::array<std::int8_t, 3> normal;
  };
  using Vec3f = Eigen::Vector3f;
  static constexpr Index kNever = std::numeric_limits<Index>::max();
  // What is left over in a leaf has the point kNever.
  [[nodiscard]] static Sample sample_of(const DepositSamples& leaf, std::size_t i) {
    return {leaf.x[i], leaf.y[i], leaf.z[i], leaf.point[i]};
  }
  // What bodies ask of boxes and samples; in the source file.
  class HeadBundle;
  class Capsule;

  void build();
  [[nodiscard]] std::vector<std::uint32_t> together() const;
  void build_nodes(std::span<const Vec3f> leaf_normals);
  void find_earliest();
  void find_tops();
  // The children of node n are the nodes 8 n + 1 ...; those behind the last node are the leaves.
  [[nodiscard]] std::size_t leaf_of(std::size_t node) const { return node - nodes_.size(); }
  // visit(sample) for each sample that is laid and that `body` does not exclude; it returns true to end the search.
  template <class Body, class Visit>
  bool visit(Index before, const Body& body, const Visit& visit) const;

  std::vector<LooseSample> loose_;  // until they are built into the hierarchy
  std::size_t samples_ = 0;
  std::vector<DepositBoxes> nodes_;  // a complete tree of eight children each over the leaves
  std::vector<DepositSamples> leaves_;
  double spacing_mm_ = 1.0;
  std::vector<double> own_top_;  // per path: highest z
  std::vector<double> top_;      // per path: of this and all earlier paths
  std::vector<Index> path_end_;  // per path: first point after it
};

}  // namespace curvesup
