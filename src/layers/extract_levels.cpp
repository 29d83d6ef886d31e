#include <algorithm>
#include <array>
#include <cstdint>
#include <limits>
#include <numeric>

#include "curvesup/core/error.h"
#include "curvesup/core/parallel.h"
#include "curvesup/layers/layers.h"
#include "layers/cut_cases.h"

namespace curvesup {

namespace {

constexpr std::size_t kTetGrain = 16384;
constexpr std::size_t kVertexGrain = 8192;
constexpr std::size_t kEdgeGrain = 16384;
constexpr std::size_t kTriangleGrain = 32768;

// The levels below or at a vertex's value are 0 .. rank - 1: for those the vertex is above.
std::vector<Index> vertex_ranks(const ScalarField& field, std::span<const Level> levels, const RunContext& run) {
  std::vector<Index> rank(field.value.size());
  parallel_for(rank.size(), kVertexGrain, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t v = begin; v < end; ++v) {
      const auto above = std::upper_bound(levels.begin(), levels.end(), field.value[v],
                                          [](double value, const Level& level) { return value < level.iso_value; });
      rank[v] = static_cast<Index>(above - levels.begin());
    }
  });
  return rank;
}

// The tets that any level crosses, in the given order.
std::vector<Index> crossed_tets(const Domain& domain, std::span<const Index> tets, const std::vector<Index>& rank) {
  std::vector<Index> crossed;
  crossed.reserve(tets.size());
  for (const Index t : tets) {
    const auto& v = domain.mesh.tets[t];
    const Index r = rank[v[0]];
    if (rank[v[1]] != r || rank[v[2]] != r || rank[v[3]] != r) crossed.push_back(t);
  }
  return crossed;
}

// The unique crossed edges of the crossed tets. The crossings of edge e have consecutive ids from first_crossing[e], the
// lowest level first.
struct CrossedEdges {
  std::vector<std::array<Index, 2>> vertices;  // ascending ids, edges in ascending order
  std::vector<Index> first_crossing;           // one more than edges
  std::vector<std::array<Index, 6>> of_tet;    // per crossed tet; kNone where the edge is not crossed
};

CrossedEdges find_crossed_edges(const Domain& domain, const std::vector<Index>& crossed, const std::vector<Index>& rank,
                                const RunContext& run) {
  struct Use {
    Index high;
    std::uint32_t slot;  // 6 * tet + local edge
  };
  const auto for_each_use = [&](const auto& visit) {
    for (std::size_t i = 0; i < crossed.size(); ++i) {
      const auto& v = domain.mesh.tets[crossed[i]];
      for (int e = 0; e < 6; ++e) {
        const Index a = v[kTetEdge[e][0]], b = v[kTetEdge[e][1]];
        if (rank[a] != rank[b]) visit(std::min(a, b), Use{std::max(a, b), static_cast<std::uint32_t>(6 * i + e)});
      }
    }
  };
  const std::size_t vertex_count = domain.mesh.vertices.size();
  std::vector<Index> start(vertex_count + 1, 0);
  for_each_use([&](Index low, const Use&) { ++start[low + 1]; });
  std::partial_sum(start.begin(), start.end(), start.begin());
  std::vector<Use> uses(start.back());
  {
    std::vector<Index> next(start.begin(), start.end() - 1);
    for_each_use([&](Index low, const Use& use) { uses[next[low]++] = use; });
  }

  std::vector<Index> edges_of_chunk(chunk_count(vertex_count, kVertexGrain) + 1, 0);
  parallel_for(vertex_count, kVertexGrain, run, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    Index count = 0;
    for (std::size_t v = begin; v < end; ++v) {
      const auto first = uses.begin() + start[v], last = uses.begin() + start[v + 1];
      std::sort(first, last, [](const Use& a, const Use& b) { return a.high != b.high ? a.high < b.high : a.slot < b.slot; });
      for (auto use = first; use != last; ++use) count += use == first || use->high != (use - 1)->high;
    }
    edges_of_chunk[chunk + 1] = count;
  });
  std::partial_sum(edges_of_chunk.begin(), edges_of_chunk.end(), edges_of_chunk.begin());

  CrossedEdges edges;
  edges.vertices.resize(edges_of_chunk.back());
  edges.of_tet.assign(crossed.size(), {kNone, kNone, kNone, kNone, kNone, kNone});
  parallel_for(vertex_count, kVertexGrain, run, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    Index edge = edges_of_chunk[chunk] - 1;
    for (std::size_t v = begin; v < end; ++v) {
      for (Index u = start[v]; u < start[v + 1]; ++u) {
        if (u == start[v] || uses[u].high != uses[u - 1].high) edges.vertices[++edge] = {static_cast<Index>(v), uses[u].high};
        edges.of_tet[uses[u].slot / 6][uses[u].slot % 6] = edge;
      }
    }
  });

  edges.first_crossing.resize(edges.vertices.size() + 1);
  Index crossings = 0;
  for (std::size_t e = 0; e < edges.vertices.size(); ++e) {
    edges.first_crossing[e] = crossings;
    crossings += std::abs(rank[edges.vertices[e][0]] - rank[edges.vertices[e][1]]);
  }
  edges.first_crossing.back() = crossings;
  return edges;
}

