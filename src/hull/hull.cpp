#include "curvesup/hull/hull.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"
#include "curvesup/mesh/triangle_tree.h"
#include "core/angle_between.h"
#include "hull/convex_surface.h"
#include "mesh/tet_budget.h"

namespace curvesup {
namespace {

constexpr const char* kStage = "hull";
constexpr int kTurnsPerSelfSupportAngle = 20;
constexpr int kStepsPerKeptPoint = 4;
constexpr int kSides = 16;          // of the prism that a point is enlarged to
constexpr int kMaxAttempts = 6;
constexpr double kGrowth = 1.3;     // of the margin
constexpr double kShrink = 0.8;     // of the edge length
constexpr double kMarginPerEdge = 0.5;  // remeshing rounds the hull inwards by a part of the edge length
constexpr double kFreeFraction = 0.5;  // of the margin that must be left after remeshing

// Thickness of a layer where the gradient has the volume-weighted median length.
double median_thickness(const Model& model, const ScalarField& field, int layer_count) {
  std::vector<std::pair<double, double>> length_and_volume;
  double total = 0.0;
  for (Index t = 0; t < static_cast<Index>(model.mesh.tets.size()); ++t) {
    const double volume = tet_volume(model.mesh, t);
    length_and_volume.emplace_back(field.gradient[t].norm(), volume);
    total += volume;
  }
  std::sort(length_and_volume.begin(), length_and_volume.end());
  double sum = 0.0;
  for (const auto& [length, volume] : length_and_volume) {
    sum += volume;
    if (sum >= 0.5 * total && length > 0.0) return 1.0 / (layer_count * length);
  }
  throw Error(ErrorKind::input, kStage, "the field has no gradient anywhere", "give a field that grows upwards");
}

// One trajectory, thinned: a polyline that turns evenly is told within (turn of kStepsPerKeptPoint steps)²/8 of its radius,
// and the straight part below it by its two ends.
void trace(const Vec3& start, const Vec3& direction, double step, double turn, std::vector<Vec3>& points) {
  const Vec3 down(0, 0, -1);
  Vec3 axis = direction.cross(down);
  if (axis.norm() < 1e-12) axis = Vec3::UnitX();  // straight up or down: any axis
  axis.normalize();
  double left = angle_between(direction, down);
  Vec3 p = start, d = direction;
  points.push_back(p);
  for (int k = 1; p.z() > 0.0; ++k) {
    if (left <= 0.0) {
      p.z() = 0.0;
      break;
    }
    const Vec3 next = p + step * d;
    if (next.z() <= 0.0) {
      p += p.z() / (p.z() - next.z()) * (next - p);
      break;
    }
    p = next;
    const double angle = std::min(turn, left);
    left -= turn;
    d = left <= 0.0 ? down : Vec3(Eigen::AngleAxisd(angle, axis) * d);
    if (k % kStepsPerKeptPoint == 0 || left <= 0.0) points.push_back(p);
  }
  points.push_back(p);
}

std::vector<Vec3> trajectories(const Model& model, const Overhang& overhang, double step, double turn, const RunContext& run) {
  const std::size_t vertices = overhang.vertices.size();
  const std::size_t count = vertices + overhang.minima.size();
  constexpr std::size_t kGrain = 1024;
  std::vector<std::vector<Vec3>> parts(chunk_count(count, kGrain));
  parallel_for(count, kGrain, run, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    for (std::size_t i = begin; i < end; ++i) {
      const bool minimum = i >= vertices;
      const Index v = minimum ? overhang.minima[i - vertices] : overhang.vertices[i];
      const Vec3& d = minimum ? overhang.minimum_direction[i - vertices] : overhang.vertex_direction[i];
      trace(model.mesh.vertices[v], d, step, turn, parts[chunk]);
    }
  });
  std::vector<Vec3> points;
  for (const auto& part : parts) points.insert(points.end(), part.begin(), part.end());
  return points;
}

// Every point of the shape's corners replaced by an upright prism that contains the ball of the given radius around it.
void append_enlarged(const TriangleMesh& shape, double sideways, double upright, std::vector<Vec3>& points) {
  if (sideways == 0.0 && upright == 0.0) {
    points.insert(points.end(), shape.vertices.begin(), shape.vertices.end());
    return;
  }
  const double corner = sideways / std::cos(std::numbers::pi / kSides);
  for (const Vec3& p : shape.vertices) {
    for (int i = 0; i < kSides; ++i) {
      const double angle = 2.0 * std::numbers::pi * (i + 0.5) / kSides;
      const Vec3 side(corner * std::cos(angle), corner * std::sin(angle), 0.0);
      for (const double up : {-upright, upright}) points.push_back(p + side + Vec3(0, 0, up));
    }
  }
}

// Around the model's boundary and the trajectories, both as their own convex hulls: exact, and far fewer points.
struct Shapes {
  TriangleMesh model;       // convex hull of the model
  TriangleMesh supported;   // convex hull of model and trajectories together
  std::vector<Vec3> model_points;
  bool has_trajectories = false;
};

Shapes enclosed_shapes(const Model& model, const std::vector<Vec3>& trajectory_points) {
  Shapes shapes;
  std::vector<bool> seen(model.mesh.vertices.size(), false);
  for (const BoundaryFace& face : model.boundary) {
    for (const Index v : face.vertices) {
      if (seen[v]) continue;
      seen[v] = true;
      shapes.model_points.push_back(model.mesh.vertices[v]);
    }
  }
  shapes.model = convex_hull(shapes.model_points);
  std::vector<Vec3> all = shapes.model.vertices;
  all.insert(all.end(), trajectory_points.begin(), trajectory_points.end());
  shapes.supported = convex_hull(all);
  shapes.has_trajectories = !trajectory_points.empty();
  return shapes;
}

// Directions spread evenly over the sphere, and the six axes, in which a shape's farthest points are looked for.
std::vector<Vec3> search_directions() {
  constexpr int kCount = 2000;
  const double golden = std::numbers::pi * (3.0 - std::sqrt(5.0));
  std::vector<Vec3> directions;
  for (int axis = 0; axis < 3; ++axis) {
    directions.push_back(Vec3::Unit(axis));
    directions.push_back(-Vec3::Unit(axis));
  }
  for (int i = 0; i < kCount; ++i) {
    const double z = 1.0 - (2.0 * i + 1.0) / kCount, r = std::sqrt(1.0 - z * z);
    directions.emplace_back(r * std::cos(golden * i), r * std::sin(golden * i), z);
  }
  return directions;
}

Vec3 farthest(const std::vector<Vec3>& points, const Vec3& direction) {
  std::size_t best = 0;
  double reach = points[0].dot(direction);
  for (std::size_t i = 1; i < points.size(); ++i) {
    const double value = points[i].dot(direction);
    if (value > reach) {
      reach = value;
      best = i;
    }
  }
  return points[best];
}

// The farthest point of shape + prism is the sum of the farthest points of both: a couple of thousand points instead of
// thirty-two for each vertex of the shape, and a surface that lacks at most a few tenths of a millimetre.
void append_farthest_enlarged(const TriangleMesh& shape, double sideways, double upright, const RunContext& run,
                              std::vector<Vec3>& points) {
  TriangleMesh origin;
  origin.vertices = {Vec3::Zero()};
  std::vector<Vec3> prism;
  append_enlarged(origin, sideways, upright, prism);
  constexpr std::size_t kGrain = 128;
  const std::vector<Vec3> directions = search_directions();
  const std::size_t first = points.size();
  points.resize(first + directions.size());
  parallel_for(directions.size(), kGrain, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      points[first + i] = farthest(shape.vertices, directions[i]) + farthest(prism, directions[i]);
    }
  });
}

