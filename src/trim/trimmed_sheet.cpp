#include "trim/trimmed_sheet.h"

#include <algorithm>
#include <numeric>

#include "core/disjoint_sets.h"
#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup {

double TrimmedSheet::area(std::size_t triangle) const {
  const auto& t = triangles[triangle];
  return triangle_area(vertices[t[0]], vertices[t[1]], vertices[t[2]]);
}

namespace {

// For each triangle the piece it belongs to.
std::vector<Index> label(const std::vector<std::array<Index, 3>>& triangles, std::size_t vertex_count, Index& piece_count) {
  DisjointSets sets(triangles.size());
  // Triangles that share an edge meet at its lower vertex.
  struct Side {
    Index high, triangle;
  };
  std::vector<Index> first(vertex_count + 1, 0), count(vertex_count, 0);
  for (const auto& t : triangles) {
    for (int c = 0; c < 3; ++c) ++first[std::min(t[c], t[(c + 1) % 3]) + 1];
  }
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<Side> sides(3 * triangles.size());
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    for (int c = 0; c < 3; ++c) {
      const auto [low, high] = std::minmax(triangles[i][c], triangles[i][(c + 1) % 3]);
      const auto begin = sides.begin() + first[low], end = begin + count[low]++;
      const auto same = std::find_if(begin, end, [high = high](const Side& s) { return s.high == high; });
      if (same != end && low != high) sets.join(static_cast<Index>(i), same->triangle);
      *end = {high, static_cast<Index>(i)};
    }
  }
  std::vector<Index> piece(triangles.size(), kNone), piece_of_root(triangles.size(), kNone);
  piece_count = 0;
  for (std::size_t i = 0; i < triangles.size(); ++i) {
    Index& number = piece_of_root[sets.root(static_cast<Index>(i))];
    if (number == kNone) number = piece_count++;
    piece[i] = number;
  }
  return piece;
}

}  // namespace

void find_pieces(TrimmedSheet& sheet, const ScalarField& field, int layer_count) {
  Index count = 0;
  sheet.triangle_piece = label(sheet.triangles, sheet.vertices.size(), count);
  sheet.pieces.assign(count, {});
  struct Sample {
    Index piece;
    double thickness, area;
  };
  std::vector<Sample> samples;
  for (std::size_t i = 0; i < sheet.triangles.size(); ++i) {
    const auto& t = sheet.triangles[i];
    const double area = sheet.area(i);
    Piece& piece = sheet.pieces[sheet.triangle_piece[i]];
    piece.area += area;
    piece.centroid += area / 3.0 * (sheet.vertices[t[0]] + sheet.vertices[t[1]] + sheet.vertices[t[2]]);
    if (i > 0 && sheet.triangle_piece[i] == sheet.triangle_piece[i - 1] && sheet.triangle_tet[i] == sheet.triangle_tet[i - 1]) {
      samples.back().area += area;
    } else {
      samples.push_back({sheet.triangle_piece[i], 1.0 / (layer_count * field.gradient[sheet.triangle_tet[i]].norm()), area});
    }
  }
  std::sort(samples.begin(), samples.end(), [](const Sample& a, const Sample& b) {
    return a.piece != b.piece ? a.piece < b.piece : a.thickness != b.thickness ? a.thickness < b.thickness : a.area < b.area;
  });
  std::size_t next = 0;
  for (Index p = 0; p < count; ++p) {
    Piece& piece = sheet.pieces[p];
    if (piece.area > 0.0) piece.centroid /= piece.area;
    double sum = 0.0;
    for (bool found = false; next < samples.size() && samples[next].piece == p; ++next) {
      sum += samples[next].area;
      piece.thickness_max = samples[next].thickness;
      if (found) continue;
      piece.thickness_p95 = samples[next].thickness;
      found = sum >= 0.95 * piece.area;
    }
  }
}

void keep_pieces(TrimmedSheet& sheet, const std::vector<char>& keep) {
  if (std::find(keep.begin(), keep.end(), 0) == keep.end()) return;
  std::size_t kept = 0;
  for (std::size_t i = 0; i < sheet.triangles.size(); ++i) {
    if (!keep[sheet.triangle_piece[i]]) continue;
    sheet.triangles[kept] = sheet.triangles[i];
    sheet.triangle_tet[kept] = sheet.triangle_tet[i];
    sheet.triangle_piece[kept++] = sheet.triangle_piece[i];
  }
  sheet.triangles.resize(kept);
  sheet.triangle_tet.resize(kept);
  sheet.triangle_piece.resize(kept);
}

void compact(TrimmedSheet& sheet) {
  std::vector<Index> id(sheet.vertices.size(), kNone);
  for (const auto& t : sheet.triangles) {
    for (const Index v : t) id[v] = 0;
  }
  Index used = 0;
  for (std::size_t v = 0; v < id.size(); ++v) {
    if (id[v] == kNone) continue;
    sheet.vertices[used] = sheet.vertices[v];
    sheet.source[used] = sheet.source[v];
    id[v] = used++;
  }
  sheet.vertices.resize(used);
  sheet.source.resize(used);
  for (auto& t : sheet.triangles) {
    for (Index& v : t) v = id[v];
  }
  sheet.vertices.shrink_to_fit();
  sheet.source.shrink_to_fit();
  sheet.triangles.shrink_to_fit();
  sheet.triangle_tet.shrink_to_fit();
  sheet.triangle_piece.shrink_to_fit();
}

}  // namespace curvesup
