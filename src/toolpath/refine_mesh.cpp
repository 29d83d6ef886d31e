#include "toolpath/refine_mesh.h"

#include <algorithm>
#include <array>
#include <tuple>

namespace curvesup::toolpath {
namespace {

class MeshRefiner {
 public:
  MeshRefiner(PieceMesh& mesh, EdgeTable& edges, bool border, int most_cuts, const std::function<Index(Index, Index)>& cut)
      : mesh_(mesh), table_(edges), border_(border), most_cuts_(most_cuts), cut_(cut) {}

  bool run() {
    edges_.reserve(3 * table_.edges.size());
    for (const Edge& e : table_.edges) {
      edges_.push_back({.from = e.from, .to = e.to, .middle = e.right == kNone && !border_ ? kNone : kUnknown});
    }
    for (auto* values : {&thickness_, &rise_}) values->reserve(2 * mesh_.triangles.size());
    for (auto* rows : {&triangles_, &edges_of_}) rows->reserve(2 * mesh_.triangles.size());
    const std::size_t before = mesh_.vertices.size();
    // Each triangle is cut to the end before the next one.
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      parts_.assign(1, {mesh_.triangles[t], table_.of_triangle[t]});
      while (!parts_.empty()) {
        const Part part = parts_.back();
        parts_.pop_back();
        divide(part, t);
      }
    }
    if (mesh_.vertices.size() == before) return false;
    store();
    return true;
  }

 private:
  static constexpr Index kUnknown = -2;
  struct Halved {
    Index from, to;
    int generation = 0;
    Index middle = kUnknown;
    Index first_half = kNone;  // from `from`; the other one, to `to`, comes next
  };
  // Edge i runs from corner i to the next one.
  struct Part {
    std::array<Index, 3> corners, edges;
  };

  Index middle_of(Index e) {
    const auto [from, to, generation, known, first_half] = edges_[e];
    if (known != kUnknown) return known;
    const Index middle = generation < most_cuts_ ? cut_(from, to) : kNone;
    edges_[e].middle = middle;
    if (middle != kNone) {
      edges_[e].first_half = static_cast<Index>(edges_.size());
      edges_.push_back({.from = from, .to = middle, .generation = generation + 1});
      edges_.push_back({.from = middle, .to = to, .generation = generation + 1});
    }
    return middle;
  }

  [[nodiscard]] Index half_at(Index e, Index corner) const { return edges_[e].first_half + (edges_[e].from == corner ? 0 : 1); }

  Index new_edge(Index from, Index to) {
    edges_.push_back({.from = from, .to = to, .generation = inner_generation_});
    return static_cast<Index>(edges_.size()) - 1;
  }

  // Keeps a part of triangle t, or puts its own parts in its place.
  void divide(const Part& part, std::size_t t) {
    std::array<Index, 3> cut;
    int count = 0;
    inner_generation_ = 0;
    for (int i = 0; i < 3; ++i) {
      cut[i] = middle_of(part.edges[i]);
      if (cut[i] == kNone) continue;
      ++count;
      inner_generation_ = std::max(inner_generation_, edges_[part.edges[i]].generation + 1);
    }
    if (count == 0) return keep(part, t);
    if (count == 1) return divide_in_two(part, cut);
    if (count == 2) return divide_in_three(part, cut);
    divide_in_four(part, cut);
  }

  void keep(const Part& part, std::size_t t) {
    triangles_.push_back(part.corners);
    edges_of_.push_back(part.edges);
    thickness_.push_back(mesh_.thickness[t]);
    rise_.push_back(mesh_.rise[t]);
  }

  void divide_in_two(const Part& part, const std::array<Index, 3>& cut) {
    const auto& [corner, edge] = part;
    int i = 0;
    while (cut[i] == kNone) ++i;
    const Index a = corner[i], b = corner[next3(i)], c = corner[prev3(i)], inner = new_edge(cut[i], c);
    parts_.push_back({{a, cut[i], c}, {half_at(edge[i], a), inner, edge[prev3(i)]}});
    parts_.push_back({{cut[i], b, c}, {half_at(edge[i], b), edge[next3(i)], inner}});
  }

