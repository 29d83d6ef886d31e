#include <algorithm>
#include <cmath>
#include <limits>
#include <queue>

#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/skeleton/grow_skeleton.h"
#include "skeleton/point_grid.h"

namespace curvesup {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr double kSamplesPerSpacing = 4.0;

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

// A lattice of points strictly inside a triangle, neighbours at most `step` apart, also in needles: rows along the
// longest edge, each divided on its own.
template <typename Emit>
void sample_triangle(std::array<Vec3, 3> corner, double step, Emit&& emit) {
  int longest = 0;
  for (int e = 1; e < 3; ++e) {
    if ((corner[(e + 1) % 3] - corner[e]).squaredNorm() > (corner[(longest + 1) % 3] - corner[longest]).squaredNorm()) {
      longest = e;
    }
  }
  std::rotate(corner.begin(), corner.begin() + longest, corner.end());
  const double base = (corner[1] - corner[0]).norm();
  if (base <= 0.0) return;
  const double height = area_normal(corner[0], corner[1], corner[2]).norm() / base;
  const int rows = std::max(1, static_cast<int>(std::ceil(height / step)));
  for (int r = 0; r < rows; ++r) {
    const double t = (r + 0.5) / rows;
    const int columns = std::max(1, static_cast<int>(std::ceil(base * (1.0 - t) / step)));
    for (int c = 0; c < columns; ++c) {
      const double s = (c + 0.5) / columns * (1.0 - t);
      emit(Vec3((1.0 - s - t) * corner[0] + s * corner[1] + t * corner[2]));
    }
  }
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

// Squared distance that counts for coverage: across d_p at the sample, and as far along it at most.
double coverage_distance2(const LeafSite& sample, const Vec3& leaf) {
  const Vec3 offset = leaf - sample.position;
  const double along = offset.dot(sample.direction), along2 = along * along;
  return std::max(offset.squaredNorm() - along2, along2);
}

// Farthest-point-first choice among samples until all are within `spacing` of a leaf. The samples of one face stand
// together as a block; the queue holds one entry a block, so stale entries cost a short scan each.
class FarthestFirst {
 public:
  FarthestFirst(const std::vector<LeafSite>& samples, double spacing)
      : samples_(samples), positions_(positions(samples)), grid_(positions_, spacing), limit2_(spacing * spacing) {
    distance2_.assign(samples.size(), kInfinity);
    for (std::size_t s = 0; s < samples.size(); ++s) {
      if (s == 0 || samples[s].face != samples[s - 1].face) blocks_.push_back(static_cast<Index>(s));
    }
    blocks_.push_back(static_cast<Index>(samples.size()));
  }

  // A leaf is there: `reach` bounds the distance at which it can be the nearest.
  void place(const Vec3& leaf, double reach = kInfinity) {
    const auto relax = [&](Index s) { distance2_[s] = std::min(distance2_[s], coverage_distance2(samples_[s], leaf)); };
    if (reach == kInfinity) {
      for (Index s = 0; s < static_cast<Index>(samples_.size()); ++s) relax(s);
    } else {
      grid_.near(leaf, std::sqrt(2.0) * reach, relax);  // the distance is at least 1 / sqrt(2) of the Euclidean one
    }
  }

  // Ids of the samples that become leaves, in order.
  std::vector<Index> choose(const RunContext& run) {
    const auto nearer = [](const Entry& a, const Entry& b) {
      return a.distance2 != b.distance2 ? a.distance2 < b.distance2 : a.block > b.block;
    };
    std::priority_queue<Entry, std::vector<Entry>, decltype(nearer)> queue(nearer);
    for (Index b = 0; b + 1 < static_cast<Index>(blocks_.size()); ++b) queue.push(farthest(b));
    std::vector<Index> chosen;
    while (!queue.empty() && queue.top().distance2 > limit2_) {
      const Entry entry = queue.top();
      queue.pop();
      if (distance2_[entry.sample] == entry.distance2) {  // else a leaf came nearer since this entry was made
        chosen.push_back(entry.sample);
        place(samples_[entry.sample].position, std::sqrt(entry.distance2));
        if (chosen.size() % 256 == 0) run.check_stop();
      }
      queue.push(farthest(entry.block));
    }
    return chosen;
  }

 private:
  struct Entry {
    double distance2;
    Index block, sample;
  };
  [[nodiscard]] Entry farthest(Index block) const {
    const auto first = distance2_.begin() + blocks_[block], last = distance2_.begin() + blocks_[block + 1];
    const auto best = std::max_element(first, last);
    return {*best, block, static_cast<Index>(best - distance2_.begin())};
  }
  static std::vector<Vec3> positions(const std::vector<LeafSite>& samples) {
    std::vector<Vec3> result;
    for (const LeafSite& s : samples) result.push_back(s.position);
    return result;
  }
  const std::vector<LeafSite>& samples_;
  std::vector<Vec3> positions_;
  PointGrid grid_;
  double limit2_;
  std::vector<double> distance2_;
  std::vector<Index> blocks_;  // first sample of each block, and the end
};

}  // namespace

double effective_leaf_spacing(const SkeletonOptions& options) {
  return options.leaf_spacing_mm < 0.0 ? options.leaf_radius_mm + 0.5 * options.bead_width_mm : options.leaf_spacing_mm;
}

std::vector<LeafSite> place_leaves(const Model& model, const ScalarField& field, const Overhang& overhang,
                                   double spacing_mm, const RunContext& run) {
  const std::vector<Index> face = face_of_vertex(model, overhang);
  std::vector<LeafSite> leaves = vertex_sites(model, overhang.minima, overhang.minimum_direction, face);
  std::vector<LeafSite> samples = vertex_sites(model, overhang.vertices, overhang.vertex_direction, face);
  if (spacing_mm <= 0.0) {
    leaves.insert(leaves.end(), samples.begin(), samples.end());
    return leaves;
  }
  for (const Index f : overhang.faces) {
    const auto& v = model.boundary[f].vertices;
    const Vec3 direction = -print_direction(field, model.boundary[f].tet);
    sample_triangle({model.mesh.vertices[v[0]], model.mesh.vertices[v[1]], model.mesh.vertices[v[2]]},
                    spacing_mm / kSamplesPerSpacing, [&](const Vec3& p) {
                      samples.push_back({p, direction, f, kNone});
                    });
  }
  std::stable_sort(samples.begin(), samples.end(),
                   [](const LeafSite& a, const LeafSite& b) { return a.face < b.face; });
  FarthestFirst search(samples, spacing_mm);
  for (const LeafSite& leaf : leaves) search.place(leaf.position);
  for (const Index s : search.choose(run)) leaves.push_back(samples[s]);
  return leaves;
}

}  // namespace curvesup