TriangleMesh enlarged_hull(const Shapes& shapes, double margin, double extra, const RunContext& run) {
  std::vector<Vec3> points;
  append_farthest_enlarged(shapes.model, margin, margin, run, points);
  append_farthest_enlarged(shapes.supported, margin + extra, margin, run, points);
  // A model that floats without any overhang still gets ground to stand on.
  double low = std::numeric_limits<double>::infinity();
  for (const Vec3& p : points) low = std::min(low, p.z());
  if (low > -margin) {
    const std::size_t count = points.size();
    for (std::size_t i = 0; i < count; ++i) points.emplace_back(points[i].x(), points[i].y(), -margin);
  }
  return convex_hull(points);
}

// The surface is closed and every edge has its two faces in opposite directions.
bool is_closed_manifold(const TriangleMesh& mesh) {
  std::vector<std::pair<Index, Index>> edges;
  for (const auto& t : mesh.triangles) {
    for (int c = 0; c < 3; ++c) edges.emplace_back(t[c], t[(c + 1) % 3]);
  }
  std::sort(edges.begin(), edges.end());
  if (std::adjacent_find(edges.begin(), edges.end()) != edges.end()) return false;
  return std::all_of(edges.begin(), edges.end(), [&](const auto& e) {
    return std::binary_search(edges.begin(), edges.end(), std::pair(e.second, e.first));
  });
}