// Position of every crossing, and its level.
struct Crossings {
  std::vector<Vec3> position;
  std::vector<Index> level;
};

Crossings place_crossings(const Domain& domain, const ScalarField& field, std::span<const Level> levels,
                          const std::vector<Index>& rank, const CrossedEdges& edges, const RunContext& run) {
  Crossings crossings;
  crossings.position.resize(edges.first_crossing.back());
  crossings.level.resize(edges.first_crossing.back());
  parallel_for(edges.vertices.size(), kEdgeGrain, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t e = begin; e < end; ++e) {
      auto [below, above] = edges.vertices[e];
      if (rank[below] > rank[above]) std::swap(below, above);
      const Vec3& a = domain.mesh.vertices[below];
      const Vec3& b = domain.mesh.vertices[above];
      const double low = field.value[below], high = field.value[above];
      Index id = edges.first_crossing[e];
      for (Index level = rank[below]; level < rank[above]; ++level, ++id) {
        crossings.position[id] = crossing_point(a, low, b, high, levels[level].iso_value);
        crossings.level[id] = level;
      }
    }
  });
  return crossings;
}

// Sheet s = 2 * level + material while the triangles are made.
struct RawTriangles {
  std::vector<std::array<Index, 3>> corners;  // crossing ids
  std::vector<Index> tet;
  std::vector<Index> first_of_sheet;  // one more than sheets
};

RawTriangles march(const Domain& domain, std::size_t level_count, const std::vector<Index>& crossed,
                   const std::vector<Index>& rank, const CrossedEdges& edges, const Crossings& crossings,
                   const RunContext& run) {
  const std::size_t sheets = 2 * level_count;
  const std::size_t chunks = chunk_count(crossed.size(), kTetGrain);
  std::vector<Index> offset(chunks * sheets, 0);  // of chunk c in sheet s: first its count, then where it starts
  const auto for_each_cut = [&](std::size_t begin, std::size_t end, const auto& visit) {
    for (std::size_t i = begin; i < end; ++i) {
      const auto& v = domain.mesh.tets[crossed[i]];
      const std::array<Index, 4> r = {rank[v[0]], rank[v[1]], rank[v[2]], rank[v[3]]};
      const auto [lowest, highest] = std::minmax_element(r.begin(), r.end());
      const Index material = static_cast<Index>(domain.region(crossed[i]));
      for (Index level = *lowest; level < *highest; ++level) {
        const int mask = (r[0] > level) | (r[1] > level) << 1 | (r[2] > level) << 2 | (r[3] > level) << 3;
        visit(i, r, level, 2 * level + material, kCutCases[mask]);
      }
    }
  };
  parallel_for(crossed.size(), kTetGrain, run, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    for_each_cut(begin, end, [&](std::size_t, const auto&, Index, Index sheet, const CutCase& cut) {
      offset[chunk * sheets + sheet] += cut.size - 2;
    });
  });

  RawTriangles raw;
  raw.first_of_sheet.resize(sheets + 1, 0);
  Index total = 0;
  for (std::size_t s = 0; s < sheets; ++s) {
    raw.first_of_sheet[s] = total;
    for (std::size_t c = 0; c < chunks; ++c) {
      const Index count = offset[c * sheets + s];
      offset[c * sheets + s] = total;
      total += count;
    }
  }
  raw.first_of_sheet[sheets] = total;
  raw.corners.resize(total);
  raw.tet.resize(total);
  parallel_for(crossed.size(), kTetGrain, run, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    for_each_cut(begin, end, [&](std::size_t i, const std::array<Index, 4>& r, Index level, Index sheet, const CutCase& cut) {
      std::array<Index, 4> ring{};
      for (int c = 0; c < cut.size; ++c) {
        const auto& ends = kTetEdge[cut.edge[c]];
        ring[c] = edges.first_crossing[edges.of_tet[i][cut.edge[c]]] + level - std::min(r[ends[0]], r[ends[1]]);
      }
      Index& next = offset[chunk * sheets + sheet];
      const auto emit = [&](int a, int b, int c) {
        raw.corners[next] = {ring[a], ring[b], ring[c]};
        raw.tet[next++] = crossed[i];
      };
      if (cut.size == 3) {
        emit(0, 1, 2);
        return;
      }
      const auto& p = crossings.position;
      if ((p[ring[2]] - p[ring[0]]).squaredNorm() <= (p[ring[3]] - p[ring[1]]).squaredNorm()) {
        emit(0, 1, 2);
        emit(0, 2, 3);
      } else {
        emit(0, 1, 3);
        emit(1, 2, 3);
      }
    });
  });
  return raw;
}

