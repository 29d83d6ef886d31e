#include "curvesup/model/place.h"

#include <cmath>
#include <numbers>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "model/mesh_checks.h"

namespace curvesup {

namespace {

using namespace mesh_checks;

struct CosSin {
  double cos, sin;
};

// Exact for multiples of 90 degrees, so that a quarter turn keeps flat faces flat.
CosSin turn(double degrees) {
  const double quarters = degrees / 90.0;
  if (quarters == std::floor(quarters)) {
    constexpr CosSin kQuarter[4] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    return kQuarter[static_cast<int>(std::fmod(std::fmod(quarters, 4.0) + 4.0, 4.0))];
  }
  const double radians = degrees * std::numbers::pi / 180.0;
  return {std::cos(radians), std::sin(radians)};
}

Mat3 up_axis_rotation(const std::string& axis) {
  Mat3 m = Mat3::Identity();
  if (axis == "y") {
    m << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  } else if (axis == "x") {
    m << 0, 0, -1, 0, 1, 0, 1, 0, 0;
  } else if (axis != "z") {
    throw Error(ErrorKind::usage, "model.up_axis", "\"" + axis + "\" is no axis", "use x, y or z");
  }
  return m;
}

void check_options(const PlaceOptions& options) {
  if (!(options.scale > 0.0) || !std::isfinite(options.scale)) {
    throw Error(ErrorKind::usage, "model.scale", shortest(options.scale) + " is no scale", "must be a number above 0");
  }
  if (!options.rotate_deg.allFinite()) throw Error(ErrorKind::usage, "model.rotate_deg", "not a finite number");
  if (!options.translate_mm.allFinite()) throw Error(ErrorKind::usage, "model.translate_mm", "not a finite number");
}

template <typename Elements>
[[noreturn]] void refuse(const std::string& name, const char* element, const Elements& found, const std::string& what,
                         const std::string& remedy) {
  constexpr std::size_t kNamed = 5;
  std::string where = name + ", " + element;
  for (std::size_t i = 0; i < found.size() && i < kNamed; ++i) {
    where += i == 0 ? " " : ", ";
    if constexpr (std::is_same_v<typename Elements::value_type, Index>) {
      where += std::to_string(found[i]);
    } else {
      for (std::size_t c = 0; c < found[i].size(); ++c) where += (c ? "-" : "") + std::to_string(found[i][c]);
    }
  }
  if (found.size() > kNamed) where += format(" and %zu more", found.size() - kNamed);
  throw Error(ErrorKind::input, where, what, remedy);
}

// Moves tets to the first of equal vertices; the number of vertices that lost their tets that way.
Index weld_duplicates(TetMesh& mesh) {
  const auto first = first_of_equal_vertices(mesh);
  Index duplicates = 0;
  for (Index v = 0; v < static_cast<Index>(first.size()); ++v) duplicates += first[v] != v;
  if (duplicates > 0) {
    for (auto& tet : mesh.tets) {
      for (Index& v : tet) v = first[v];
    }
  }
  return duplicates;
}

void check_raw(const std::string& name, const TetMesh& mesh) {
  if (mesh.tets.empty()) throw Error(ErrorKind::input, name, "the mesh has no tets", "export a tetrahedral mesh");
  if (const auto bad = tets_out_of_range(mesh); !bad.empty()) {
    refuse(name, "tet", bad, format("vertex index outside 0 .. %d", static_cast<int>(mesh.vertices.size()) - 1),
           "indices start at 0");
  }
  if (const auto bad = vertices_not_finite(mesh); !bad.empty()) {
    refuse(name, "vertex", bad, "coordinate is no finite number", "mend the file");
  }
}

Index orient_tets(const std::string& name, TetMesh& mesh) {
  const auto volumes = classify_volumes(mesh, bounding_box(mesh).diagonal());
  if (!volumes.zero.empty()) {
    refuse(name, "tet", volumes.zero, "tet without volume (below 1e-12 of the bounding-box diagonal cubed)",
           "remesh, or collapse the tet");
  }
  for (const Index t : volumes.negative) std::swap(mesh.tets[t][2], mesh.tets[t][3]);
  const auto faces = classify_faces(mesh);
  if (!faces.overfull.empty()) {
    refuse(name, "face", faces.overfull, "more than two tets on a face", "remove the overlapping tets");
  }
  if (!faces.overlapping.empty()) {
    refuse(name, "tets", faces.overlapping,
           volumes.negative.empty() ? "tets overlap: both lie on the same side of their common face"
                                    : "tets of mixed orientation that swapping cannot mend: some are inside out",
           "remesh the model");
  }
  return static_cast<Index>(volumes.negative.size());
}

void check_boundary(const std::string& name, const Model& model) {
  std::vector<std::array<Index, 3>> faces;
  faces.reserve(model.boundary.size());
  for (const auto& face : model.boundary) faces.push_back(face.vertices);
  const auto manifold = check_manifold(faces, model.mesh.vertices.size());
  if (!manifold.bad_edges.empty()) {
    refuse(name, "edge", manifold.bad_edges, "the boundary touches itself along an edge",
           "join the parts by volume there, or move them apart");
  }
  if (!manifold.bad_vertices.empty()) {
    refuse(name, "vertex", manifold.bad_vertices, "the boundary touches itself in a vertex",
           "join the parts by volume there, or move them apart");
  }
}

void place(TetMesh& mesh, const PlaceOptions& options, const Mat3& rotation) {
  for (Vec3& p : mesh.vertices) p = rotation * (options.scale * p) + options.translate_mm;
  if (options.drop_to_platform) {
    const double low = bounding_box(mesh).low.z();
    for (Vec3& p : mesh.vertices) p.z() -= low;
  }
}

}  // namespace

Mat3 placement_rotation(const PlaceOptions& options) {
  const CosSin x = turn(options.rotate_deg.x()), y = turn(options.rotate_deg.y()), z = turn(options.rotate_deg.z());
  Mat3 rx, ry, rz;
  rx << 1, 0, 0, 0, x.cos, -x.sin, 0, x.sin, x.cos;
  ry << y.cos, 0, y.sin, 0, 1, 0, -y.sin, 0, y.cos;
  rz << z.cos, -z.sin, 0, z.sin, z.cos, 0, 0, 0, 1;
  return rz * ry * rx * up_axis_rotation(options.up_axis);
}

ModelResult load_model(std::string name, TetMesh file_mesh, const PlaceOptions& options, const RunContext& run) {
  check_options(options);
  check_raw(name, file_mesh);
  ModelResult result;
  Model& model = result.model;
  ModelReport& report = result.report;
  model.mesh = std::move(file_mesh);
  model.rotation = placement_rotation(options);

  report.unreferenced_vertices = static_cast<Index>(unreferenced_vertices(model.mesh).size());
  report.duplicate_vertices = weld_duplicates(model.mesh);
  report.flipped_tets = orient_tets(name, model.mesh);
  run.check_stop();
  model.topology = build_topology(model.mesh);
  model.boundary = boundary_faces(model.mesh, model.topology);
  check_boundary(name, model);
  place(model.mesh, options, model.rotation);

  const Shape shape = measure_shape(model.mesh, model.topology, model.boundary);
  const Box box = bounding_box(model.mesh);
  report.vertices = static_cast<Index>(model.mesh.vertices.size());
  report.tets = static_cast<Index>(model.mesh.tets.size());
  report.boundary_faces = static_cast<Index>(model.boundary.size());
  report.volume_mm3 = total_volume(model.mesh);
  report.genus = shape.genus;
  report.components = shape.components;
  report.cavities = shape.cavities;
  report.low = box.low;
  report.high = box.high;
  model.name = std::move(name);
  return result;
}

}  // namespace curvesup
