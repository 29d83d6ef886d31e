#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "check/support_parts.h"
#include "curvesup/mesh/triangle_tree.h"

namespace curvesup::certificate {

namespace {

constexpr double kOnSurface = 1e-3;     // mm: two things this near touch
constexpr double kInsideLength = 1e-2;  // mm of an edge that may lie in the model before it counts as running through

Index size_of(const auto& container) { return static_cast<Index>(container.size()); }

// Barycentric coordinates of p in a tet.
std::array<double, 4> barycentric(const TetMesh& mesh, Index tet, const Vec3& p) {
  const auto& t = mesh.tets[tet];
  const Vec3 &a = mesh.vertices[t[0]], &b = mesh.vertices[t[1]], &c = mesh.vertices[t[2]], &d = mesh.vertices[t[3]];
  const double all = tet_volume(a, b, c, d);
  return {tet_volume(p, b, c, d) / all, tet_volume(a, p, c, d) / all, tet_volume(a, b, p, d) / all,
          tet_volume(a, b, c, p) / all};
}

// Which tet a point lies in: tets by cell of a grid, every candidate tried.
class TetFinder {
 public:
  explicit TetFinder(const Domain& domain) : mesh_(domain.mesh) {
    Vec3 low = Vec3::Constant(std::numeric_limits<double>::max()), high = -low;
    for (const auto& tet : mesh_.tets) {
      for (const Index v : tet) {
        low = low.cwiseMin(mesh_.vertices[v]);
        high = high.cwiseMax(mesh_.vertices[v]);
      }
    }
    const double cell =
        std::cbrt((high - low).prod() / std::max<double>(1.0, static_cast<double>(mesh_.tets.size()) / 2));
    grid_ = CellGrid(low, high, std::max(cell, 1e-6));
    const auto for_each_entry = [&](const auto& use) {
      for (Index t = 0; t < size_of(mesh_.tets); ++t) {
        const auto& v = mesh_.tets[t];
        const Vec3 a = mesh_.vertices[v[0]]
                           .cwiseMin(mesh_.vertices[v[1]])
                           .cwiseMin(mesh_.vertices[v[2]])
                           .cwiseMin(mesh_.vertices[v[3]]);
        const Vec3 b = mesh_.vertices[v[0]]
                           .cwiseMax(mesh_.vertices[v[1]])
                           .cwiseMax(mesh_.vertices[v[2]])
                           .cwiseMax(mesh_.vertices[v[3]]);
        grid_.visit(a, b, [&](std::size_t cell_index) {
          use(cell_index, t);
          return false;
        });
      }
    };
    first_.assign(grid_.cells() + 1, 0);
    for_each_entry([&](std::size_t c, Index) { ++first_[c + 1]; });
    for (std::size_t c = 0; c < grid_.cells(); ++c) first_[c + 1] += first_[c];
    entries_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for_each_entry([&](std::size_t c, Index t) { entries_[next[c]++] = t; });
  }

  // Calls visit(tet) for all tets that hold p, those that it lies on the border of included.
  void containing(const Vec3& p, const auto& visit) const {
    const std::size_t cell = grid_.index(grid_.cell_of(p));
    for (std::size_t i = first_[cell]; i < first_[cell + 1]; ++i) {
      if (holds(entries_[i], p)) visit(entries_[i]);
    }
  }
  // The lowest of them; kNone outside of the domain.
  [[nodiscard]] Index find(const Vec3& p) const {
    Index found = kNone;
    containing(p, [&](Index t) { found = found == kNone ? t : std::min(found, t); });
    return found;
  }

 private:
  // All four coordinates from -1e-9 on; most tets are out of question after the first.
  [[nodiscard]] bool holds(Index tet, const Vec3& p) const {
    const auto& t = mesh_.tets[tet];
    const std::array<Vec3, 4> c = {mesh_.vertices[t[0]], mesh_.vertices[t[1]], mesh_.vertices[t[2]], mesh_.vertices[t[3]]};
    const double least = -1e-9 * (c[1] - c[0]).cross(c[2] - c[0]).dot(c[3] - c[0]);
    return std::all_of(kTetFace.begin(), kTetFace.end(), [&](const auto& face) {
      const Vec3& a = c[face[0]];
      return (c[face[1]] - a).cross(c[face[2]] - a).dot(a - p) >= least;
    });
  }

