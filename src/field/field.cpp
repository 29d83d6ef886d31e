#include "curvesup/field/field.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
#include <queue>
#include <utility>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "field/vector_field.h"
#include "field/vertex_plateaus.h"

namespace curvesup {

namespace {

Index size_of(const auto& container) { return static_cast<Index>(container.size()); }

void check_count(const std::string& where, const char* what, std::size_t found, std::size_t wanted, const char* of) {
  if (found == wanted) return;
  throw Error(ErrorKind::input, where, format("%zu %s for %zu %s", found, what, wanted, of),
              "the field's file must belong to this mesh");
}

std::vector<double> raw_values(const Model& model, const FieldInput& input, const FieldOptions& options,
                               const RunContext& run, FieldReport& report) {
  const TetMesh& mesh = model.mesh;
  switch (options.source) {
    case FieldSource::direction: {
      if (!options.direction.allFinite() || options.direction.norm() <= 0.0) {
        throw Error(ErrorKind::usage, "field.direction", "a direction needs a length above 0");
      }
      const Vec3 unit = options.direction.normalized();
      std::vector<double> value(mesh.vertices.size());
      std::transform(mesh.vertices.begin(), mesh.vertices.end(), value.begin(),
                     [&](const Vec3& p) { return unit.dot(p); });
      return value;
    }
    case FieldSource::scalar_file: {
      check_count(input.where, "values", input.vertex_value.size(), mesh.vertices.size(), "vertices");
      for (Index v = 0; v < size_of(mesh.vertices); ++v) {
        if (!std::isfinite(input.vertex_value[v])) {
          throw Error(ErrorKind::input, input.where + format(", vertex %d", v), "value is no finite number",
                      "mend the field's file");
        }
      }
      return input.vertex_value;
    }
    case FieldSource::vector_file: {
      check_count(input.where, "vectors", input.tet_vector.size(), mesh.tets.size(), "tets");
      std::vector<Vec3> placed(mesh.tets.size());
      for (Index t = 0; t < size_of(mesh.tets); ++t) {
        placed[t] = model.rotation * input.tet_vector[t];
        if (!placed[t].allFinite()) {
          throw Error(ErrorKind::input, input.where + format(", tet %d", t), "vector is no finite number",
                      "mend the field's file");
        }
      }
      if (std::all_of(placed.begin(), placed.end(), [](const Vec3& v) { return v.isZero(0.0); })) {
        throw Error(ErrorKind::input, input.where, "every vector is zero: there is no print direction",
                    "give vectors that point from the first layer to the last");
      }
      auto solved = integrate_vector_field(mesh, placed, run);
      report.solve_residual = solved.relative_residual;
      return std::move(solved.value);
    }
  }
  throw Error(ErrorKind::internal, "field", "unknown source");
}

std::vector<char> used_vertices(const TetMesh& mesh) {
  std::vector<char> used(mesh.vertices.size(), 0);
  for (const auto& tet : mesh.tets) {
    for (const Index v : tet) used[v] = 1;
  }
  return used;
}

void normalise(std::vector<double>& value, const std::vector<char>& used, const std::string& where, FieldReport& report) {
  double low = std::numeric_limits<double>::max(), high = -low;
  for (std::size_t v = 0; v < value.size(); ++v) {
    if (!used[v]) continue;
    low = std::min(low, value[v]);
    high = std::max(high, value[v]);
  }
  report.input_min = low;
  report.input_max = high;
  const double range = high - low;
  if (!std::isfinite(range)) {
    throw Error(ErrorKind::input, where, "the field's values, " + shortest(low) + " to " + shortest(high) + ", are too large",
                "scale them down");
  }
  // A range that rounding alone could make is no field.
  if (!(range > 1e-12 * std::max(std::abs(low), std::abs(high)))) {
    throw Error(ErrorKind::input, where, "the field is constant (" + shortest(low) + "): it has no print direction",
                "give a field that grows from the first layer to the last");
  }
  for (std::size_t v = 0; v < value.size(); ++v) {
    value[v] = used[v] ? std::clamp((value[v] - low) / range, 0.0, 1.0) : 0.0;
  }
}

// Mean values over the lowest and over the highest vertices (within 1e-6 of the diagonal) are compared.
bool runs_downward(const TetMesh& mesh, const std::vector<char>& used, const std::vector<double>& value) {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::max()), high = -low;
  for (Index v = 0; v < size_of(mesh.vertices); ++v) {
    if (!used[v]) continue;
    low = low.cwiseMin(mesh.vertices[v]);
    high = high.cwiseMax(mesh.vertices[v]);
  }
  const double tolerance = 1e-6 * (high - low).norm();
  double sum[2] = {0.0, 0.0};
  double count[2] = {0.0, 0.0};
  for (Index v = 0; v < size_of(mesh.vertices); ++v) {
    if (!used[v]) continue;
    const double z = mesh.vertices[v].z();
    if (z <= low.z() + tolerance) sum[0] += value[v], ++count[0];
    if (z >= high.z() - tolerance) sum[1] += value[v], ++count[1];
  }
  return sum[0] / count[0] > sum[1] / count[1];
}

double weighted_median(const TetMesh& mesh, const std::vector<double>& of_tet) {
  std::vector<Index> order(of_tet.size());
  std::iota(order.begin(), order.end(), 0);
  std::sort(order.begin(), order.end(),
            [&](Index a, Index b) { return of_tet[a] != of_tet[b] ? of_tet[a] < of_tet[b] : a < b; });
  std::vector<double> below(order.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < order.size(); ++i) below[i] = sum += tet_volume(mesh, order[i]);
  const auto middle = std::lower_bound(below.begin(), below.end(), 0.5 * sum);
  return of_tet[order[std::min<std::size_t>(middle - below.begin(), order.size() - 1)]];
}

std::vector<double> gradient_lengths(const ScalarField& field) {
  std::vector<double> length(field.gradient.size());
  std::transform(field.gradient.begin(), field.gradient.end(), length.begin(), [](const Vec3& g) { return g.norm(); });
  return length;
}

void report_gradients(const Model& model, const ScalarField& field, const FieldInput& input,
                      const FieldOptions& options, FieldReport& report) {
  const auto length = gradient_lengths(field);
  const auto [low, high] = std::minmax_element(length.begin(), length.end());
  report.grad_min = *low;
  report.grad_max = *high;
  report.grad_median = weighted_median(model.mesh, length);
  const double sign = report.flipped ? -1.0 : 1.0;
  for (Index t = 0; t < size_of(length); ++t) {
    if (length[t] < 1e-3 * report.grad_median) report.weak_tets.push_back(t);
    Vec3 wanted = Vec3::Zero();
    if (options.source == FieldSource::vector_file) {
      wanted = sign * (model.rotation * input.tet_vector[t]);
    } else {
      for (const Index other : model.topology.neighbours[t]) {
        if (other != kNone) wanted += field.gradient[other];
      }
    }
    if (wanted.dot(field.gradient[t]) < 0.0) report.inverted_tets.push_back(t);
  }
}

std::vector<char> boundary_vertices(const Model& model) {
  std::vector<char> on_boundary(model.mesh.vertices.size(), 0);
  for (const auto& face : model.boundary) {
    for (const Index v : face.vertices) on_boundary[v] = 1;
  }
  return on_boundary;
}

void report_extrema(const Model& model, const ScalarField& field, FieldReport& report) {
  const std::vector<char> on_boundary = boundary_vertices(model);
  const auto interior = [&](const VertexPlateaus& plateaus) {
    std::vector<Index> found;
    for (const Index p : plateaus.minima()) {
      const auto members = plateaus.members(p);
      if (std::none_of(members.begin(), members.end(), [&](Index v) { return on_boundary[v]; }))
        found.push_back(members[0]);
    }
    return found;
  };
  std::vector<double> negated(field.value.size());
  std::transform(field.value.begin(), field.value.end(), negated.begin(), [](double g) { return -g; });
  report.interior_minima = interior(VertexPlateaus(model.mesh, field.value));
  report.interior_maxima = interior(VertexPlateaus(model.mesh, negated));
}

// Vertices that share an edge.
std::vector<std::vector<Index>> vertex_neighbours(const TetMesh& mesh) {
  std::vector<std::vector<Index>> neighbours(mesh.vertices.size());
  for (const auto& tet : mesh.tets) {
    for (const auto& [i, j] : kTetEdge) {
      neighbours[tet[i]].push_back(tet[j]);
      neighbours[tet[j]].push_back(tet[i]);
    }
  }
  return neighbours;
}

// The lowest value that has to be climbed to from a minimum, before the boundary or a lower vertex is reached.
double rim_of_basin(const std::vector<std::vector<Index>>& neighbours, const std::vector<char>& on_boundary,
                    const std::vector<double>& value, Index minimum) {
  using Step = std::pair<double, Index>;
  std::priority_queue<Step, std::vector<Step>, std::greater<>> next;
  std::vector<char> seen(value.size(), 0);
  next.push({value[minimum], minimum});
  seen[minimum] = 1;
  double rim = value[minimum];
  while (!next.empty()) {
    const auto [height, v] = next.top();
    next.pop();
    rim = std::max(rim, height);
    if (on_boundary[v] || height < value[minimum]) break;
    for (const Index other : neighbours[v]) {
      if (!seen[other]) next.push({value[other], other});
      seen[other] = 1;
    }
  }
  return rim;
}

}  // namespace

