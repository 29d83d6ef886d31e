#include "toolpath/piece_mesh.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup::toolpath {
namespace {

struct HalfEdge {
  Index other = kNone;  // the larger vertex
  Index triangle = kNone;
  std::int8_t edge = 0;
  bool ascending = false;
};

// Across edge i of each triangle lies which one: pairs the edges that run in opposite directions between the same vertices.
// An edge that more than two triangles use, or two in the same direction, is a border of each. Vertices are ids below
// vertex_count. O(triangles).
std::vector<std::array<Index, 3>> pair_edges(const std::vector<std::array<Index, 3>>& triangles, Index vertex_count) {
  std::vector<Index> first(vertex_count + 1, 0);
  for (const auto& t : triangles) {
    for (int i = 0; i < 3; ++i) ++first[std::min(t[i], t[next3(i)]) + 1];
  }
  for (Index v = 0; v < vertex_count; ++v) first[v + 1] += first[v];
  std::vector<HalfEdge> half(3 * triangles.size());
  std::vector<Index> fill(first.begin(), first.end() - 1);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    for (int i = 0; i < 3; ++i) {
      const Index a = triangles[t][i], b = triangles[t][next3(i)];
      half[fill[std::min(a, b)]++] = {std::max(a, b), static_cast<Index>(t), static_cast<std::int8_t>(i), a < b};
    }
  }
  std::vector<std::array<Index, 3>> neighbours(triangles.size(), {kNone, kNone, kNone});
  for (Index v = 0; v < vertex_count; ++v) {
    const auto begin = half.begin() + first[v], end = half.begin() + first[v + 1];
    std::sort(begin, end, [](const HalfEdge& x, const HalfEdge& y) {
      return x.other != y.other ? x.other < y.other : x.triangle < y.triangle;
    });
    for (auto run = begin; run != end;) {
      auto stop = run;
      while (stop != end && stop->other == run->other) ++stop;
      if (stop - run == 2 && run->ascending != run[1].ascending && run->triangle != run[1].triangle) {
        neighbours[run->triangle][run->edge] = run[1].triangle;
        neighbours[run[1].triangle][run[1].edge] = run->triangle;
      }
      run = stop;
    }
  }
  return neighbours;
}

constexpr int kSmoothings = 3;  // each evens out what changes from triangle to triangle: the gradient is constant in a tet

// Values at the vertices: means over the triangles around, by area; then, each time, of the means over their corners.
void set_vertex_values(PieceMesh& mesh, std::vector<Vec3> direction) {
  const std::size_t n = mesh.vertices.size();
  std::vector<double> area(mesh.triangles.size()), offset(mesh.triangles.size()), weight(n, 0.0);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    area[t] = triangle_area(mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]);
    mesh.area += area[t];
    area[t] += 1e-12;
    offset[t] = 0.5 * mesh.thickness[t];
    for (const Index v : mesh.triangles[t]) weight[v] += area[t];
  }
  for (int round = 0; round < kSmoothings; ++round) {
    mesh.normals.assign(n, Vec3::Zero());
    mesh.tip_offset.assign(n, 0.0);
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      for (const Index v : mesh.triangles[t]) {
        mesh.normals[v] += area[t] * direction[t];
        mesh.tip_offset[v] += area[t] * offset[t];
      }
    }
    for (std::size_t v = 0; v < n; ++v) {
      const double length = mesh.normals[v].norm();
      mesh.normals[v] = length > 0.0 ? Vec3(mesh.normals[v] / length) : Vec3::UnitZ();
      mesh.tip_offset[v] /= weight[v];
    }
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      const auto& [a, b, c] = mesh.triangles[t];
      direction[t] = (mesh.normals[a] + mesh.normals[b] + mesh.normals[c]) / 3.0;
      offset[t] = (mesh.tip_offset[a] + mesh.tip_offset[b] + mesh.tip_offset[c]) / 3.0;
    }
  }
}

}  // namespace

int edge_with_end(const PieceMesh& mesh, Index triangle, Index from, Index to) {
  const auto& corners = mesh.triangles[triangle];
  for (int i = 0; i < 3; ++i) {
    if (corners[i] == from && corners[next3(i)] == to) return i;
  }
  return -1;
}

EdgeTable make_edges(const PieceMesh& mesh) {
  EdgeTable table;
  table.of_triangle.assign(mesh.triangles.size(), {kNone, kNone, kNone});
  table.edges.reserve(mesh.triangles.size() * 3 / 2 + mesh.triangles.size() / 4);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    for (int i = 0; i < 3; ++i) {
      if (table.of_triangle[t][i] != kNone) continue;
      const Index from = mesh.triangles[t][i], to = mesh.triangles[t][next3(i)];
      const Index id = static_cast<Index>(table.edges.size()), right = mesh.neighbours[t][i];
      table.edges.push_back({from, to, static_cast<Index>(t), right});
      table.of_triangle[t][i] = id;
      if (right != kNone) table.of_triangle[right][edge_with_end(mesh, right, to, from)] = id;
    }
  }
  return table;
}