  // Edges i and i + 1 are cut: corner i + 1 goes, a quadrilateral stays and is cut along its shorter diagonal.
  void divide_in_three(const Part& part, const std::array<Index, 3>& cut) {
    const auto& [corner, edge] = part;
    int i = 0;
    while (cut[i] == kNone || cut[next3(i)] == kNone) ++i;
    const Index a = corner[i], b = corner[next3(i)], c = corner[prev3(i)], ab = cut[i], bc = cut[next3(i)];
    const Index across = new_edge(ab, bc);
    const Index at_a = half_at(edge[i], a), at_c = half_at(edge[next3(i)], c), ca = edge[prev3(i)];
    parts_.push_back({{ab, b, bc}, {half_at(edge[i], b), half_at(edge[next3(i)], b), across}});
    if ((mesh_.vertices[a] - mesh_.vertices[bc]).squaredNorm() <= (mesh_.vertices[ab] - mesh_.vertices[c]).squaredNorm()) {
      const Index diagonal = new_edge(a, bc);
      parts_.push_back({{a, ab, bc}, {at_a, across, diagonal}});
      parts_.push_back({{a, bc, c}, {diagonal, at_c, ca}});
    } else {
      const Index diagonal = new_edge(ab, c);
      parts_.push_back({{a, ab, c}, {at_a, diagonal, ca}});
      parts_.push_back({{ab, bc, c}, {across, at_c, diagonal}});
    }
  }

  void divide_in_four(const Part& part, const std::array<Index, 3>& cut) {
    const auto& [corner, edge] = part;
    std::array<Index, 3> inner;  // cuts off corner i
    for (int i = 0; i < 3; ++i) {
      inner[i] = new_edge(cut[i], cut[prev3(i)]);
      parts_.push_back({{corner[i], cut[i], cut[prev3(i)]}, {half_at(edge[i], corner[i]), inner[i], half_at(edge[prev3(i)], corner[i])}});
    }
    parts_.push_back({cut, {inner[1], inner[2], inner[0]}});
  }

  // Puts edges that were not cut, and the triangles, into the mesh.
  void store() {
    table_.edges.clear();
    std::vector<Index> number(edges_.size(), kNone);
    for (std::size_t e = 0; e < edges_.size(); ++e) {
      if (edges_[e].middle != kNone) continue;
      number[e] = static_cast<Index>(table_.edges.size());
      table_.edges.push_back({.from = edges_[e].from, .to = edges_[e].to});
    }
    mesh_.neighbours.assign(triangles_.size(), {kNone, kNone, kNone});
    for (std::size_t t = 0; t < triangles_.size(); ++t) {
      for (int i = 0; i < 3; ++i) {
        const Index e = edges_of_[t][i] = number[edges_of_[t][i]];
        Edge& edge = table_.edges[e];
        const auto [here, across] = edge.from == triangles_[t][i] ? std::tie(edge.left, edge.right) : std::tie(edge.right, edge.left);
        here = static_cast<Index>(t);
        if (across == kNone) continue;
        const auto& others = edges_of_[across];
        mesh_.neighbours[t][i] = across;
        mesh_.neighbours[across][std::find(others.begin(), others.end(), e) - others.begin()] = static_cast<Index>(t);
      }
    }
    table_.of_triangle = std::move(edges_of_);
    mesh_.triangles = std::move(triangles_);
    mesh_.thickness = std::move(thickness_);
    mesh_.rise = std::move(rise_);
  }

  PieceMesh& mesh_;
  EdgeTable& table_;
  bool border_;
  int most_cuts_;
  const std::function<Index(Index, Index)>& cut_;
  std::vector<Halved> edges_;
  std::vector<Part> parts_;  // of one triangle, still to be looked at
  int inner_generation_ = 0;  // of the edges inside the part that is divided
  std::vector<std::array<Index, 3>> triangles_, edges_of_;
  std::vector<double> thickness_, rise_;
};

}  // namespace

bool refine_mesh(PieceMesh& mesh, EdgeTable& edges, bool border, int most_cuts, const std::function<Index(Index, Index)>& cut) {
  return MeshRefiner(mesh, edges, border, most_cuts, cut).run();
}

}  // namespace curvesup::toolpath