std::optional<ClosedLayers> find_closed_layers(const Model& model, const ScalarField& field, const FieldReport& report, int layer_count) {
  if (report.interior_minima.empty() && report.interior_maxima.empty()) return std::nullopt;
  const auto neighbours = vertex_neighbours(model.mesh);
  const std::vector<char> on_boundary = boundary_vertices(model);
  std::optional<ClosedLayers> most;
  for (const bool minimum : {true, false}) {
    std::vector<double> value = field.value;
    if (!minimum) std::transform(value.begin(), value.end(), value.begin(), [](double g) { return 1.0 - g; });
    // Layers are at (k + 1/2) / N, from below as from above.
    const auto layers_below = [&](double g) { return static_cast<int>(std::floor(g * layer_count + 0.5)); };
    for (const Index v : minimum ? report.interior_minima : report.interior_maxima) {
      const int count = layers_below(rim_of_basin(neighbours, on_boundary, value, v)) - layers_below(value[v]);
      if (count > (most ? most->count : 0)) most = ClosedLayers{v, minimum, count};
    }
  }
  return most;
}

FieldResult compute_field(const Model& model, const FieldInput& input, const FieldOptions& options,
                          const RunContext& run) {
  FieldResult result;
  auto value = raw_values(model, input, options, run, result.report);
  const auto used = used_vertices(model.mesh);
  normalise(value, used, input.where, result.report);
  if (runs_downward(model.mesh, used, value)) {
    result.report.flipped = true;
    for (std::size_t v = 0; v < value.size(); ++v) value[v] = used[v] ? 1.0 - value[v] : 0.0;
  }
  result.field = make_scalar_field(model.mesh, std::move(value));
  report_gradients(model, result.field, input, options, result.report);
  report_extrema(model, result.field, result.report);
  return result;
}

double median_gradient(const Model& model, const ScalarField& field) {
  return weighted_median(model.mesh, gradient_lengths(field));
}

int layer_count_for_thickness(const Model& model, const ScalarField& field, double thickness_mm) {
  constexpr double kMostLayers = 1e6;
  if (!(thickness_mm > 0.0) || !std::isfinite(thickness_mm)) {
    throw Error(ErrorKind::usage, "layers.thickness_mm", shortest(thickness_mm) + " is no thickness",
                "must be above 0");
  }
  const double count = std::round(1.0 / (thickness_mm * median_gradient(model, field)));
  if (!(count <= kMostLayers)) {
    throw Error(ErrorKind::usage, "layers.thickness_mm",
                shortest(thickness_mm) + " asks for more than a million layers", "use a larger thickness");
  }
  return std::max(1, static_cast<int>(count));
}

}  // namespace curvesup
