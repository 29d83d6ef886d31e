#include "curvesup/solid/convolution_solid.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/skeleton/stand_angle.h"
#include "solid/convolution_kernel.h"
#include "solid/local_convolution.h"

namespace curvesup {
namespace {

constexpr double kStraight = 0.02;    // radii: how far a joined node may lie off its strut
constexpr double kConeEdge_mm = 0.4;  // over which a cone fades
constexpr double kNoCone = std::numeric_limits<double>::infinity();
constexpr double kExtentSlack_mm = 1e-3;  // more than floats round
constexpr double kMaxCells = 4e6;
// Cell sizes and margins in mm: the first grid serves value(), the others bounds() of balls up to their margin.
constexpr double kGrids[][2] = {{1.5, 0.0}, {3.0, 3.5}, {5.0, 5.0}, {24.0, 16.0}};

void check_options(const ConvolutionOptions& options) {
  const double kappa = options.kernel_ratio;
  if (!(kappa > 1.0 && kappa < 1.85)) {
    throw Error(ErrorKind::usage, "support.kernel_ratio", format("is %g, must lie between 1 and 1.85", kappa));
  }
}

struct Chains {
  std::vector<Index> below;     // edge that leaves a node downwards
  std::vector<Index> arrivals;  // number of edges that reach a node from above
};

Chains find_chains(const Skeleton& skeleton) {
  Chains chains{std::vector<Index>(skeleton.nodes.size(), kNone), std::vector<Index>(skeleton.nodes.size(), 0)};
  for (std::size_t e = 0; e < skeleton.edges.size(); ++e) {
    chains.below[skeleton.edges[e].upper] = static_cast<Index>(e);
    ++chains.arrivals[skeleton.edges[e].lower];
  }
  return chains;
}

// Of each node the way along the branch to its model end, and that end; kNone where the branch ends on the platform.
struct Ways {
  std::vector<double> way;
  std::vector<Index> end;
};

Ways ways_to_model_ends(const Skeleton& skeleton) {
  Ways ways{std::vector<double>(skeleton.nodes.size(), 0.0), std::vector<Index>(skeleton.nodes.size(), kNone)};
  for (std::size_t n = 0; n < skeleton.nodes.size(); ++n) {
    if (skeleton.nodes[n].kind == NodeKind::model_end) ways.end[n] = static_cast<Index>(n);
  }
  for (std::size_t e = skeleton.edges.size(); e-- > 0;) {
    const SkeletonEdge& edge = skeleton.edges[e];
    if (ways.end[edge.lower] == kNone) continue;
    ways.end[edge.upper] = ways.end[edge.lower];
    ways.way[edge.upper] =
        ways.way[edge.lower] + (skeleton.nodes[edge.upper].position - skeleton.nodes[edge.lower].position).norm();
  }
  return ways;
}

// The face on which a model end stands: its normal out of the model, and the gradient of G behind it.
std::optional<std::pair<Vec3, Vec3>> face_below(const Domain& domain, const ScalarField& field, const SkeletonNode& end) {
  constexpr double kOnFace_mm = 1e-6;
  for (int f = 0; f < 4; ++f) {
    const Index behind = domain.topology.neighbours[end.tet][f];
    if (behind == kNone || domain.region(behind) != Material::model) continue;
    const auto v = face_vertices(domain.mesh.tets[end.tet], f);
    const auto& at = domain.mesh.vertices;
    const Vec3 out = -area_normal(at[v[0]], at[v[1]], at[v[2]]).normalized();
    if (std::abs(out.dot(end.position - at[v[0]])) < kOnFace_mm && out.dot(field.gradient[behind]) > 0.0) {
      return std::pair{out, print_direction(field, behind)};
    }
  }
  return std::nullopt;
}

}  // namespace

std::vector<ModelStand> stands_on_model(const Skeleton& skeleton, const Domain& domain, const ScalarField& field) {
  double thinnest = std::numeric_limits<double>::infinity();
  for (const SkeletonEdge& e : skeleton.edges) thinnest = std::min(thinnest, e.radius_mm);
  std::vector<ModelStand> stands;
  for (const SkeletonEdge& e : skeleton.edges) {
    const SkeletonNode& end = skeleton.nodes[e.lower];
    if (end.kind != NodeKind::model_end) continue;
    const Vec3 axis = (skeleton.nodes[e.upper].position - end.position).normalized();
    const auto [normal, up] = face_below(domain, field, end).value_or(std::pair{axis, axis});
    const Foot foot = foot_of(normal, up, axis, e.radius_mm, thinnest);
    stands.push_back({e.lower, foot.radius_mm, foot.slope, foot.depth_mm});
  }
  return stands;
}

std::vector<Strut> struts_of(const Skeleton& skeleton, double kernel_ratio, std::span<const ModelStand> stands) {
  const Chains chains = find_chains(skeleton);
  const Ways ways = ways_to_model_ends(skeleton);
  std::vector<const ModelStand*> stand_of(skeleton.nodes.size(), nullptr);
  for (const ModelStand& stand : stands) {
    const ModelStand*& known = stand_of[stand.node];
    if (known == nullptr || stand.slope < known->slope) known = &stand;
  }
  std::vector<char> joined(skeleton.edges.size(), 0);
  std::vector<Strut> struts;
  for (std::size_t e = 0; e < skeleton.edges.size(); ++e) {
    if (joined[e]) continue;
    const SkeletonEdge& first = skeleton.edges[e];
    const Vec3 start = skeleton.nodes[first.upper].position;
    Index end = first.lower;
    std::vector<Vec3> passed;
    while (chains.arrivals[end] == 1 && chains.below[end] != kNone) {
      const Index next = chains.below[end];
      const Vec3& after = skeleton.nodes[skeleton.edges[next].lower].position;
      if (skeleton.edges[next].radius_mm != first.radius_mm) break;
      passed.push_back(skeleton.nodes[end].position);
      const bool straight = std::all_of(passed.begin(), passed.end(), [&](const Vec3& p) {
        return (closest_point_on_segment(p, start, after) - p).norm() <= kStraight * first.radius_mm;
      });
      if (!straight) break;
      joined[next] = 1;
      end = skeleton.edges[next].lower;
    }
    Strut strut{start, skeleton.nodes[end].position, first.radius_mm};
    const ModelStand* stand = ways.end[end] != kNone ? stand_of[ways.end[end]] : nullptr;
    const double deeper = stand != nullptr && stand->node == end ? stand->depth_mm : 0.0;
    if (stand != nullptr) {
      strut.cone_slope = stand->slope;
      strut.cone_radius_mm = stand->radius_mm + stand->slope * (ways.way[end] - deeper);
      // Wider than the kernel reaches wherever it reaches.
      const double reach = kernel_ratio * first.radius_mm;
      if (strut.cone_radius_mm - stand->slope * reach > reach + kConeEdge_mm) strut.cone_radius_mm = kNoCone;
    }
    const Vec3 direction = (strut.b - strut.a).normalized();
    if (skeleton.nodes[first.upper].kind == NodeKind::leaf) strut.a -= first.radius_mm * direction;
    if (skeleton.nodes[end].kind == NodeKind::platform_end) strut.b += first.radius_mm * direction;
    strut.b += deeper * direction;
    struts.push_back(strut);
  }
  return struts;
}

// What a cone leaves of a kernel.
double ConvolutionSolid::Cone::part(double distance2, double below_start) const {
  const double limit = radius_at_start - slope * below_start;
  if (limit <= 0.0) return 0.0;
  return std::clamp((limit - std::sqrt(distance2)) / kConeEdge_mm, 0.0, 1.0);
}

double ConvolutionSolid::contribution(Index strut, const Vec3& p) const {
  const Kernel& k = kernels_[strut];
  if (strut < first_cone_) return k.at(p, scale_);
  const Vec3 offset = p - k.a;
  const double along = offset.dot(k.direction), distance2 = std::max(0.0, offset.squaredNorm() - along * along);
  const double whole = k.contribution(distance2, along, scale_);
  return whole > 0.0 ? whole * cones_[strut - first_cone_].part(distance2, along) : 0.0;
}

double ConvolutionSolid::Foot::value(const Vec3& p) const {
  const double up = std::clamp(p.z() / height, 0.0, 1.0);
  const double wall = radius + (top_radius - radius) * up;
  return std::min(wall - std::hypot(p.x() - centre.x(), p.y() - centre.y()), height - std::abs(p.z()));
}

double ConvolutionSolid::Foot::lipschitz() const { return std::hypot(1.0, (radius - top_radius) / height); }

ConvolutionSolid::ConvolutionSolid(const Skeleton& skeleton, const ConvolutionOptions& options,
                                   std::span<const ModelStand> stands, const RunContext& run) {
  check_options(options);
  build(struts_of(skeleton, options.kernel_ratio, stands), options, run);
  add_feet(skeleton, options);
}

ConvolutionSolid::ConvolutionSolid(std::span<const Strut> struts, const ConvolutionOptions& options) {
  build(struts, options);
}

void ConvolutionSolid::build(std::span<const Strut> struts, const ConvolutionOptions& options, const RunContext& run) {
  const double kappa = options.kernel_ratio;
  check_options(options);
  kernel_ratio_ = kappa;
  const double narrowing = 1.0 - 1.0 / (kappa * kappa);
  scale_ = 16.0 * 15.0 / (8.0 * narrowing * narrowing);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Vec3 low = Vec3::Constant(kInfinity), high = Vec3::Constant(-kInfinity);
  for (const bool with_cone : {false, true}) {
    if (with_cone) first_cone_ = static_cast<Index>(kernels_.size());
    for (const Strut& s : struts) {
      const double length = (s.b - s.a).norm();
      if (length <= 0.0 || s.radius_mm <= 0.0 || (s.cone_radius_mm < kNoCone) != with_cone) continue;
      const double reach = kappa * s.radius_mm;
      kernels_.push_back({s.a, (s.b - s.a) / length, length, reach});
      if (with_cone) cones_.push_back({s.cone_radius_mm + s.cone_slope * length, s.cone_slope});
      low = low.cwiseMin(s.a.cwiseMin(s.b) - Vec3::Constant(reach));
      high = high.cwiseMax(s.a.cwiseMax(s.b) + Vec3::Constant(reach));
    }
  }
  if (kernels_.empty()) return;
  low_ = low;
  high_ = high;
  all_.resize(kernels_.size());
  std::iota(all_.begin(), all_.end(), 0);
  grids_.resize(std::size(kGrids));
  parallel_for(grids_.size(), 1, run, [&](std::size_t g, std::size_t, std::size_t) { grids_[g] = make_grid(kGrids[g][0], kGrids[g][1]); });
}

void ConvolutionSolid::add_feet(const Skeleton& skeleton, const ConvolutionOptions& options) {
  if (options.foot_radius_mm <= 0.0 || options.foot_layers <= 0) return;
  std::vector<Index> trunk(skeleton.nodes.size(), kNone);  // the thickest edge that reaches a node from above
  for (std::size_t e = 0; e < skeleton.edges.size(); ++e) {
    Index& best = trunk[skeleton.edges[e].lower];
    if (best == kNone || skeleton.edges[e].branch_count > skeleton.edges[best].branch_count)
      best = static_cast<Index>(e);
  }
  for (std::size_t n = 0; n < skeleton.nodes.size(); ++n) {
    if (skeleton.nodes[n].kind != NodeKind::platform_end || trunk[n] == kNone) continue;
    const double radius = skeleton.edges[trunk[n]].radius_mm;
    if (options.foot_radius_mm <= radius) continue;
    Index top = static_cast<Index>(n);
    for (int i = 0; i < options.foot_layers && trunk[top] != kNone; ++i) top = skeleton.edges[trunk[top]].upper;
    const double height = skeleton.nodes[top].position.z();
    if (height <= 0.0) continue;
    const Vec3& centre = skeleton.nodes[n].position;
    feet_.push_back({centre, options.foot_radius_mm, radius, height});
    const Vec3 reach(options.foot_radius_mm, options.foot_radius_mm, height);
    low_ = low_.cwiseMin(centre - reach);
    high_ = high_.cwiseMax(centre + reach);
  }
}

ConvolutionSolid::Grid ConvolutionSolid::make_grid(double cell, double margin) const {
  Grid grid;
  const Vec3 size = high_ - low_ + Vec3::Constant(2.0 * margin);
  while ((size.x() / cell + 1) * (size.y() / cell + 1) * (size.z() / cell + 1) > kMaxCells) cell *= 1.25;
  grid.low = low_ - Vec3::Constant(margin);
  grid.cell = cell;
  grid.margin = margin;
  for (int a = 0; a < 3; ++a) grid.count[a] = static_cast<int>(size[a] / cell) + 1;
  const std::size_t cells = static_cast<std::size_t>(grid.count[0]) * grid.count[1] * grid.count[2];
  grid.first.assign(cells + 1, 0);
  struct Row {
    Index first, last, strut;  // cells
  };
  std::vector<Row> rows;
  for (std::size_t s = 0; s < kernels_.size(); ++s) {
    const Kernel& k = kernels_[s];
    const Vec3 b = k.a + k.length * k.direction;
    const double reach = k.reach + margin + kBoundSlack, widest = reach + 0.5 * std::sqrt(3.0) * cell;
    int from[3], to[3];
    for (int a = 0; a < 3; ++a) {
      from[a] = std::max(0, static_cast<int>(std::floor((std::min(k.a[a], b[a]) - reach - grid.low[a]) / cell)));
      to[a] = std::min(grid.count[a] - 1,
                       static_cast<int>(std::floor((std::max(k.a[a], b[a]) + reach - grid.low[a]) / cell)));
    }
    const auto reaches_into = [&](int x, int y, int z) {
      const Vec3 away = k.from_strut(grid.low + cell * Vec3(x + 0.5, y + 0.5, z + 0.5));
      const double distance2 = away.squaredNorm();
      // A cell ends before the plane across the way to the strut that keeps the reach off.
      return distance2 <= widest * widest && distance2 - 0.5 * cell * away.lpNorm<1>() <= reach * std::sqrt(distance2);
    };
    for (int z = from[2]; z <= to[2]; ++z) {
      for (int y = from[1]; y <= to[1]; ++y) {
        int low = from[0], high = to[0];
        while (low <= high && !reaches_into(low, y, z)) ++low;
        while (high > low && !reaches_into(high, y, z)) --high;
        const Index row = (z * grid.count[1] + y) * grid.count[0];
        if (low <= high) rows.push_back({row + low, row + high, static_cast<Index>(s)});
      }
    }
  }
  for (const Row& row : rows) {
    for (Index c = row.first; c <= row.last; ++c) ++grid.first[c + 1];
  }
  for (std::size_t c = 1; c < grid.first.size(); ++c) grid.first[c] += grid.first[c - 1];
  grid.struts.resize(grid.first.back());
  std::vector<Index> next(grid.first.begin(), grid.first.end() - 1);
  for (const Row& row : rows) {
    for (Index c = row.first; c <= row.last; ++c) grid.struts[next[c]++] = row.strut;
  }
  return grid;
}

std::span<const Index> ConvolutionSolid::Grid::near(const Vec3& p) const {
  std::array<int, 3> at{};
  for (int a = 0; a < 3; ++a) {
    const double x = (p[a] - low[a]) / cell;
    if (!(x >= 0.0 && x < count[a])) return {};  // far from every strut
    at[a] = static_cast<int>(x);
  }
  const std::ptrdiff_t c = (static_cast<std::ptrdiff_t>(at[2]) * count[1] + at[1]) * count[0] + at[0];
  return {struts.data() + first[c], struts.data() + first[c + 1]};
}

double ConvolutionSolid::foot_value(const Vec3& p) const {
  double best = -std::numeric_limits<double>::infinity();
  for (const Foot& foot : feet_) best = std::max(best, foot.value(p));
  return best;
}

double ConvolutionSolid::sum_over(std::span<const Index> struts, const Vec3& p, double enough) const {
  double sum = 0.0;
  auto strut = struts.begin();
  for (; strut != struts.end() && *strut < first_cone_; ++strut) {
    if ((sum += kernels_[*strut].at(p, scale_)) >= enough) return sum;
  }
  for (; strut != struts.end(); ++strut) {
    if ((sum += contribution(*strut, p)) >= enough) return sum;
  }
  return sum;
}

double ConvolutionSolid::value(const Vec3& p) const {
  const double sum = grids_.empty() ? 0.0 : sum_over(grids_[0].near(p), p, std::numeric_limits<double>::infinity());
  return feet_.empty() ? sum - 1.0 : std::max(sum - 1.0, foot_value(p));
}

double ConvolutionSolid::plain_value(const Vec3& p) const {
  double sum = 0.0;
  for (Index s = 0; s < static_cast<Index>(kernels_.size()); ++s) sum += contribution(s, p);
  return std::max(sum - 1.0, foot_value(p));
}

bool ConvolutionSolid::inside(const Vec3& p) const {
  if (!grids_.empty() && sum_over(grids_[0].near(p), p, 1.0) >= 1.0) return true;
  return foot_value(p) >= 0.0;
}

double ConvolutionSolid::thin_reach(Index strut) const {
  return strut < first_cone_ ? kernels_[strut].reach : std::min(kernels_[strut].reach, kernel_ratio_ * kConeEdge_mm);
}

std::span<const Index> ConvolutionSolid::near(const Vec3& centre, double radius) const {
  const auto grid = std::find_if(grids_.begin(), grids_.end(), [&](const Grid& g) { return g.margin >= radius; });
  return grid == grids_.end() ? std::span<const Index>(all_) : grid->near(centre);
}

void ConvolutionSolid::find_parts(const Vec3& centre, double radius, std::vector<Index>& parts) const {
  parts.clear();
  for (const Index s : near(centre, radius)) {
    if (kernels_[s].reaches(centre, radius)) parts.push_back(s);
  }
}

Extent ConvolutionSolid::extent(Index part, const Vec3& up) const {
  const Kernel& k = kernels_[part];
  const double start = up.dot(k.a), end = start + k.length * up.dot(k.direction), reach = k.reach + kExtentSlack_mm;
  return {static_cast<float>(std::min(start, end) - reach), static_cast<float>(std::max(start, end) + reach)};
}

std::unique_ptr<LocalSolid> ConvolutionSolid::local() const { return std::make_unique<Local>(*this); }

bool ConvolutionSolid::feet_outside(const Vec3& centre, double radius) const {
  return std::all_of(feet_.begin(), feet_.end(), [&](const Foot& foot) {
    return foot.value(centre) + foot.lipschitz() * radius + kBoundSlack < 0.0;
  });
}

bool ConvolutionSolid::surely_outside(const Vec3& centre, double radius) const {
  double high = kBoundSlack;
  for (const Index s : near(centre, radius)) {
    if ((high += kernels_[s].most_in_ball(centre, radius, scale_)) >= 1.0) return false;
  }
  return feet_outside(centre, radius);
}

bool ConvolutionSolid::surely_inside(const Vec3& centre, double radius) const {
  return surely_inside(near(centre, radius), centre, radius);
}

double ConvolutionSolid::thinnest_radius(const Vec3& centre, double radius, double enough) const {
  return thinnest_radius(near(centre, radius), centre, radius, enough);
}

bool ConvolutionSolid::surely_inside(std::span<const Index> near, const Vec3& centre, double radius) const {
  double low = -kBoundSlack;
  for (const Index s : near) {
    if (s >= first_cone_) break;  // what has a cone may be cut off anywhere
    if ((low += kernels_[s].least_in_ball(centre, radius, scale_)) >= 1.0) return true;
  }
  return std::any_of(feet_.begin(), feet_.end(), [&](const Foot& foot) {
    return foot.value(centre) - foot.lipschitz() * radius - kBoundSlack >= 0.0;
  });
}

double ConvolutionSolid::thinnest_radius(std::span<const Index> near, const Vec3& centre, double radius, double enough) const {
  double thinnest = std::numeric_limits<double>::infinity();
  for (const Index s : near) {
    const double thin = thin_reach(s);
    if (thin >= thinnest || !kernels_[s].reaches(centre, radius)) continue;
    thinnest = thin;
    if (thinnest <= kernel_ratio_ * enough) break;
  }
  return thinnest / kernel_ratio_;
}

Solid::Bounds ConvolutionSolid::bounds(const Vec3& centre, double radius) const {
  double low = 0.0, high = 0.0;
  for (const Index s : near(centre, radius)) {
    const Kernel& k = kernels_[s];
    high += k.most_in_ball(centre, radius, scale_);
    if (s < first_cone_) low += k.least_in_ball(centre, radius, scale_);
  }
  Bounds bounds{low - 1.0, high - 1.0};
  for (const Foot& foot : feet_) {
    const double at = foot.value(centre), spread = foot.lipschitz() * radius;
    bounds.low = std::max(bounds.low, at - spread);
    bounds.high = std::max(bounds.high, at + spread);
  }
  return {bounds.low - kBoundSlack, bounds.high + kBoundSlack};
}

}  // namespace curvesup
