// make_models FOLDER [NAME]: writes the models that the project ships (data/), each as model.tet, field.txt,
// config.json and expected.json, and proves what expected.json says. Same program, same bytes.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <numeric>
#include <string>

#include "curvesup/core/angle.h"
#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/io/tet_file.h"
#include "curvesup/io/text_file.h"
#include "implicit_surface.h"
#include "shipped_models.h"
#include "tetgen_mesher.h"

namespace {

using namespace curvesup;
using make_models::ShippedModel;
using Json = nlohmann::ordered_json;

constexpr double kLayerThickness = 0.7;  // mm, the median that layers.count is chosen for

[[noreturn]] void fail(const std::string& model, const std::string& what) {
  throw Error(ErrorKind::geometry, model, what);
}

// Few digits keep the files small: micrometres for coordinates, a millionth for G.
void round_coordinates(std::vector<Vec3>& points) {
  for (Vec3& p : points) {
    for (int a = 0; a < 3; ++a) p[a] = std::round(p[a] * 1000.0) / 1000.0 + 0.0;
  }
}

// Potential at the vertices, mapped to [0, 1].
std::vector<double> governing_field(const ShippedModel& model, const TetMesh& mesh) {
  std::vector<double> value;
  for (const Vec3& p : mesh.vertices) value.push_back(model.potential(p));
  const auto [low, high] = std::minmax_element(value.begin(), value.end());
  const double offset = *low, range = *high - *low;
  for (double& v : value) v = std::round((v - offset) / range * 1e6) / 1e6;
  return value;
}

struct FieldMeasure {
  double median = 0.0, min = 0.0, max = 0.0;  // |grad G| weighted by volume, 1/mm
  double max_tilt_deg = 0.0;
  int interior_extrema = 0;
};

FieldMeasure measure_field(const TetMesh& mesh, const std::vector<BoundaryFace>& boundary, const ScalarField& field) {
  FieldMeasure m;
  std::vector<std::pair<double, double>> weighted;  // |grad G|, volume
  double total = 0.0;
  for (Index t = 0; t < static_cast<Index>(mesh.tets.size()); ++t) {
    weighted.emplace_back(field.gradient[t].norm(), tet_volume(mesh, t));
    total += weighted.back().second;
    m.max_tilt_deg = std::max(m.max_tilt_deg, Angle::radians(std::acos(print_direction(field, t).z())).degrees());
  }
  std::sort(weighted.begin(), weighted.end());
  double sum = 0.0;
  for (const auto& [slope, volume] : weighted) {
    sum += volume;
    m.median = slope;
    if (sum >= 0.5 * total) break;
  }
  m.min = weighted.front().first;
  m.max = weighted.back().first;

  std::vector<char> on_boundary(mesh.vertices.size(), 0), has_lower(mesh.vertices.size(), 0),
      has_higher(mesh.vertices.size(), 0);
  for (const BoundaryFace& f : boundary) {
    for (const Index v : f.vertices) on_boundary[v] = 1;
  }
  for (const auto& tet : mesh.tets) {
    for (const Index a : tet) {
      for (const Index b : tet) {
        if (field.value[b] < field.value[a]) has_lower[a] = 1;
        if (field.value[b] > field.value[a]) has_higher[a] = 1;
      }
    }
  }
  for (std::size_t v = 0; v < mesh.vertices.size(); ++v)
    m.interior_extrema += !on_boundary[v] && !(has_lower[v] && has_higher[v]);
  return m;
}

void make(const ShippedModel& model, const std::filesystem::path& folder) {
  TriangleMesh surface = model.surface();
  round_coordinates(surface.vertices);
  if (!make_models::is_closed_manifold(surface)) fail(model.name, "the surface is no closed manifold");
  const auto topology = make_models::surface_topology(surface);
  if (topology.components != 1 || topology.genus != model.genus) {
    fail(model.name,
         "has genus " + std::to_string(topology.genus) + " in " + std::to_string(topology.components) + " components");
  }

  TetMesh mesh = make_models::fill_with_tets(surface, model.max_tet_volume_mm3);
  round_coordinates(mesh.vertices);
  for (Index t = 0; t < static_cast<Index>(mesh.tets.size()); ++t) {
    if (!(tet_volume(mesh, t) > 1e-5)) fail(model.name, "tet " + std::to_string(t) + " is flat");
  }
  const auto boundary = boundary_faces(mesh, build_topology(mesh));
  if (boundary.size() != surface.triangles.size()) fail(model.name, "the boundary is not the surface that was filled");

  const ScalarField field = make_scalar_field(mesh, governing_field(model, mesh));
  const FieldMeasure measure = measure_field(mesh, boundary, field);
  if (measure.interior_extrema > 0) fail(model.name, "G has an extremum inside");
  if (measure.max > 3.0 * measure.min) fail(model.name, "layers vary in thickness by more than 3");
  const int layers = static_cast<int>(std::lround(1.0 / (kLayerThickness * measure.median)));

  std::string values;
  for (const double v : field.value) values += shortest(v) + "\n";
  const Json config = {{"field", {{"source", "scalar_file"}, {"path", "field.txt"}}}, {"layers", {{"count", layers}}}};
  const Json expected = {{"model",
                          {{"vertices", mesh.vertices.size()},
                           {"tets", mesh.tets.size()},
                           {"boundary_faces", boundary.size()},
                           {"genus", topology.genus},
                           {"components", 1}}}};
  std::filesystem::create_directories(folder);
  write_tet_file(folder / "model.tet", mesh);
  write_file(folder / "field.txt", values);
  write_file(folder / "config.json", config.dump(2) + "\n");
  write_file(folder / "expected.json", expected.dump(2) + "\n");
  std::printf(
      "%s: %zu vertices, %zu tets, %zu boundary faces, genus %d, %.0f mm3, %d layers of %.2f to %.2f mm, tilt up to "
      "%.0f deg\n",
      model.name.c_str(), mesh.vertices.size(), mesh.tets.size(), boundary.size(), topology.genus, total_volume(mesh),
      layers, 1.0 / (layers * measure.max), 1.0 / (layers * measure.min), measure.max_tilt_deg);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2 || argc > 3) {
    std::fprintf(stderr, "usage: make_models FOLDER [NAME]\nexample: make_models data dome\n");
    return 2;
  }
  try {
    bool found = false;
    for (const ShippedModel& model : make_models::shipped_models()) {
      if (argc == 3 && model.name != argv[2]) continue;
      found = true;
      make(model, std::filesystem::path(argv[1]) / model.name);
    }
    if (!found) throw Error(ErrorKind::usage, argv[2], "no such model", "dome, arches, frame or block");
    return 0;
  } catch (const Error& error) {
    std::fprintf(stderr, "make_models: error %s\n", error.what());
    return exit_code(error.kind());
  }
}
