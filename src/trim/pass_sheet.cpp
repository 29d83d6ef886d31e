#include "trim/pass_sheet.h"

#include <algorithm>
#include <limits>

#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup {

namespace {

constexpr int kMaxTetsFollowed = 200;

// Distance along u from p to where the ray leaves the tet, and through which face; entry is not left through again.
double distance_to_exit(const TetMesh& mesh, Index tet, const Vec3& p, const Vec3& u, int entry, int& exit) {
  double nearest = std::numeric_limits<double>::infinity();
  exit = -1;
  for (int f = 0; f < 4; ++f) {
    if (f == entry) continue;
    const auto v = face_vertices(mesh.tets[tet], f);
    const Vec3 &a = mesh.vertices[v[0]], &b = mesh.vertices[v[1]], &c = mesh.vertices[v[2]];
    const Vec3 outward = (b - a).cross(c - a);
    const double rate = outward.dot(u);
    if (rate <= 0.0) continue;
    const double distance = std::max(0.0, outward.dot(a - p) / rate);
    if (distance < nearest) {
      nearest = distance;
      exit = f;
    }
  }
  return nearest;
}

bool points_into(const TetMesh& mesh, Index tet, int face, const Vec3& u) {
  const auto v = face_vertices(mesh.tets[tet], face);
  const Vec3& a = mesh.vertices[v[0]];
  return (mesh.vertices[v[1]] - a).cross(mesh.vertices[v[2]] - a).dot(u) < 0.0;
}

}  // namespace

std::optional<ColumnPoint> follow_gradient(const Domain& domain, const ScalarField& field, Index tet, const Vec3& p,
                                           double target, Through through) {
  const TetMesh& mesh = domain.mesh;
  const auto value_at = [&](Index t, const Vec3& q) {
    const Index v = mesh.tets[t][0];
    return field.value[v] + field.gradient[t].dot(q - mesh.vertices[v]);
  };
  const double sign = value_at(tet, p) < target ? 1.0 : -1.0;
  ColumnPoint at{tet, p};
  Vec3 direction = sign * print_direction(field, tet);
  int entry = -1;
  for (int i = 0; i < kMaxTetsFollowed; ++i) {
    const double slope = field.gradient[at.tet].dot(direction);
    if (slope * sign <= 0.0) return std::nullopt;
    int exit = -1;
    const double to_exit = distance_to_exit(mesh, at.tet, at.position, direction, entry, exit);
    const double to_target = std::max(0.0, (target - value_at(at.tet, at.position)) / slope);
    if (exit < 0 || to_target <= to_exit) {
      at.position += to_target * direction;
      return at;
    }
    at.position += to_exit * direction;
    const Index next = domain.topology.neighbours[at.tet][exit];
    if (through == Through::everything && next == kNone) return ColumnPoint{kNone, at.position};
    if (next == kNone || (through == Through::support && domain.region(next) == Material::model)) return std::nullopt;
    const auto& back = domain.topology.neighbours[next];
    entry = static_cast<int>(std::find(back.begin(), back.end(), at.tet) - back.begin());
    at.tet = next;
    // Where the gradients on both sides of a face point at each other, go straight on.
    const Vec3 turned = sign * print_direction(field, next);
    if (points_into(mesh, next, entry, turned)) direction = turned;
  }
  return std::nullopt;
}

void PassSheet::want(const ColumnPoint& at, double within_mm) {
  const Range range = visit(at.tet);
  for (std::size_t i = range.first; i < range.last; ++i) {
    const auto& t = cutter_.triangles()[i];
    if (wanted_[pieces_.root(t[0])]) continue;
    const auto& v = cutter_.vertices();
    if ((closest_point_on_triangle(at.position, v[t[0]], v[t[1]], v[t[2]]) - at.position).squaredNorm() < within_mm * within_mm) want(t[0]);
  }
}

bool PassSheet::grow() {
  bool any = false;
  for (bool more = true; more;) {
    more = false;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < steps_.size(); ++i) {
      const Step step = steps_[i];
      if (wanted_[pieces_.root(step.vertex)]) {
        const std::size_t visited = ranges_.size();
        visit(step.tet);
        more = more || ranges_.size() > visited;
      } else {
        steps_[kept++] = step;
      }
    }
    steps_.resize(kept);
    any = any || more;
  }
  return any;
}

Index PassSheet::crossing(Index tet, int edge) {
  Index below = domain_.mesh.tets[tet][kTetEdge[edge][0]], above = domain_.mesh.tets[tet][kTetEdge[edge][1]];
  const auto slot = crossings_.at(below, above);
  if (slot.is_new) {
    if (field_.value[below] >= level_.iso_value) std::swap(below, above);
    slot.value = cutter_.add_vertex(crossing_point(domain_.mesh.vertices[below], field_.value[below],
                                                   domain_.mesh.vertices[above], field_.value[above], level_.iso_value));
  }
  return slot.value;
}

