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

std::vector<PieceMesh> split_into_pieces(const LayerStack& stack, const Sheet& sheet,
                                         std::span<const Vec3> triangle_gradient) {
  // Vertices of the sheet, renumbered densely in ascending order. The ids of one sheet lie close together.
  std::vector<Index> kept;
  Index low = std::numeric_limits<Index>::max(), high = -1;
  for (Index t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) {
    const auto& [a, b, c] = stack.triangles[t];
    if (a == b || b == c || c == a) continue;
    kept.push_back(t);
    low = std::min({low, a, b, c});
    high = std::max({high, a, b, c});
  }
  std::vector<Index> number(kept.empty() ? 0 : high - low + 1, kNone), ids;
  for (const Index t : kept) {
    for (const Index v : stack.triangles[t]) number[v - low] = 0;
  }
  for (std::size_t i = 0; i < number.size(); ++i) {
    if (number[i] == kNone) continue;
    number[i] = static_cast<Index>(ids.size());
    ids.push_back(low + static_cast<Index>(i));
  }
  std::vector<std::array<Index, 3>> triangles(kept.size());
  for (std::size_t t = 0; t < kept.size(); ++t) {
    for (int i = 0; i < 3; ++i) triangles[t][i] = number[stack.triangles[kept[t]][i] - low];
  }
  const auto neighbours = pair_edges(triangles, static_cast<Index>(ids.size()));

  std::vector<PieceMesh> pieces;
  std::vector<Index> members, piece_triangle(triangles.size(), kNone);
  std::vector<std::array<Index, 3>> corner_vertex(triangles.size(), {kNone, kNone, kNone});
  std::vector<char> seen(triangles.size(), 0);
  for (std::size_t seed = 0; seed < triangles.size(); ++seed) {
    if (seen[seed]) continue;
    members.assign(1, static_cast<Index>(seed));
    seen[seed] = 1;
    for (std::size_t head = 0; head < members.size(); ++head) {
      for (const Index n : neighbours[members[head]]) {
        if (n != kNone && !seen[n]) {
          seen[n] = 1;
          members.push_back(n);
        }
      }
    }
    std::sort(members.begin(), members.end());

    PieceMesh piece;
    std::vector<Vec3> direction;
    for (auto* values : {&piece.thickness, &piece.rise}) values->reserve(members.size());
    for (auto* rows : {&piece.triangles, &piece.neighbours}) rows->reserve(members.size());
    direction.reserve(members.size());
    // One vertex for each fan of triangles around a point of the sheet.
    const auto number_fan = [&](Index triangle, int corner) {
      const Index id = static_cast<Index>(piece.vertices.size()), point = triangles[triangle][corner];
      piece.vertices.push_back(stack.vertices[ids[point]]);
      std::array<Index, 2> front{triangle, triangle};
      corner_vertex[triangle][corner] = id;
      for (int side = 0; side < 2; ++side) {
        Index t = front[side];
        int c = corner;
        while (true) {
          const Index n = neighbours[t][side == 0 ? c : prev3(c)];
          if (n == kNone) break;
          const int at = static_cast<int>(std::find(triangles[n].begin(), triangles[n].end(), point) - triangles[n].begin());
          if (corner_vertex[n][at] != kNone) break;
          corner_vertex[n][at] = id;
          t = n;
          c = at;
        }
      }
    };
    for (std::size_t m = 0; m < members.size(); ++m) {
      const Index t = members[m];
      piece_triangle[t] = static_cast<Index>(m);
      for (int i = 0; i < 3; ++i) {
        if (corner_vertex[t][i] == kNone) number_fan(t, i);
      }
    }
    for (const Index t : members) {
      piece.triangles.push_back(corner_vertex[t]);
      const Vec3& gradient = triangle_gradient[kept[t]];
      const double slope = gradient.norm();
      piece.thickness.push_back(slope > 0.0 ? 1.0 / (stack.count * sheet.passes * slope) : 0.0);
      direction.push_back(slope > 0.0 ? Vec3(gradient / slope) : Vec3::UnitZ());
      piece.rise.push_back(direction.back().z());
      std::array<Index, 3> across = neighbours[t];
      for (Index& n : across) n = n == kNone ? kNone : piece_triangle[n];
      piece.neighbours.push_back(across);
    }
    set_vertex_values(piece, std::move(direction));
    pieces.push_back(std::move(piece));
  }
  return pieces;
}

}  // namespace curvesup::toolpath
