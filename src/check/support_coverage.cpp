#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <limits>

#include "check/support_parts.h"
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

// Samples by cell, so that each printed triangle finds the few that it may lie below.
struct SampleGrid {
  CellGrid grid;
  std::vector<Index> first, sample;

  SampleGrid(const std::vector<Sample>& samples, double cell_mm) {
    Vec3 low = samples[0].position, high = low;
    for (const Sample& s : samples) {
      low = low.cwiseMin(s.position);
      high = high.cwiseMax(s.position);
    }
    low_ = low;
    high_ = high;
    grid = CellGrid(low, high, cell_mm);
    first.assign(grid.cells() + 1, 0);
    for (const Sample& s : samples) ++first[grid.index(grid.cell_of(s.position)) + 1];
    for (std::size_t c = 0; c < grid.cells(); ++c) first[c + 1] += first[c];
    sample.resize(samples.size());
    std::vector<Index> next(first.begin(), first.end() - 1);
    for (Index s = 0; s < static_cast<Index>(samples.size()); ++s)
      sample[next[grid.index(grid.cell_of(samples[s].position))]++] = s;
  }
  [[nodiscard]] bool outside(const Vec3& low, const Vec3& high) const {
    return (high.array() < low_.array()).any() || (low.array() > high_.array()).any();
  }

 private:
  Vec3 low_, high_;
};

class Coverage {
 public:
  Coverage(const Subject& subject, const std::vector<Sample>& samples)
      : subject_(subject), samples_(samples), grid_(samples, 2.0), covered_(samples.size()), open_(grid_.grid.cells()) {
    for (std::size_t c = 0; c < grid_.grid.cells(); ++c)
      open_[c][0] = open_[c][1] = grid_.first[c + 1] - grid_.first[c];
    for (const Sample& s : samples) thickest_ = std::max(thickest_, s.thickness);
  }

  void add_platform() {
    for (std::size_t s = 0; s < samples_.size(); ++s) {
      const Sample& sample = samples_[s];
      if (-sample.down.z() * sample.thickness >= sample.position.z()) {
        covered_[s] |= kByModel;
        --open_[grid_.grid.index(grid_.grid.cell_of(sample.position))][0];
      }
    }
  }

  void add(const Sheet& sheet) {
    const auto& options = subject_.options;
    const bool support = sheet.material == Material::support;
    const double radius = support ? options.leaf_radius_mm : 0.5 * options.bead_width_mm;
    const double gap = support ? options.top_gap_mm : 0.0;
    const std::uint8_t bit = support ? kBySupport : kByModel;
    const LayerStack& stack = subject_.printed;
    for (Index t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) {
      const auto& v = stack.triangles[t];
      const std::array<Vec3, 3> corners = {stack.vertices[v[0]], stack.vertices[v[1]], stack.vertices[v[2]]};
      const double thickness = subject_.thickness(stack.triangle_tet[t], sheet.passes);
      const double most = 1.5 * std::max(thickness, thickest_) + gap;
      const Vec3 around = Vec3::Constant(std::hypot(most, radius));
      const Vec3 low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]) - around;
      const Vec3 high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]) + around;
      if (grid_.outside(low, high)) continue;
      grid_.grid.visit(low, high, [&](std::size_t cell) {
        auto& open = open_[cell][support];
        if (open.load(std::memory_order_relaxed) == 0) return false;
        for (Index i = grid_.first[cell]; i < grid_.first[cell + 1]; ++i) {
          const Index s = grid_.sample[i];
          if (covered_[s].load(std::memory_order_relaxed) & bit) continue;
          const Sample& sample = samples_[s];
          const Vec3& q = sample.position;
          if ((q.array() < low.array()).any() || (q.array() > high.array()).any()) continue;
          const double reach = 1.5 * std::max(thickness, sample.thickness) + gap;
          if (!meets_cylinder(corners, q, sample.down, reach, radius)) continue;
          if (!(covered_[s].fetch_or(bit, std::memory_order_relaxed) & bit))
            open.fetch_sub(1, std::memory_order_relaxed);
        }
        return false;
      });
    }
  }

  [[nodiscard]] std::uint8_t operator[](std::size_t s) const { return covered_[s].load(std::memory_order_relaxed); }

 private:
  const Subject& subject_;
  const std::vector<Sample>& samples_;
  SampleGrid grid_;
  std::vector<std::atomic<std::uint8_t>> covered_;  // bits are only ever set: the order of the threads does not matter
  // By cell and material, samples that are not covered yet: full cells are passed over.
  std::vector<std::array<std::atomic<Index>, 2>> open_;
  double thickest_ = 0.0;
};

}  // namespace

void prove_coverage(const Subject& subject, const std::vector<Index>& blocked_faces, SupportCertificate& certificate) {
  const auto hangs = overhanging_faces(subject, blocked_faces, certificate.blocked_area_mm2);
  const auto samples = sample_faces(subject, hangs);
  certificate.samples = static_cast<Index>(samples.size());
  if (samples.empty()) return;
  Coverage coverage(subject, samples);
  coverage.add_platform();
  const auto& sheets = subject.printed.sheets;
  parallel_for(sheets.size(), 4, subject.run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t s = begin; s < end; ++s) coverage.add(sheets[s]);
  });

  double by_model = 0.0;
  for (std::size_t s = 0; s < samples.size(); ++s) {
    certificate.overhang_area_mm2 += samples[s].area;
    if (coverage[s] & kByModel) by_model += samples[s].area;
    if (coverage[s] != 0) continue;
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