Index PassSheet::platform_cut(Index a, Index b) {
  const auto slot = platform_cuts_.at(a, b);
  if (slot.is_new) {
    const Vec3 &low = cutter_.vertices()[std::min(a, b)], &high = cutter_.vertices()[std::max(a, b)];
    slot.value = cutter_.add_vertex(platform_point(low, high));
  }
  return slot.value;
}

void PassSheet::add_clipped(const std::array<Index, 4>& ring, int size, Index tet) {
  const auto z = [&](Index v) { return cutter_.vertices()[v].z(); };
  std::array<Index, 8> kept{};
  int count = 0;
  bool above = false;
  for (int c = 0; c < size; ++c) {
    const Index a = ring[c], b = ring[(c + 1) % size];
    above = above || z(a) > 0.0;
    if (z(a) >= 0.0) kept[count++] = a;
    if ((z(a) > 0.0 && z(b) < 0.0) || (z(a) < 0.0 && z(b) > 0.0)) kept[count++] = platform_cut(a, b);
  }
  if (!above) return;
  const Neighbourhood& around = reachable_.around(tet);
  if (count == 4) return cutter_.add_polygon({kept.data(), 4}, tet, around);
  for (int c = 2; c < count; ++c) cutter_.add_polygon(std::array{kept[0], kept[c - 1], kept[c]}, tet, around);
}

PassSheet::Range PassSheet::visit(Index tet) {
  const auto slot = range_of_.at(tet, tet);
  if (!slot.is_new) return ranges_[slot.value];
  slot.value = static_cast<Index>(ranges_.size());
  const std::size_t first = cutter_.triangles().size();
  ranges_.push_back({first, first});
  if (!reachable_[tet] || (only_ && !only_(tet))) return ranges_.back();
  const auto& v = domain_.mesh.tets[tet];
  int mask = 0;
  for (int c = 0; c < 4; ++c) mask |= (field_.value[v[c]] >= level_.iso_value) << c;
  const CutCase& cut = kCutCases[mask];
  if (cut.size == 0) return ranges_.back();
  std::array<Index, 4> ring{};
  for (int c = 0; c < cut.size; ++c) ring[c] = crossing(tet, cut.edge[c]);
  add_clipped(ring, cut.size, tet);
  ranges_.back().last = cutter_.triangles().size();
  join_corners(ranges_.back());
  look_beyond(tet, cut, ring);
  return ranges_.back();
}

void PassSheet::join_corners(const Range& range) {
  pieces_.grow_to(cutter_.vertices().size());
  wanted_.resize(cutter_.vertices().size(), 0);
  for (std::size_t i = range.first; i < range.last; ++i) {
    const auto& t = cutter_.triangles()[i];
    for (const Index v : {t[1], t[2]}) {
      const bool wanted = wanted_[pieces_.root(t[0])] || wanted_[pieces_.root(v)];
      pieces_.join(t[0], v);
      wanted_[pieces_.root(v)] = wanted;
    }
  }
}

void PassSheet::look_beyond(Index tet, const CutCase& cut, const std::array<Index, 4>& ring) {
  for (int c = 0; c < cut.size; ++c) {
    // Two consecutive edges of the ring share a face: the one opposite the vertex that neither of them has.
    const auto &e = kTetEdge[cut.edge[c]], &f = kTetEdge[cut.edge[(c + 1) % cut.size]];
    int face = 0;
    while (face == e[0] || face == e[1] || face == f[0] || face == f[1]) ++face;
    const Index next = domain_.topology.neighbours[tet][face];
    if (next == kNone || domain_.region(next) == Material::model) continue;
    Index a = ring[c], b = ring[(c + 1) % cut.size];
    const double za = cutter_.vertices()[a].z(), zb = cutter_.vertices()[b].z();
    if ((za < 0.0 && zb <= 0.0) || (za <= 0.0 && zb < 0.0)) continue;
    if (za < 0.0) a = platform_cut(a, b);
    if (zb < 0.0) b = platform_cut(a, b);
    cutter_.for_inside_points(a, b, [&](Index vertex) { steps_.push_back({next, vertex}); });
  }
}

TrimmedSheet PassSheet::snapshot(int layer_count) const {
  TrimmedSheet sheet;
  sheet.head = {level_.layer, level_.pass, level_.passes, Material::support, level_.iso_value, 0, 0};
  sheet.vertices = cutter_.vertices();
  sheet.source.assign(sheet.vertices.size(), kNone);
  sheet.triangles = cutter_.triangles();
  sheet.triangle_tet = cutter_.triangle_tet();
  find_pieces(sheet, field_, layer_count);
  return sheet;
}

}  // namespace curvesup