bool surfaces_meet(const TriangleMesh& boundary, const TriangleTree& boundary_tree, const TriangleMesh& hull) {
  for (Index t = 0; t < static_cast<Index>(hull.triangles.size()); ++t) {
    const auto& v = hull.triangles[t];
    const Vec3 &a = hull.vertices[v[0]], &b = hull.vertices[v[1]], &c = hull.vertices[v[2]];
    bool meet = false;
    boundary_tree.overlapping(a.cwiseMin(b).cwiseMin(c), a.cwiseMax(b).cwiseMax(c),
                              [&](Index other) { meet = meet || triangles_meet(hull, t, boundary, other); });
    if (meet) return true;
  }
  return false;
}

// Smallest distance from the points to the hull, negative when a point is outside. Inside is told by the nearest
// triangle's side, which a nearly convex hull allows.
double clearance(const std::vector<Vec3>& points, const TriangleMesh& hull, const TriangleTree& tree, double at_most) {
  double smallest = at_most;
  for (const Vec3& p : points) {
    const auto nearest = tree.nearest(p, smallest);
    if (!nearest) continue;
    const auto& v = hull.triangles[nearest->triangle];
    const Vec3 normal = area_normal(hull.vertices[v[0]], hull.vertices[v[1]], hull.vertices[v[2]]);
    const bool inside = normal.dot(p - nearest->point) <= 0.0;
    if (!inside) return -nearest->distance;
    smallest = std::min(smallest, nearest->distance);
  }
  return smallest;
}

// Whether p is inside, by the solid angle that the hull fills around it.
bool encloses(const TriangleMesh& hull, const Vec3& p) {
  double angle = 0.0;
  for (const auto& t : hull.triangles) {
    const Vec3 a = hull.vertices[t[0]] - p, b = hull.vertices[t[1]] - p, c = hull.vertices[t[2]] - p;
    const double la = a.norm(), lb = b.norm(), lc = c.norm();
    angle += 2.0 * std::atan2(a.cross(b).dot(c), la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb);
  }
  return angle > 2.0 * std::numbers::pi;
}

bool encloses_all(const TriangleMesh& hull, const std::vector<Vec3>& points) {
  Vec3 low = points.front(), high = low;
  for (const Vec3& p : hull.vertices) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  const bool in_box = std::all_of(points.begin(), points.end(), [&](const Vec3& p) {
    return (p.array() > low.array()).all() && (p.array() < high.array()).all();
  });
  return in_box && encloses(hull, points.front());
}

void refuse_too_many_triangles(const TriangleMesh& hull, double edge) {
  constexpr double kMostTriangles = 1e6;
  const double equilateral = std::sqrt(3.0) / 4.0, area = total_area(hull);
  if (area / (equilateral * edge * edge) <= kMostTriangles) return;
  throw Error(ErrorKind::usage, "config keys model.scale and domain.hull_edge_mm",
              format("the hull around model and support has %.3g mm2, which edges of %g mm divide into %.2g triangles", area, edge,
                     area / (equilateral * edge * edge)),
              format("if the file is not in millimetres set model.scale, to %s perhaps; else hull_edge_mm to %.2g or more",
                     scale_that_helps(std::sqrt(area / 6.0)).c_str(), 1.05 * std::sqrt(area / (equilateral * kMostTriangles))));
}

}  // namespace

