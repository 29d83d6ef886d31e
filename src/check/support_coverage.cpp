#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "check/printed_grid.h"
#include "check/sheet_pieces.h"
#include "curvesup/core/parallel.h"
#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup::certificate {

namespace {

struct Sample {
  Vec3 position;
  Vec3 down;         // unit -d_p
  double thickness;  // of the model's layer there
  double area;       // share of its face
  Index face;        // of Model::boundary
};

constexpr std::uint8_t kByModel = 1, kBySupport = 2;

std::vector<char> overhanging_faces(const Subject& subject, const std::vector<Index>& blocked, double& blocked_area) {
  const auto& p = subject.model.mesh.vertices;
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::max()), high = -low;
  for (const auto& face : subject.model.boundary) {
    for (const Index v : face.vertices) {
      low = low.cwiseMin(p[v]);
      high = high.cwiseMax(p[v]);
    }
  }
  const double platform = 1e-6 * (high - low).norm();
  std::vector<char> hangs(subject.model.boundary.size(), 0);
  for (std::size_t f = 0; f < hangs.size(); ++f) {
    const auto& face = subject.model.boundary[f];
    const Vec3 &a = p[face.vertices[0]], &b = p[face.vertices[1]], &c = p[face.vertices[2]];
    if (std::max({std::abs(a.z()), std::abs(b.z()), std::abs(c.z())}) < platform) continue;
    const Vec3 n = area_normal(a, b, c);
    // n . d_p <= -sin(alpha) |n|
    hangs[f] = n.dot(subject.direction(face.tet)) <= -subject.options.self_support.sin() * n.norm();
  }
  for (const Index f : subject.options.enforced_faces) hangs[f] = 1;
  for (const Index f : blocked) {
    const auto& v = subject.model.boundary[f].vertices;
    if (hangs[f]) blocked_area += triangle_area(p[v[0]], p[v[1]], p[v[2]]);
    hangs[f] = 0;
  }
  return hangs;
}

// Each face is cut into m^2 congruent triangles; their centroids are its samples.
std::vector<Sample> sample_faces(const Subject& subject, const std::vector<char>& hangs) {
  std::vector<Sample> samples;
  for (Index f = 0; f < static_cast<Index>(hangs.size()); ++f) {
    if (!hangs[f]) continue;
    const auto& face = subject.model.boundary[f];
    const auto& p = subject.model.mesh.vertices;
    const Vec3& a = p[face.vertices[0]];
    const Vec3 ab = p[face.vertices[1]] - a, ac = p[face.vertices[2]] - a;
    const double area = 0.5 * ab.cross(ac).norm();
    const int m = std::max(1, static_cast<int>(std::ceil(std::sqrt(area * subject.options.samples_per_mm2))));
    Sample sample{a, -subject.direction(face.tet), subject.thickness(face.tet, 1), area / (m * m), f};
    for (int i = 0; i < m; ++i) {
      for (int j = 0; i + j < m; ++j) {
        sample.position = a + ((i + 1.0 / 3) * ab + (j + 1.0 / 3) * ac) / m;
        samples.push_back(sample);
        if (i + j + 1 == m) continue;
        sample.position = a + ((i + 2.0 / 3) * ab + (j + 2.0 / 3) * ac) / m;
        samples.push_back(sample);
      }
    }
  }
  return samples;
}

// False for triangles that lie wholly to one side of the line through p, or behind p: they meet no cylinder around it.
bool near_line(const std::array<Vec3, 3>& triangle, const Vec3& p, const Vec3& down, double radius) {
  const Vec3 a = triangle[0] - p, b = triangle[1] - p, c = triangle[2] - p;
  if (std::max({a.dot(down), b.dot(down), c.dot(down)}) < 0.0) return false;
  // Seen along the line, all corners beyond a tangent of the circle.
  const Vec3 middle = (a + b + c) / 3.0, aside = middle - middle.dot(down) * down;
  const double bound = radius * aside.norm();
  return std::min({a.dot(aside), b.dot(aside), c.dot(aside)}) <= bound;
}