// On which side of the platform each crossing lies: 1 above, 0 on it, -1 below.
std::vector<std::int8_t> platform_sides(const Crossings& crossings, const RunContext& run) {
  std::vector<std::int8_t> side(crossings.position.size());
  parallel_for(side.size(), kEdgeGrain, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t v = begin; v < end; ++v) {
      const double z = crossings.position[v].z();
      side[v] = static_cast<std::int8_t>((z > 0.0) - (z < 0.0));
    }
  });
  return side;
}

// Calls body(sheet, its first triangle, the one after its last) for every sheet, in parallel.
void for_each_sheet(const RawTriangles& raw, const RunContext& run, const auto& body) {
  parallel_for(raw.first_of_sheet.size() - 1, 1, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t s = begin; s < end; ++s) body(s, raw.first_of_sheet[s], raw.first_of_sheet[s + 1]);
  });
}

// Cuts the triangles at the platform and keeps what has area above it. A corner at z = 0 is a point of the cut itself;
// points of the cut are shared by the triangles at their edge and have z = 0 exactly.
void clip_at_platform(RawTriangles& raw, Crossings& crossings, const RunContext& run) {
  const std::vector<std::int8_t> side = platform_sides(crossings, run);
  const auto is_cut = [&](Index a, Index b) { return side[a] * side[b] < 0; };
  const auto goes = [&](const auto& t) { return side[t[0]] <= 0 && side[t[1]] <= 0 && side[t[2]] <= 0; };
  const std::size_t sheets = raw.first_of_sheet.size() - 1;
  std::vector<Index> kept_in_sheet(sheets, 0);
  std::vector<std::vector<std::array<Index, 2>>> cuts_of_sheet(sheets);  // (low id, high id)
  for_each_sheet(raw, run, [&](std::size_t s, Index first, Index last) {
    for (Index i = first; i < last; ++i) {
      const auto& t = raw.corners[i];
      if (goes(t)) continue;
      int corners = 0;
      for (int c = 0; c < 3; ++c) {
        const Index a = t[c], b = t[(c + 1) % 3];
        const bool cut = is_cut(a, b);
        corners += (side[a] >= 0) + cut;
        if (cut) cuts_of_sheet[s].push_back({std::min(a, b), std::max(a, b)});
      }
      kept_in_sheet[s] += corners - 2;
    }
  });
  std::vector<std::array<Index, 2>> cut_edges;
  for (const auto& cuts : cuts_of_sheet) cut_edges.insert(cut_edges.end(), cuts.begin(), cuts.end());
  std::sort(cut_edges.begin(), cut_edges.end());
  cut_edges.erase(std::unique(cut_edges.begin(), cut_edges.end()), cut_edges.end());
  const Index first_cut = static_cast<Index>(crossings.position.size());
  for (const auto& [a, b] : cut_edges) {
    crossings.position.push_back(platform_point(crossings.position[a], crossings.position[b]));
    crossings.level.push_back(crossings.level[a]);
  }
  const auto cut_between = [&](Index a, Index b) {
    const std::array<Index, 2> key = {std::min(a, b), std::max(a, b)};
    return first_cut + static_cast<Index>(std::lower_bound(cut_edges.begin(), cut_edges.end(), key) - cut_edges.begin());
  };

  RawTriangles kept;
  kept.first_of_sheet.resize(sheets + 1, 0);
  std::partial_sum(kept_in_sheet.begin(), kept_in_sheet.end(), kept.first_of_sheet.begin() + 1);
  if (cut_edges.empty() && kept.first_of_sheet == raw.first_of_sheet) return;
  kept.corners.resize(kept.first_of_sheet.back());
  kept.tet.resize(kept.first_of_sheet.back());
  for_each_sheet(raw, run, [&](std::size_t s, Index first, Index last) {
    Index next = kept.first_of_sheet[s];
    for (Index i = first; i < last; ++i) {
      const auto& t = raw.corners[i];
      if (goes(t)) continue;
      std::array<Index, 4> ring{};
      int size = 0;
      for (int c = 0; c < 3; ++c) {
        const Index a = t[c], b = t[(c + 1) % 3];
        if (side[a] >= 0) ring[size++] = a;
        if (is_cut(a, b)) ring[size++] = cut_between(a, b);
      }
      for (int c = 2; c < size; ++c) {
        kept.corners[next] = {ring[0], ring[c - 1], ring[c]};
        kept.tet[next++] = raw.tet[i];
      }
    }
  });
  raw = std::move(kept);
}

