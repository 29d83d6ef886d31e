#include "thin.h"

#include <algorithm>
#include <cmath>

#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup {

namespace {

// Longest run that one chord may replace: bounds the work by points times this.
constexpr Index kMaxRun = 64;

bool chord_covers(std::span<const Vec3> points, Index from, Index to, double tolerance) {
  for (Index i = from + 1; i < to; ++i) {
    if ((closest_point_on_segment(points[i], points[from], points[to]) - points[i]).norm() > tolerance) return false;
  }
  return true;
}

// The grid cell of a point, 21 bits a coordinate.
std::uint64_t cell_key(const Vec3& p) {
  std::uint64_t key = 0;
  for (int i = 0; i < 3; ++i) {
    const double cell = std::clamp(std::floor(p[i]), -0x1p20, 0x1p20 - 1.0) + 0x1p20;
    key = key << 21 | static_cast<std::uint64_t>(cell);
  }
  return key;
}

}  // namespace

std::vector<Index> thin_polyline(std::span<const Vec3> points, double tolerance,
                                 const std::function<bool(Index, Index)>& must_keep) {
  std::vector<Index> kept;
  const Index count = static_cast<Index>(points.size());
  if (count == 0) return kept;
  kept.push_back(0);
  Index from = 0;
  for (Index to = 1; to < count; ++to) {
    const bool fits = to - from < kMaxRun && chord_covers(points, from, to, tolerance) && !(must_keep && must_keep(from, to));
    if (fits || to == from + 1) continue;
    from = to - 1;
    kept.push_back(from);
  }
  if (count > 1) kept.push_back(count - 1);
  return kept;
}

SheetReader::SheetReader(const LayerStack& stack) : stack_(stack), local_(stack.vertices.size(), kNone) {}

void SheetReader::read(const Sheet& sheet) {
  for (const Index v : vertices_) local_[v] = kNone;
  vertices_.clear();
  triangles_.clear();
  triangles_.reserve(sheet.triangle_count);
  for (Index t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) {
    std::array<Index, 3> corners = stack_.triangles[t];
    for (Index& v : corners) {
      if (local_[v] == kNone) {
        local_[v] = static_cast<Index>(vertices_.size());
        vertices_.push_back(v);
      }
      v = local_[v];
    }
    triangles_.push_back(corners);
  }
  find_border();
}

CoarseSheet SheetReader::coarse(double cell_mm) const {
  struct Keyed {
    std::uint64_t cell;
    Index vertex;
  };
  std::vector<Keyed> keyed;
  keyed.reserve(vertices_.size());
  for (std::size_t i = 0; i < vertices_.size(); ++i) {
    keyed.push_back({cell_key(stack_.vertices[vertices_[i]] / cell_mm), static_cast<Index>(i)});
  }
  std::sort(keyed.begin(), keyed.end(),
            [](const Keyed& a, const Keyed& b) { return a.cell != b.cell ? a.cell < b.cell : a.vertex < b.vertex; });

  const auto normal = [](const auto& at, const std::array<Index, 3>& c) { return area_normal(at[c[0]], at[c[1]], at[c[2]]); };
  const auto normal_of_sheet = [&](const std::array<Index, 3>& t) {
    return area_normal(stack_.vertices[vertices_[t[0]]], stack_.vertices[vertices_[t[1]]], stack_.vertices[vertices_[t[2]]]);
  };
  CoarseSheet out;
  std::vector<Index> cluster(vertices_.size());
  for (std::size_t begin = 0; begin < keyed.size();) {
    std::size_t end = begin, border = 0;
    Vec3 sum = Vec3::Zero(), border_sum = Vec3::Zero();
    for (; end < keyed.size() && keyed[end].cell == keyed[begin].cell; ++end) {
      const Vec3& v = stack_.vertices[vertices_[keyed[end].vertex]];
      sum += v;
      if (on_border_[keyed[end].vertex]) border_sum += v, ++border;
      cluster[keyed[end].vertex] = static_cast<Index>(out.vertices.size());
    }
    out.vertices.push_back(border > 0 ? Vec3(border_sum / static_cast<double>(border)) : Vec3(sum / static_cast<double>(end - begin)));
    begin = end;
  }
  for (const auto& t : triangles_) {
    std::array<Index, 3> c = {cluster[t[0]], cluster[t[1]], cluster[t[2]]};
    if (c[0] == c[1] || c[1] == c[2] || c[2] == c[0]) continue;
    // Moved together, a triangle may turn over: its other side would show as a dark speck.
    if (normal(out.vertices, c).dot(normal_of_sheet(t)) < 0.0) std::swap(c[1], c[2]);
    std::rotate(c.begin(), std::min_element(c.begin(), c.end()), c.end());
    out.triangles.push_back(c);
  }
  std::sort(out.triangles.begin(), out.triangles.end());
  out.triangles.erase(std::unique(out.triangles.begin(), out.triangles.end()), out.triangles.end());
  return out;
}

void SheetReader::find_border() {
  // Half-edges in buckets of their lower vertex; one without its opposite is border.
  std::vector<Index> first(vertices_.size() + 1, 0);
  const auto each_edge = [&](const auto& visit) {
    for (const auto& t : triangles_) {
      for (int i = 0; i < 3; ++i) visit(t[i], t[(i + 1) % 3]);
    }
  };
  each_edge([&](Index a, Index b) { ++first[std::min(a, b) + 1]; });
  for (std::size_t v = 1; v < first.size(); ++v) first[v] += first[v - 1];
  std::vector<std::array<Index, 2>> bucket(3 * triangles_.size());
  std::vector<Index> fill(first.begin(), first.end() - 1);
  each_edge([&](Index a, Index b) { bucket[fill[std::min(a, b)]++] = {a, b}; });

  border_.clear();
  on_border_.assign(vertices_.size(), 0);
  for (std::size_t v = 0; v + 1 < first.size(); ++v) {
    for (Index i = first[v]; i < first[v + 1]; ++i) {
      const auto [a, b] = bucket[i];
      const bool inner = std::any_of(bucket.begin() + first[v], bucket.begin() + first[v + 1],
                                     [a, b](const auto& edge) { return edge[0] == b && edge[1] == a; });
      if (inner) continue;
      border_.push_back(bucket[i]);
      on_border_[a] = on_border_[b] = 1;
    }
  }
  std::sort(border_.begin(), border_.end());
}

std::vector<std::vector<Vec3>> SheetReader::borders() const {
  std::vector<char> used(border_.size(), 0);
  std::vector<std::vector<Vec3>> chains;
  for (std::size_t start = 0; start < border_.size(); ++start) {
    if (used[start]) continue;
    std::vector<Vec3> chain = {stack_.vertices[vertices_[border_[start][0]]]};
    for (std::size_t edge = start; edge < border_.size() && !used[edge];) {
      used[edge] = 1;
      const Index next = border_[edge][1];
      chain.push_back(stack_.vertices[vertices_[next]]);
      edge = std::lower_bound(border_.begin(), border_.end(), std::array<Index, 2>{next, 0}) - border_.begin();
      while (edge < border_.size() && border_[edge][0] == next && used[edge]) ++edge;
      if (edge < border_.size() && border_[edge][0] != next) break;
    }
    chains.push_back(std::move(chain));
  }
  return chains;
}

}  // namespace curvesup