// Whether a point of the triangle lies in the cylinder of the given radius along `down` from p, between depths above 0
// and `reach`. The triangle is cut to the slab of depths, then seen along the axis. The layer that passes through p
// itself does not lie below it.
bool meets_cylinder(const std::array<Vec3, 3>& triangle, const Vec3& p, const Vec3& down, double reach, double radius) {
  std::array<Vec3, 8> polygon;
  std::array<double, 8> depth;
  int count = 3;
  for (int c = 0; c < 3; ++c) depth[c] = (triangle[c] - p).dot(down);
  if (std::min({depth[0], depth[1], depth[2]}) > reach || std::max({depth[0], depth[1], depth[2]}) < 1e-6 * reach)
    return false;
  for (int c = 0; c < 3; ++c) polygon[c] = triangle[c] - p;
  const auto cut = [&](double bound, double sign) {
    std::array<Vec3, 8> kept;
    std::array<double, 8> kept_depth;
    int n = 0;
    for (int i = 0; i < count; ++i) {
      const int j = (i + 1) % count;
      const double a = sign * (depth[i] - bound), b = sign * (depth[j] - bound);
      if (a >= 0.0) kept[n] = polygon[i], kept_depth[n++] = depth[i];
      if ((a > 0.0 && b < 0.0) || (a < 0.0 && b > 0.0)) {
        kept[n] = polygon[i] + a / (a - b) * (polygon[j] - polygon[i]);
        kept_depth[n++] = bound;
      }
    }
    polygon = kept;
    depth = kept_depth;
    count = n;
  };
  cut(1e-6 * reach, 1.0);
  if (count == 0) return false;
  cut(reach, -1.0);
  if (count == 0) return false;
  for (int i = 0; i < count; ++i) polygon[i] -= depth[i] * down;
  bool positive = false, negative = false;
  for (int i = 0; i < count; ++i) {
    const Vec3 &a = polygon[i], &b = polygon[(i + 1) % count];
    if (closest_point_on_segment(Vec3::Zero(), a, b).squaredNorm() <= radius * radius) return true;
    const double side = a.cross(b).dot(down);
    positive = positive || side > 0.0;
    negative = negative || side < 0.0;
  }
  return count >= 3 && positive != negative;  // the axis passes through the polygon
}

// What lies under the samples. Each one looks for itself, so the order of the threads does not matter.
class Coverage {
 public:
  Coverage(const Subject& subject, const PrintedGrids& grids) : subject_(subject), grids_(grids) {}

  [[nodiscard]] std::uint8_t operator()(const Sample& sample) const {
    std::uint8_t found = 0;
    if (on_platform(sample) || reached(sample, Material::model, 0.5 * subject_.options.bead_width_mm, 0.0)) found |= kByModel;
    if (reached(sample, Material::support, subject_.options.leaf_radius_mm, subject_.options.top_gap_mm)) found |= kBySupport;
    return found;
  }

 private:
  static bool on_platform(const Sample& sample) { return -sample.down.z() * sample.thickness >= sample.position.z(); }

  [[nodiscard]] bool reached(const Sample& sample, Material material, double radius, double gap) const {
    const PrintedGrid& grid = grids_[static_cast<int>(material)];
    return grid.visit_below(sample.position, sample.down, sample.thickness, gap, radius, [&](Index t) {
      const std::array<Vec3, 3> corners = corners_of(subject_.printed, t);
      if (!near_line(corners, sample.position, sample.down, radius)) return false;
      const double reach = 1.5 * std::max(sample.thickness, grid.thickness(t)) + gap;
      return meets_cylinder(corners, sample.position, sample.down, reach, radius);
    });
  }

  const Subject& subject_;
  const PrintedGrids& grids_;
};

}  // namespace

void prove_coverage(const Subject& subject, const PrintedGrids& grids, const std::vector<Index>& blocked_faces,
                    SupportCertificate& certificate) {
  const auto hangs = overhanging_faces(subject, blocked_faces, certificate.blocked_area_mm2);
  const auto samples = sample_faces(subject, hangs);
  certificate.samples = static_cast<Index>(samples.size());
  if (samples.empty()) return;
  const Coverage coverage(subject, grids);
  std::vector<std::uint8_t> covered(samples.size());
  parallel_for(samples.size(), 256, subject.run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t s = begin; s < end; ++s) covered[s] = coverage(samples[s]);
  });

  double by_model = 0.0;
  for (std::size_t s = 0; s < samples.size(); ++s) {
    certificate.overhang_area_mm2 += samples[s].area;
    if (covered[s] & kByModel) by_model += samples[s].area;
    if (covered[s] != 0) continue;
    certificate.uncovered_area_mm2 += samples[s].area;
    if (certificate.uncovered.empty() || certificate.uncovered.back().face != samples[s].face) {
      certificate.uncovered.push_back({samples[s].face, 0.0});
    }
    certificate.uncovered.back().area_mm2 += samples[s].area;
  }
  certificate.covered_fraction = 1.0 - certificate.uncovered_area_mm2 / certificate.overhang_area_mm2;
  certificate.floor_fraction = by_model / certificate.overhang_area_mm2;
}

}  // namespace curvesup::certificate