// Numbers the used crossings level by level, so that each sheet's vertices lie together.
LayerStack compact(RawTriangles&& raw, const Crossings& crossings, std::span<const Level> levels, int layer_count,
                   const RunContext& run) {
  LayerStack stack;
  stack.count = layer_count;
  std::vector<Index> id(crossings.position.size(), kNone);
  // The two sheets of a level share crossings, so one thread takes both.
  parallel_for(levels.size(), 1, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (Index i = raw.first_of_sheet[2 * begin]; i < raw.first_of_sheet[2 * end]; ++i) {
      for (const Index v : raw.corners[i]) id[v] = 0;
    }
  });
  std::vector<Index> next(levels.size() + 1, 0);
  for (std::size_t v = 0; v < id.size(); ++v) next[crossings.level[v] + 1] += id[v] == 0;
  std::partial_sum(next.begin(), next.end(), next.begin());
  stack.vertices.resize(next.back());
  for (std::size_t v = 0; v < id.size(); ++v) {
    if (id[v] == kNone) continue;
    id[v] = next[crossings.level[v]]++;
    stack.vertices[id[v]] = crossings.position[v];
  }
  parallel_for(raw.corners.size(), kTriangleGrain, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      auto& t = raw.corners[i];
      t = {id[t[0]], id[t[1]], id[t[2]]};
    }
  });
  stack.triangles = std::move(raw.corners);
  stack.triangle_tet = std::move(raw.tet);
  for (std::size_t s = 0; s + 1 < raw.first_of_sheet.size(); ++s) {
    const Index first = raw.first_of_sheet[s], count = raw.first_of_sheet[s + 1] - first;
    if (count == 0) continue;
    const Level& level = levels[s / 2];
    stack.sheets.push_back(
        {level.layer, level.pass, level.passes, static_cast<Material>(s % 2), level.iso_value, first, count});
  }
  return stack;
}

}  // namespace

LayerStack extract_levels(const Domain& domain, const ScalarField& field, int layer_count, std::span<const Level> levels,
                          std::span<const Index> tets, const RunContext& run) {
  if (layer_count <= 0) {
    throw Error(ErrorKind::geometry, "layers", "the layer count is " + std::to_string(layer_count) + ", it must be positive");
  }
  if (field.value.size() != domain.mesh.vertices.size() || field.gradient.size() != domain.mesh.tets.size()) {
    throw Error(ErrorKind::internal, "layers", "the field does not have one value a vertex and one gradient a tet");
  }
  const std::vector<Index> rank = vertex_ranks(field, levels, run);
  const std::vector<Index> crossed = crossed_tets(domain, tets, rank);
  const CrossedEdges edges = find_crossed_edges(domain, crossed, rank, run);
  Crossings crossings = place_crossings(domain, field, levels, rank, edges, run);
  RawTriangles raw = march(domain, levels.size(), crossed, rank, edges, crossings, run);
  clip_at_platform(raw, crossings, run);
  return compact(std::move(raw), crossings, levels, layer_count, run);
}

double local_thickness(const LayerStack& stack, const ScalarField& field, const Sheet& sheet, Index triangle) {
  return 1.0 / (stack.count * sheet.passes * field.gradient[stack.triangle_tet[triangle]].norm());
}

}  // namespace curvesup