HullResult build_hull(const Model& model, const ScalarField& field, const Overhang& overhang, int layer_count,
                      const HullOptions& options, const RunContext& run) {
  if (!(options.edge_length_mm > 0.0) || !(options.margin_mm > 0.0) || options.extra_margin_mm < 0.0) {
    throw Error(ErrorKind::usage, kStage, "edge length and margin must be positive, the extra margin not negative", "");
  }
  const double step = median_thickness(model, field, layer_count);
  const double turn = options.self_support.radians() / kTurnsPerSelfSupportAngle;
  const std::vector<Vec3> trajectory_points = trajectories(model, overhang, step, turn, run);
  const Shapes shapes = enclosed_shapes(model, trajectory_points);
  const double extra = shapes.has_trajectories ? options.extra_margin_mm : 0.0;
  std::vector<Vec3> strut_room;  // its convex hull holds the trajectories and what stands up to `extra` beside them
  append_enlarged(shapes.supported, extra, 0.0, strut_room);
  const TriangleMesh boundary = boundary_surface(model);
  const TriangleTree boundary_tree(boundary);

  HullResult result;
  HullReport& report = result.report;
  report.trajectory_points = static_cast<Index>(trajectory_points.size());
  double edge = options.edge_length_mm;
  double margin = std::max(options.margin_mm, kMarginPerEdge * edge);
  for (int attempt = 1;; ++attempt) {
    run.check_stop();
    const TriangleMesh smooth = enlarged_hull(shapes, margin, extra, run);
    refuse_too_many_triangles(smooth, edge);
    const TriangleMesh hull = remesh_isotropic(smooth, edge);
    const TriangleTree tree(hull);
    const double far = 2.0 * (margin + extra);
    report.attempts = attempt;
    report.margin_mm = margin;
    report.edge_length_mm = edge;
    report.model_clearance_mm = clearance(shapes.model_points, hull, tree, far);
    report.trajectory_clearance_mm = shapes.has_trajectories ? clearance(strut_room, hull, tree, far) : 0.0;
    const double wanted = kFreeFraction * margin;
    const bool roomy =
        report.model_clearance_mm >= wanted && (!shapes.has_trajectories || report.trajectory_clearance_mm >= wanted);
    const bool closed = is_closed_manifold(hull);
    const bool apart = closed && encloses_all(hull, shapes.model_points) && !surfaces_meet(boundary, boundary_tree, hull);
    if (apart && roomy) {
      result.surface = hull;
      break;
    }
    if (attempt == kMaxAttempts) {
      throw Error(ErrorKind::geometry, kStage,
                  format("no hull clear of the model after %d attempts (margin %.3g mm, edge length %.3g mm)", attempt, margin,
                         edge),
                  "ask for a larger margin or a shorter edge length");
    }
    run.log(LogLevel::debug, format("hull attempt %d: closed %d, apart %d, clearance %.3g mm", attempt, closed, apart,
                                    report.model_clearance_mm));
    edge *= kShrink;  // rounds less; a wider hull costs more tets
    if (attempt > 1) margin *= kGrowth;
  }
  report.vertices = static_cast<Index>(result.surface.vertices.size());
  report.faces = static_cast<Index>(result.surface.triangles.size());
  report.low_z_mm = std::numeric_limits<double>::infinity();
  for (const Vec3& p : result.surface.vertices) report.low_z_mm = std::min(report.low_z_mm, p.z());
  report.checks.push_back(check_at_least("hull.model_clearance_mm", report.model_clearance_mm, kFreeFraction * report.margin_mm,
                                         "distance from the model to the hull"));
  report.checks.push_back(check_at_most("hull.low_z_mm", report.low_z_mm, -kFreeFraction * report.margin_mm,
                                        "the hull reaches below the platform"));
  return result;
}

}  // namespace curvesup