  const TetMesh& mesh_;
  CellGrid grid_;
  std::vector<std::size_t> first_;
  std::vector<Index> entries_;
};

class SkeletonProof {
 public:
  SkeletonProof(const Subject& subject, const Skeleton& skeleton, SupportCertificate& certificate)
      : subject_(subject), skeleton_(skeleton), certificate_(certificate), finder_(subject.domain) {
    surface_.vertices = subject.model.mesh.vertices;
    for (const auto& face : subject.model.boundary) surface_.triangles.push_back(face.vertices);
    tree_ = TriangleTree(surface_);
  }

  void run() {
    for (Index e = 0; e < size_of(skeleton_.edges); ++e) {
      if (e % 1024 == 0) subject_.run.check_stop();
      check_angle(e);
      check_outside(e);
    }
    link();
    check_leaves();
    check_counts();
    check_ends();
  }

 private:
  const SkeletonNode& node(Index n) const { return skeleton_.nodes[n]; }
  bool is_end(Index n) const { return node(n).kind == NodeKind::platform_end || node(n).kind == NodeKind::model_end; }

  // Angle at the upper end, against -grad G of the tet entered. Where the edge starts on a border between tets and runs
  // along it, several tets are entered; the smallest angle counts.
  void check_angle(Index e) {
    const auto& edge = skeleton_.edges[e];
    const Vec3 along = node(edge.lower).position - node(edge.upper).position;
    const double length = along.norm();
    double angle = std::numbers::pi;
    if (length > 0.0) {
      const Vec3 unit = along / length;
      finder_.containing(node(edge.upper).position + std::min(1e-5, 0.5 * length) * unit, [&](Index tet) {
        const Vec3 down = -subject_.direction(tet);
        angle = std::min(angle, std::atan2(unit.cross(down).norm(), unit.dot(down)));
      });
    }
    const double degrees = Angle::radians(angle).degrees();
    certificate_.max_edge_angle_deg = std::max(certificate_.max_edge_angle_deg, degrees);
    if (degrees > subject_.options.self_support.degrees() + 0.1) certificate_.steep_edges.push_back(e);
  }

  // The edge is cut where it meets the model's surface; a part whose middle lies in a tet of the model is inside.
  void check_outside(Index e) {
    const auto& edge = skeleton_.edges[e];
    const Vec3& from = node(edge.upper).position;
    const Vec3 along = node(edge.lower).position - from;
    const double length = along.norm();
    if (!(length > 0.0)) return;
    double inside = 0.0, begin = 0.0;
    const double step = std::min(1.0, 1e-6 / length);
    while (begin < 1.0) {
      const auto hit = tree_.first_hit(from, along, begin + step, 1.0);
      const double end = hit ? hit->t : 1.0;
      if ((end - begin) * length > kOnSurface) {
        const Index tet = finder_.find(from + 0.5 * (begin + end) * along);
        if (tet != kNone && tet < subject_.domain.model_tets) inside += (end - begin) * length;
      }
      if (!hit) break;
      begin = end;
    }
    if (inside > kInsideLength) certificate_.edges_through_model.push_back(e);
  }

  // Outgoing edge of each node; more than one is an error of the counts.
  void link() {
    down_.assign(skeleton_.nodes.size(), kNone);
    branching_down_.assign(skeleton_.nodes.size(), 0);
    for (Index e = 0; e < size_of(skeleton_.edges); ++e) {
      Index& slot = down_[skeleton_.edges[e].upper];
      if (slot != kNone) branching_down_[skeleton_.edges[e].upper] = 1;
      slot = e;
    }
  }

