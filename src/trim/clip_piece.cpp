#include "trim/clip_piece.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "core/disjoint_sets.h"
#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup {
namespace {

constexpr double kLongestEdge_mm = 0.25;
constexpr double kLeastResting = 0.45;  // of what stays; the certificate asks for less, at other points
constexpr double kShorter = 0.8;        // reaches that are tried one after the other
constexpr int kReaches = 12;
constexpr double kOnVertex = 1e-3;      // of an edge: a cut so near to its end goes through the end

class PieceClipper {
 public:
  PieceClipper(TrimmedSheet& sheet, Index piece, const RestsThere& rests, double min_area)
      : sheet_(sheet), piece_(piece), rests_(rests), min_area_(min_area) {}

  bool run(std::vector<std::array<Vec3, 3>>& gone) {
    collect();
    find_resting();
    double reach = sheet_.pieces[piece_].thickness_p95 / sheet_.head.passes;
    for (int i = 0; i < kReaches; ++i, reach *= kShorter) {
      cut(reach);
      keep_pieces_that_rest();
      if (kept_.empty()) continue;
      store(gone);
      return true;
    }
    return false;
  }

 private:
  struct Part {
    std::array<Index, 3> corners;  // of vertices_
    Index tet;
    Index piece = kNone;
    bool rests = false;
  };

  // The piece's triangles, small enough.
  void collect() {
    std::map<Index, Index> own;
    for (std::size_t i = 0; i < sheet_.triangles.size(); ++i) {
      if (sheet_.triangle_piece[i] != piece_) continue;
      std::array<Index, 3> t = sheet_.triangles[i];
      for (Index& v : t) {
        const auto [at, fresh] = own.try_emplace(v, static_cast<Index>(vertices_.size()));
        if (fresh) vertices_.push_back(sheet_.vertices[v]), in_sheet_.push_back(v);
        v = at->second;
      }
      halve({t, sheet_.triangle_tet[i]});
    }
  }

  // An edge is halved or not by its length alone, so by the triangles on both of its sides.
  void halve(const Part& part) {
    const auto squared = [&](int c) { return (vertices_[part.corners[c]] - vertices_[part.corners[(c + 1) % 3]]).squaredNorm(); };
    int longest = 0;
    for (int c = 1; c < 3; ++c) longest = squared(c) > squared(longest) ? c : longest;
    if (squared(longest) <= kLongestEdge_mm * kLongestEdge_mm) return small_.push_back(part);
    const Index a = part.corners[longest], b = part.corners[(longest + 1) % 3], c = part.corners[(longest + 2) % 3];
    const Index middle = on_edge(middles_, a, b, 0.5);
    halve({{a, middle, c}, part.tet});
    halve({{middle, b, c}, part.tet});
  }

  using OnEdges = std::map<std::pair<Index, Index>, Index>;
  Index on_edge(OnEdges& known, Index a, Index b, double part) {
    const auto [at, fresh] = known.try_emplace(std::minmax(a, b), static_cast<Index>(vertices_.size()));
    if (fresh) {
      vertices_.push_back(vertices_[a] + part * (vertices_[b] - vertices_[a]));
      in_sheet_.push_back(kNone);
    }
    return at->second;
  }

  // Which triangles rest, by their middles, and how far each vertex is from the nearest of those.
  void find_resting() {
    std::vector<Vec3> resting;
    for (Part& part : small_) {
      const Vec3 middle = (vertices_[part.corners[0]] + vertices_[part.corners[1]] + vertices_[part.corners[2]]) / 3.0;
      part.rests = rests_(part.tet, middle);
      if (part.rests) resting.push_back(middle);
    }
    away_.assign(vertices_.size(), std::numeric_limits<double>::infinity());
    for (std::size_t v = 0; v < vertices_.size(); ++v) {
      for (const Vec3& p : resting) away_[v] = std::min(away_[v], (vertices_[v] - p).norm());
    }
    whole_ = vertices_.size();
  }

  // Keeps the parts of the triangles that are nearer than `reach` to what rests.
  void cut(double reach) {
    vertices_.resize(whole_);
    in_sheet_.resize(whole_);
    kept_.clear();
    cut_away_.clear();
    OnEdges cuts;
    for (const Part& part : small_) {
      // Corners and cuts of its border, those that stay and those that go.
      std::vector<Index> stays, goes;
      for (int c = 0; c < 3; ++c) {
        const Index a = part.corners[c], b = part.corners[(c + 1) % 3];
        const bool near_a = away_[a] < reach, near_b = away_[b] < reach;
        (near_a ? stays : goes).push_back(a);
        if (near_a == near_b) continue;
        const Index low = std::min(a, b), high = std::max(a, b);
        // No place is farther off than what rests next to it: the distance of a far corner counts to there.
        const double from = std::min(away_[low], reach + kLongestEdge_mm), to = std::min(away_[high], reach + kLongestEdge_mm);
        const Index between = on_edge(cuts, low, high, std::clamp((reach - from) / (to - from), kOnVertex, 1.0 - kOnVertex));
        stays.push_back(between);
        goes.push_back(between);
      }
      add_fan(stays, part, kept_);
      add_fan(goes, part, cut_away_);
    }
  }
  static void add_fan(const std::vector<Index>& ring, const Part& of, std::vector<Part>& parts) {
    for (std::size_t i = 2; i < ring.size(); ++i) parts.push_back({{ring[0], ring[i - 1], ring[i]}, of.tet, kNone, of.rests});
  }

