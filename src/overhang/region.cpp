#include "curvesup/overhang/region.h"

#include <algorithm>
#include <limits>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/mesh/triangle_tree.h"

namespace curvesup {

namespace {

Index size_of(const auto& container) { return static_cast<Index>(container.size()); }

// Inside test of a closed surface: parity of the crossings of a vertical line. A line that meets an edge or a corner is
// counted in exactly one of the triangles there (an edge belongs to the triangle on its left).
class InsideTest {
 public:
  explicit InsideTest(const TriangleMesh& mesh) : mesh_(mesh), tree_(mesh) {
    for (const Vec3& p : mesh.vertices) top_ = std::max(top_, p.z());
  }

  [[nodiscard]] bool inside(const Vec3& p) const {
    bool odd = false;
    tree_.overlapping(p, Vec3(p.x(), p.y(), std::max(p.z(), top_)),
                      [&](Index triangle) { odd ^= crosses_above(triangle, p); });
    return odd;
  }

 private:
  // Whether the line to the right of (x, y) crosses the edge ab in the plane, half-open in y: the same answer for ba.
  static bool edge_right_of(const Vec3& a, const Vec3& b, const Vec3& p) {
    if ((a.y() > p.y()) == (b.y() > p.y())) return false;
    const Vec3& low = a.y() < b.y() ? a : b;
    const Vec3& high = a.y() < b.y() ? b : a;
    return (high.x() - low.x()) * (p.y() - low.y()) - (p.x() - low.x()) * (high.y() - low.y()) > 0.0;
  }

  [[nodiscard]] bool crosses_above(Index triangle, const Vec3& p) const {
    const auto& t = mesh_.triangles[triangle];
    const Vec3 &a = mesh_.vertices[t[0]], &b = mesh_.vertices[t[1]], &c = mesh_.vertices[t[2]];
    if (!(edge_right_of(a, b, p) ^ edge_right_of(b, c, p) ^ edge_right_of(c, a, p))) return false;
    const Vec3 n = area_normal(a, b, c);
    return n.z() != 0.0 && a.z() - ((p.x() - a.x()) * n.x() + (p.y() - a.y()) * n.y()) / n.z() > p.z();
  }

  const TriangleMesh& mesh_;
  TriangleTree tree_;
  double top_ = std::numeric_limits<double>::lowest();
};

bool is_closed(const TriangleMesh& mesh) {
  std::vector<std::array<Index, 3>> edges;  // low, high, +1 for low -> high
  for (const auto& t : mesh.triangles) {
    for (int c = 0; c < 3; ++c) {
      const auto [low, high] = std::minmax(t[c], t[(c + 1) % 3]);
      edges.push_back({low, high, t[c] == low ? 1 : -1});
    }
  }
  std::sort(edges.begin(), edges.end());
  for (std::size_t i = 0; i < edges.size();) {
    Index balance = 0;
    std::size_t end = i;
    for (; end < edges.size() && edges[end][0] == edges[i][0] && edges[end][1] == edges[i][1]; ++end)
      balance += edges[end][2];
    if (balance != 0) return false;
    i = end;
  }
  return !mesh.triangles.empty();
}

[[noreturn]] void refuse(const std::string& what, const std::string& remedy) {
  throw Error(ErrorKind::usage, "support.enforce / support.block", what, remedy);
}

void mark(const Model& model, const auto& contains, std::vector<char>& in) {
  for (Index f = 0; f < size_of(model.boundary); ++f) {
    const auto& v = model.boundary[f].vertices;
    const auto& p = model.mesh.vertices;
    if (!in[f]) in[f] = contains(Vec3((p[v[0]] + p[v[1]] + p[v[2]]) / 3.0));
  }
}

void mark(const Model& model, const Region& region, std::vector<char>& in) {
  switch (region.kind) {
    case Region::Kind::box:
      if (!((region.high - region.low).minCoeff() > 0.0))
        refuse("a box needs low < high in x, y and z", "swap its corners");
      return mark(
          model,
          [&](const Vec3& p) {
            return (p.array() >= region.low.array()).all() && (p.array() <= region.high.array()).all();
          },
          in);
    case Region::Kind::sphere:
      if (!(region.radius_mm > 0.0)) refuse("a sphere needs radius_mm above 0", "give its radius");
      return mark(
          model, [&](const Vec3& p) { return (p - region.centre).norm() <= region.radius_mm; }, in);
    case Region::Kind::faces:
      for (const Index f : region.faces) {
        if (f < 0 || f >= size_of(model.boundary)) {
          refuse(format("the model has no boundary face %d", f),
                 format("must be 0 .. %d", size_of(model.boundary) - 1));
        }
        in[f] = 1;
      }
      return;
    case Region::Kind::mesh: {
      if (!is_closed(region.mesh)) refuse("the mesh of a region is not closed", "close its holes");
      const InsideTest test(region.mesh);
      return mark(
          model, [&](const Vec3& p) { return test.inside(p); }, in);
    }
  }
}

}  // namespace

Region Region::box(const Vec3& low, const Vec3& high) {
  Region region;
  region.low = low;
  region.high = high;
  return region;
}

Region Region::sphere(const Vec3& centre, double radius_mm) {
  Region region;
  region.kind = Kind::sphere;
  region.centre = centre;
  region.radius_mm = radius_mm;
  return region;
}

Region Region::of_faces(std::vector<Index> faces) {
  Region region;
  region.kind = Kind::faces;
  region.faces = std::move(faces);
  return region;
}

Region Region::inside(TriangleMesh mesh) {
  Region region;
  region.kind = Kind::mesh;
  region.mesh = std::move(mesh);
  return region;
}

std::vector<char> faces_in_regions(const Model& model, const std::vector<Region>& regions) {
  std::vector<char> in(model.boundary.size(), 0);
  for (const Region& region : regions) mark(model, region, in);
  return in;
}

}  // namespace curvesup