  // Follows each leaf down; nodes passed keep the end they lead to, so that every edge is walked once.
  void check_leaves() {
    constexpr Index kUnknown = -2, kNowhere = -1, kOnTheWay = -3;
    end_of_.assign(skeleton_.nodes.size(), kUnknown);
    std::vector<Index> way;
    for (Index n = 0; n < size_of(skeleton_.nodes); ++n) {
      if (node(n).kind != NodeKind::leaf) continue;
      ++certificate_.leaves;
      way.clear();
      Index at = n;
      while (end_of_[at] == kUnknown && !is_end(at) && down_[at] != kNone) {
        end_of_[at] = kOnTheWay;
        way.push_back(at);
        at = skeleton_.edges[down_[at]].lower;
      }
      Index end = end_of_[at];
      if (is_end(at))
        end = at;
      else if (end == kUnknown || end == kOnTheWay)
        end = kNowhere;  // stops in the air, or runs in a circle
      for (const Index passed : way) end_of_[passed] = end;
      if (end == kNowhere) certificate_.ungrounded_leaves.push_back(n);
    }
  }

  void check_counts() {
    std::vector<Index> arriving(skeleton_.nodes.size(), 0);
    for (const auto& edge : skeleton_.edges) arriving[edge.lower] += edge.branch_count;
    for (Index n = 0; n < size_of(skeleton_.nodes); ++n) {
      const Index leaving = down_[n] == kNone ? 0 : skeleton_.edges[down_[n]].branch_count;
      const bool leaf = node(n).kind == NodeKind::leaf;
      if (is_end(n)) certificate_.leaf_count_at_ends += arriving[n];
      const bool adds_up = is_end(n) ? down_[n] == kNone && arriving[n] > 0 : leaving == arriving[n] + (leaf ? 1 : 0);
      if (!adds_up || branching_down_[n] || (leaf && arriving[n] > 0)) certificate_.miscounted_nodes.push_back(n);
    }
  }

  [[nodiscard]] double field_at(const Vec3& p) const {
    const Index tet = finder_.find(p);
    if (tet == kNone) return std::numeric_limits<double>::quiet_NaN();
    const auto weight = barycentric(subject_.domain.mesh, tet, p);
    double sum = 0.0;
    for (int i = 0; i < 4; ++i) sum += weight[i] * subject_.field.value[subject_.domain.mesh.tets[tet][i]];
    return sum;
  }

  // A model end lies on the model, on a face that looks along d_p (on an edge one of the faces is enough).
  [[nodiscard]] bool stands_on_model(const Vec3& p) const {
    bool found = false;
    const Vec3 around = Vec3::Constant(kOnSurface);
    tree_.overlapping(p - around, p + around, [&](Index f) {
      const auto& t = surface_.triangles[f];
      const Vec3 &a = surface_.vertices[t[0]], &b = surface_.vertices[t[1]], &c = surface_.vertices[t[2]];
      if ((closest_point_on_triangle(p, a, b, c) - p).norm() > kOnSurface) return;
      found = found || area_normal(a, b, c).dot(subject_.direction(subject_.model.boundary[f].tet)) > 0.0;
    });
    return found;
  }

  void check_ends() {
    std::vector<double> lowest_leaf(skeleton_.nodes.size(), std::numeric_limits<double>::max());
    for (Index n = 0; n < size_of(skeleton_.nodes); ++n) {
      if (node(n).kind != NodeKind::leaf || end_of_[n] < 0 || node(end_of_[n]).kind != NodeKind::model_end) continue;
      lowest_leaf[end_of_[n]] = std::min(lowest_leaf[end_of_[n]], field_at(node(n).position));
    }
    for (Index n = 0; n < size_of(skeleton_.nodes); ++n) {
      const Vec3& p = node(n).position;
      if (node(n).kind == NodeKind::platform_end && !(std::abs(p.z()) <= 1e-6)) certificate_.bad_ends.push_back(n);
      if (node(n).kind != NodeKind::model_end) continue;
      const double layers = (lowest_leaf[n] - field_at(p)) * subject_.printed.count;
      if (!stands_on_model(p) || !(layers >= 1.0 - 1e-6)) certificate_.bad_ends.push_back(n);
    }
  }

  const Subject& subject_;
  const Skeleton& skeleton_;
  SupportCertificate& certificate_;
  TetFinder finder_;
  TriangleMesh surface_;
  TriangleTree tree_;
  std::vector<Index> down_, end_of_;
  std::vector<char> branching_down_;
};

}  // namespace

void prove_skeleton(const Subject& subject, const Skeleton& skeleton, SupportCertificate& certificate) {
  SkeletonProof(subject, skeleton, certificate).run();
}

}  // namespace curvesup::certificate