namespace {

// The triangles of a sheet with three different corners; vertices are numbered densely, in ascending order.
struct SheetTriangles {
  std::vector<Index> kept, vertices;  // of the stack
  std::vector<std::array<Index, 3>> triangles, neighbours;
};

SheetTriangles triangles_of(const LayerStack& stack, const Sheet& sheet) {
  SheetTriangles result;
  // The ids of one sheet lie close together.
  Index low = std::numeric_limits<Index>::max(), high = -1;
  for (Index t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) {
    const auto& [a, b, c] = stack.triangles[t];
    if (a == b || b == c || c == a) continue;
    result.kept.push_back(t);
    low = std::min({low, a, b, c});
    high = std::max({high, a, b, c});
  }
  std::vector<Index> number(result.kept.empty() ? 0 : high - low + 1, kNone);
  for (const Index t : result.kept) {
    for (const Index v : stack.triangles[t]) number[v - low] = 0;
  }
  for (std::size_t i = 0; i < number.size(); ++i) {
    if (number[i] == kNone) continue;
    number[i] = static_cast<Index>(result.vertices.size());
    result.vertices.push_back(low + static_cast<Index>(i));
  }
  result.triangles.resize(result.kept.size());
  for (std::size_t t = 0; t < result.kept.size(); ++t) {
    for (int i = 0; i < 3; ++i) result.triangles[t][i] = number[stack.triangles[result.kept[t]][i] - low];
  }
  result.neighbours = pair_edges(result.triangles, static_cast<Index>(result.vertices.size()));
  return result;
}

class PieceSplitter {
 public:
  PieceSplitter(const LayerStack& stack, const Sheet& sheet, std::span<const Vec3> triangle_gradient)
      : stack_(stack), sheet_(sheet), gradient_(triangle_gradient), of_(triangles_of(stack, sheet)),
        piece_triangle_(of_.triangles.size(), kNone), corner_vertex_(of_.triangles.size(), {kNone, kNone, kNone}),
        seen_(of_.triangles.size(), 0) {}

  std::vector<PieceMesh> run() {
    std::vector<PieceMesh> pieces;
    for (std::size_t seed = 0; seed < seen_.size(); ++seed) {
      if (!seen_[seed]) pieces.push_back(piece(members_from(static_cast<Index>(seed))));
    }
    return pieces;
  }

 private:
  // The triangles of the piece that a triangle belongs to, ascending.
  std::vector<Index> members_from(Index seed) {
    std::vector<Index> members(1, seed);
    seen_[seed] = 1;
    for (std::size_t head = 0; head < members.size(); ++head) {
      for (const Index n : of_.neighbours[members[head]]) {
        if (n == kNone || seen_[n]) continue;
        seen_[n] = 1;
        members.push_back(n);
      }
    }
    std::sort(members.begin(), members.end());
    return members;
  }

  PieceMesh piece(const std::vector<Index>& members) {
    PieceMesh piece;
    std::vector<Vec3> direction;
    for (auto* values : {&piece.thickness, &piece.rise}) values->reserve(members.size());
    for (auto* rows : {&piece.triangles, &piece.neighbours}) rows->reserve(members.size());
    direction.reserve(members.size());
    for (std::size_t m = 0; m < members.size(); ++m) {
      const Index t = members[m];
      piece_triangle_[t] = static_cast<Index>(m);
      for (int i = 0; i < 3; ++i) {
        if (corner_vertex_[t][i] == kNone) number_fan(t, i, piece);
      }
    }
    for (const Index t : members) {
      piece.triangles.push_back(corner_vertex_[t]);
      const Vec3& gradient = gradient_[of_.kept[t]];
      const double slope = gradient.norm();
      piece.thickness.push_back(slope > 0.0 ? 1.0 / (stack_.count * sheet_.passes * slope) : 0.0);
      direction.push_back(slope > 0.0 ? Vec3(gradient / slope) : Vec3::UnitZ());
      piece.rise.push_back(direction.back().z());
      std::array<Index, 3> across = of_.neighbours[t];
      for (Index& n : across) n = n == kNone ? kNone : piece_triangle_[n];
      piece.neighbours.push_back(across);
    }
    set_vertex_values(piece, std::move(direction));
    return piece;
  }

  // One vertex for each fan of triangles around a point of the sheet.
  void number_fan(Index triangle, int corner, PieceMesh& piece) {
    const Index id = static_cast<Index>(piece.vertices.size()), point = of_.triangles[triangle][corner];
    piece.vertices.push_back(stack_.vertices[of_.vertices[point]]);
    corner_vertex_[triangle][corner] = id;
    for (int side = 0; side < 2; ++side) {
      Index t = triangle;
      int c = corner;
      while (true) {
        const Index n = of_.neighbours[t][side == 0 ? c : prev3(c)];
        if (n == kNone) break;
        const int at = static_cast<int>(std::find(of_.triangles[n].begin(), of_.triangles[n].end(), point) - of_.triangles[n].begin());
        if (corner_vertex_[n][at] != kNone) break;
        corner_vertex_[n][at] = id;
        t = n;
        c = at;
      }
    }
  }

  const LayerStack& stack_;
  const Sheet& sheet_;
  std::span<const Vec3> gradient_;
  SheetTriangles of_;
  std::vector<Index> piece_triangle_;                // number of each triangle in its piece
  std::vector<std::array<Index, 3>> corner_vertex_;  // of the piece
  std::vector<char> seen_;
};

}  // namespace

std::vector<PieceMesh> split_into_pieces(const LayerStack& stack, const Sheet& sheet, std::span<const Vec3> triangle_gradient) {
  return PieceSplitter(stack, sheet, triangle_gradient).run();
}

}  // namespace curvesup::toolpath
