#include "curvesup/overhang/overhang.h"

#include <algorithm>
#include <limits>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"
#include "field/vertex_plateaus.h"

namespace curvesup {

namespace {

Index size_of(const auto& container) { return static_cast<Index>(container.size()); }

// Twice the area along the outward normal.
Vec3 face_area_normal(const Model& model, const BoundaryFace& face) {
  const auto& p = model.mesh.vertices;
  return (p[face.vertices[1]] - p[face.vertices[0]]).cross(p[face.vertices[2]] - p[face.vertices[0]]);
}

std::vector<char> vertices_on_platform(const Model& model) {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::max()), high = -low;
  for (const auto& face : model.boundary) {
    for (const Index v : face.vertices) {
      low = low.cwiseMin(model.mesh.vertices[v]);
      high = high.cwiseMax(model.mesh.vertices[v]);
    }
  }
  const double tolerance = 1e-6 * (high - low).norm();
  std::vector<char> on(model.mesh.vertices.size());
  for (std::size_t v = 0; v < on.size(); ++v) on[v] = std::abs(model.mesh.vertices[v].z()) < tolerance;
  return on;
}

enum FaceState : char { kFine, kPlatform, kOverhang };

std::vector<char> classify_faces(const Model& model, const ScalarField& field, const std::vector<char>& on_platform,
                                 double sine, const RunContext& run) {
  std::vector<char> state(model.boundary.size(), kFine);
  parallel_for(model.boundary.size(), 8192, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t f = begin; f < end; ++f) {
      const BoundaryFace& face = model.boundary[f];
      if (on_platform[face.vertices[0]] && on_platform[face.vertices[1]] && on_platform[face.vertices[2]]) {
        state[f] = kPlatform;
        continue;
      }
      const Vec3 n = face_area_normal(model, face).normalized();
      if (n.dot(print_direction(field, face.tet)) + sine <= 0.0) state[f] = kOverhang;
    }
  });
  return state;
}

// Area-weighted sum of -d_p over the faces around each vertex for which take(face) holds.
std::vector<Vec3> direction_sums(const Model& model, const ScalarField& field, const auto& take) {
  std::vector<Vec3> sum(model.mesh.vertices.size(), Vec3::Zero());
  for (Index f = 0; f < size_of(model.boundary); ++f) {
    if (!take(f)) continue;
    const BoundaryFace& face = model.boundary[f];
    const Vec3 weighted = face_area_normal(model, face).norm() * print_direction(field, face.tet);
    for (const Index v : face.vertices) sum[v] -= weighted;
  }
  return sum;
}

// Opposite directions around a vertex may cancel; then straight down is as good as any.
Vec3 unit_or_down(const Vec3& v) {
  const double length = v.norm();
  return length > 1e-12 ? Vec3(v / length) : Vec3(-Vec3::UnitZ());
}

// As faces_in_regions; a region without a face is most often one in another frame, and the log names it.
std::vector<char> faces_of(const Model& model, const std::vector<Region>& regions, const char* key, const RunContext& run) {
  std::vector<char> all(model.boundary.size(), 0);
  for (std::size_t r = 0; r < regions.size(); ++r) {
    const auto in = faces_in_regions(model, {regions[r]});
    bool any = false;
    for (std::size_t f = 0; f < in.size(); ++f) {
      any = any || in[f];
      all[f] = all[f] || in[f];
    }
    if (!any) {
      run.log(LogLevel::warning,
              format("region %zu of support.%s holds no face of the model (it lies in the placed frame: mm, z up)", r + 1, key));
    }
  }
  return all;
}

}  // namespace

Overhang find_overhang(const Model& model, const ScalarField& field, const OverhangOptions& options,
                       const RunContext& run) {
  if (!(options.self_support >= Angle::degrees(0)) || !(options.self_support < Angle::degrees(90))) {
    throw Error(ErrorKind::usage, "support.self_support_angle_deg",
                shortest(options.self_support.degrees()) + " is out of range", "must be at least 0 and below 90");
  }
  const auto on_platform = vertices_on_platform(model);
  const auto state = classify_faces(model, field, on_platform, options.self_support.sin(), run);
  const auto enforce = faces_of(model, options.enforce, "enforce", run), block = faces_of(model, options.block, "block", run);

  Overhang overhang;
  // Touched: by a face that overhangs, blocked or not, or by a blocked face; a minimum there is no case of its own.
  std::vector<char> taken(model.boundary.size(), 0);
  std::vector<char> touched(model.mesh.vertices.size(), 0), on_boundary(model.mesh.vertices.size(), 0);
  std::vector<char> of_overhang(model.mesh.vertices.size(), 0);
  for (Index f = 0; f < size_of(model.boundary); ++f) {
    const double area = 0.5 * face_area_normal(model, model.boundary[f]).norm();
    const bool hangs = state[f] == kOverhang, wanted = hangs || (enforce[f] && state[f] != kPlatform);
    taken[f] = wanted && !block[f];
    if (taken[f]) {
      overhang.faces.push_back(f);
      overhang.area_mm2 += area;
      if (!hangs) {
        overhang.enforced.push_back(f);
        overhang.enforced_area_mm2 += area;
      }
    } else if (hangs) {
      overhang.blocked.push_back(f);
      overhang.blocked_area_mm2 += area;
    }
    for (const Index v : model.boundary[f].vertices) {
      on_boundary[v] = 1;
      of_overhang[v] |= taken[f];
      touched[v] |= taken[f] || block[f];
    }
  }
  const auto overhang_sum = direction_sums(model, field, [&](Index f) { return taken[f]; });
  for (Index v = 0; v < size_of(of_overhang); ++v) {
    if (!of_overhang[v]) continue;
    overhang.vertices.push_back(v);
    overhang.vertex_direction.push_back(unit_or_down(overhang_sum[v]));
  }

  const auto boundary_sum = direction_sums(model, field, [](Index) { return true; });
  const VertexPlateaus plateaus(model.mesh, field.value);
  for (const Index group : plateaus.minima()) {
    // A plateau counts once, by its lowest boundary vertex, and not at all when it stands on something or is held
    // already.
    Index first = kNone;
    bool held = false;
    for (const Index v : plateaus.members(group)) {
      held = held || on_platform[v] || touched[v];
      if (first == kNone && on_boundary[v]) first = v;
    }
    if (held || first == kNone) continue;
    overhang.minima.push_back(first);
  }
  std::sort(overhang.minima.begin(), overhang.minima.end());
  for (const Index v : overhang.minima) overhang.minimum_direction.push_back(unit_or_down(boundary_sum[v]));
  return overhang;
}

}  // namespace curvesup