  [[nodiscard]] double area(const Part& part) const {
    return triangle_area(vertices_[part.corners[0]], vertices_[part.corners[1]], vertices_[part.corners[2]]);
  }

  // Of what would stay, pieces that are too small or rest too little go, too.
  void keep_pieces_that_rest() {
    DisjointSets sets(kept_.size());
    std::map<std::pair<Index, Index>, Index> sides;
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      for (int c = 0; c < 3; ++c) {
        const auto [at, fresh] = sides.try_emplace(std::minmax(kept_[i].corners[c], kept_[i].corners[(c + 1) % 3]), static_cast<Index>(i));
        if (!fresh) sets.join(static_cast<Index>(i), at->second);
      }
    }
    std::vector<double> whole(kept_.size(), 0.0), resting(kept_.size(), 0.0);
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      const Index root = sets.root(static_cast<Index>(i));
      whole[root] += area(kept_[i]);
      if (kept_[i].rests) resting[root] += area(kept_[i]);
    }
    std::vector<Index> number(kept_.size(), kNone);
    Index next = static_cast<Index>(sheet_.pieces.size());
    std::vector<Part> stay;
    for (std::size_t i = 0; i < kept_.size(); ++i) {
      const Index root = sets.root(static_cast<Index>(i));
      if (whole[root] < min_area_ || resting[root] < kLeastResting * whole[root]) {
        cut_away_.push_back(kept_[i]);
        continue;
      }
      if (number[root] == kNone) number[root] = next++;
      stay.push_back(kept_[i]);
      stay.back().piece = number[root];
    }
    kept_ = std::move(stay);
  }

  void store(std::vector<std::array<Vec3, 3>>& gone) {
    for (const Part& part : cut_away_) gone.push_back({vertices_[part.corners[0]], vertices_[part.corners[1]], vertices_[part.corners[2]]});
    const Piece old = sheet_.pieces[piece_];
    std::vector<char> keep(sheet_.pieces.size(), 1);
    keep[piece_] = 0;
    keep_pieces(sheet_, keep);
    for (const Part& part : kept_) {
      if (part.piece == static_cast<Index>(sheet_.pieces.size())) sheet_.pieces.push_back({.thickness_p95 = old.thickness_p95});
      Piece& piece = sheet_.pieces[part.piece];
      std::array<Index, 3> t = part.corners;
      for (Index& v : t) v = sheet_vertex(v);
      sheet_.triangles.push_back(t);
      sheet_.triangle_tet.push_back(part.tet);
      sheet_.triangle_piece.push_back(part.piece);
      piece.area += area(part);
      piece.centroid += area(part) / 3.0 * (vertices_[part.corners[0]] + vertices_[part.corners[1]] + vertices_[part.corners[2]]);
    }
    for (std::size_t p = keep.size(); p < sheet_.pieces.size(); ++p) sheet_.pieces[p].centroid /= sheet_.pieces[p].area;
  }

  Index sheet_vertex(Index v) {
    if (in_sheet_[v] == kNone) {
      in_sheet_[v] = static_cast<Index>(sheet_.vertices.size());
      sheet_.vertices.push_back(vertices_[v]);
      sheet_.source.push_back(kNone);
    }
    return in_sheet_[v];
  }

  TrimmedSheet& sheet_;
  Index piece_;
  const RestsThere& rests_;
  double min_area_;
  std::vector<Vec3> vertices_;
  std::vector<Index> in_sheet_;  // the vertex of the sheet that each one is, if any
  OnEdges middles_;
  std::vector<Part> small_;
  std::vector<double> away_;  // of each vertex, from the nearest triangle that rests
  std::size_t whole_ = 0;     // vertices before cuts
  std::vector<Part> kept_, cut_away_;
};

}  // namespace

bool clip_piece(TrimmedSheet& sheet, Index piece, const RestsThere& rests, double min_area_mm2,
                std::vector<std::array<Vec3, 3>>& gone) {
  return PieceClipper(sheet, piece, rests, min_area_mm2).run(gone);
}

}  // namespace curvesup
