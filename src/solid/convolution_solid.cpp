#include "curvesup/solid/convolution_solid.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup {
namespace {

constexpr double kStraight = 0.02;    // radii: how far a joined node may lie off its strut
constexpr double kModelFoot = 0.5;    // of the radius, where a trunk stands on the model
constexpr double kBoundSlack = 1e-9;  // rounding of the sums that bounds() must enclose
constexpr double kMaxCells = 4e6;
// Cell sizes and margins in mm: the first grid serves value(), the others bounds() of balls up to their margin.
constexpr double kGrids[][2] = {{1.5, 0.0}, {2.0, 1.0}, {3.0, 2.0}, {6.0, 6.0}, {16.0, 16.0}};

// Integral of s^2 (1 - s)^2 from 0 to s.
double kernel_integral(double s) { return s * s * s * (1.0 / 3.0 + s * (-0.5 + s * 0.2)); }

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

// The radius of each edge's strut. A trunk that ends on the model stands there on a part of its radius and widens by 45
// degrees on its way up: where it is wider than the model is, the rest of it would be laid on air.
std::vector<double> tapered_radii(const Skeleton& skeleton) {
  double thinnest = std::numeric_limits<double>::infinity();
  for (const SkeletonEdge& e : skeleton.edges) thinnest = std::min(thinnest, e.radius_mm);
  std::vector<double> height(skeleton.nodes.size(), std::numeric_limits<double>::infinity());  // over the model end
  std::vector<double> foot(skeleton.nodes.size(), 0.0);                                        // radius there
  std::vector<double> radius(skeleton.edges.size());
  for (std::size_t e = skeleton.edges.size(); e-- > 0;) {
    const SkeletonEdge& edge = skeleton.edges[e];
    const double length = (skeleton.nodes[edge.upper].position - skeleton.nodes[edge.lower].position).norm();
    if (skeleton.nodes[edge.lower].kind == NodeKind::model_end) {
      height[edge.lower] = 0.0;
      foot[edge.lower] = std::max(foot[edge.lower], std::max(thinnest, kModelFoot * edge.radius_mm));
    }
    height[edge.upper] = height[edge.lower] + length;
    foot[edge.upper] = foot[edge.lower];
    radius[e] = std::min(edge.radius_mm, foot[edge.lower] + height[edge.lower] + 0.5 * length);
  }
  return radius;
}

// How far past the end of a long strut, in radii, the surface reaches along the axis.
double reach_past_end(double kernel_ratio) {
  const double wanted = std::pow(1.0 - 1.0 / (kernel_ratio * kernel_ratio), 2) / 30.0;
  double low = 0.0, high = 0.5;
  for (int i = 0; i < 60; ++i) {
    const double s = 0.5 * (low + high);
    (kernel_integral(s) < wanted ? low : high) = s;
  }
  return kernel_ratio * (1.0 - 2.0 * low);
}

// Lengths to take off the lower ends of the edges. A thick trunk that ends on the model would reach past it by a third of
// its radius, and where it is wider than the model is there, that is laid on air: so it ends as much earlier as makes it
// reach no further than a leaf's strut does.
std::vector<double> shortened(const Skeleton& skeleton, const Chains& chains, double kernel_ratio) {
  std::vector<Index> above(skeleton.nodes.size(), kNone);
  double thinnest = std::numeric_limits<double>::infinity();
  for (std::size_t e = 0; e < skeleton.edges.size(); ++e) {
    above[skeleton.edges[e].lower] = static_cast<Index>(e);
    thinnest = std::min(thinnest, skeleton.edges[e].radius_mm);
  }
  const double past = reach_past_end(kernel_ratio);
  std::vector<double> cut(skeleton.edges.size(), 0.0);
  for (std::size_t n = 0; n < skeleton.nodes.size(); ++n) {
    if (skeleton.nodes[n].kind != NodeKind::model_end || chains.arrivals[n] != 1) continue;
    Index e = above[n];
    for (double left = past * (skeleton.edges[e].radius_mm - thinnest); left > 0.0;) {
      const Index top = skeleton.edges[e].upper;
      const double length = (skeleton.nodes[top].position - skeleton.nodes[skeleton.edges[e].lower].position).norm();
      cut[e] = std::min(left, length);
      left -= length;
      if (chains.arrivals[top] != 1) break;
      e = above[top];
    }
  }
  return cut;
}

}  // namespace

std::vector<Strut> struts_of(const Skeleton& skeleton, double kernel_ratio) {
  const Chains chains = find_chains(skeleton);
  const std::vector<double> radius = tapered_radii(skeleton);
  const std::vector<double> cut = shortened(skeleton, chains, kernel_ratio);
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
      if (radius[next] != radius[e] || cut[next] > 0.0) break;
      passed.push_back(skeleton.nodes[end].position);
      const bool straight = std::all_of(passed.begin(), passed.end(), [&](const Vec3& p) {
        return (closest_point_on_segment(p, start, after) - p).norm() <= kStraight * radius[e];
      });
      if (!straight) break;
      joined[next] = 1;
      end = skeleton.edges[next].lower;
    }
    Strut strut{start, skeleton.nodes[end].position, radius[e]};
    const Vec3 direction = (strut.b - strut.a).normalized();
    if (skeleton.nodes[first.upper].kind == NodeKind::leaf) strut.a -= radius[e] * direction;
    if (skeleton.nodes[end].kind == NodeKind::platform_end) strut.b += radius[e] * direction;
    if (cut[e] > 0.0) {
      strut.b -= cut[e] * direction;
      if ((strut.b - strut.a).dot(direction) <= 0.0) continue;
    }
    struts.push_back(strut);
  }
  return struts;
}

inline double ConvolutionSolid::Kernel::contribution(double distance2, double along, double scale) const {
  const double half2 = reach * reach - distance2;
  if (half2 <= 0.0) return 0.0;
  const double half = std::sqrt(half2);
  const double from = std::max(-half, -along), to = std::min(half, length - along);
  if (to <= from) return 0.0;
  const double per_half = 0.5 / half, part = half2 / (reach * reach);
  const double s0 = from * per_half + 0.5, s1 = to * per_half + 0.5;
  // Never negative, so that a partial sum never exceeds the whole one.
  return std::max(0.0, scale * part * part * (kernel_integral(s1) - kernel_integral(s0)));
}

// F_e falls with the distance from the line, and with the distance between the point's foot and the strut's middle.
inline double ConvolutionSolid::Kernel::most_in_ball(const Vec3& centre, double radius, double scale) const {
  const Vec3 offset = centre - a;
  const double along = offset.dot(direction);
  const double distance2 = std::max(0.0, offset.squaredNorm() - along * along);
  const double limit = reach + radius;
  if (distance2 >= limit * limit) return 0.0;
  const double nearest = distance2 > radius * radius ? std::sqrt(distance2) - radius : 0.0;
  return contribution(nearest * nearest, std::clamp(0.5 * length, along - radius, along + radius), scale);
}

inline double ConvolutionSolid::Kernel::distance2(const Vec3& p) const {
  const Vec3 offset = p - a;
  const double along = offset.dot(direction), beside = along - std::clamp(along, 0.0, length);
  return offset.squaredNorm() - along * along + beside * beside;
}

inline double ConvolutionSolid::Kernel::at(const Vec3& p, double scale) const {
  const Vec3 offset = p - a;
  const double along = offset.dot(direction);
  return contribution(offset.squaredNorm() - along * along, along, scale);
}

double ConvolutionSolid::Foot::value(const Vec3& p) const {
  const double up = std::clamp(p.z() / height, 0.0, 1.0);
  const double wall = radius + (top_radius - radius) * up;
  return std::min(wall - std::hypot(p.x() - centre.x(), p.y() - centre.y()), height - std::abs(p.z()));
}

double ConvolutionSolid::Foot::lipschitz() const { return std::hypot(1.0, (radius - top_radius) / height); }

ConvolutionSolid::ConvolutionSolid(const Skeleton& skeleton, const ConvolutionOptions& options) {
  check_options(options);
  build(struts_of(skeleton, options.kernel_ratio), options);
  add_feet(skeleton, options);
}

ConvolutionSolid::ConvolutionSolid(std::span<const Strut> struts, const ConvolutionOptions& options) {
  build(struts, options);
}

void ConvolutionSolid::build(std::span<const Strut> struts, const ConvolutionOptions& options) {
  const double kappa = options.kernel_ratio;
  check_options(options);
  kernel_ratio_ = kappa;
  const double narrowing = 1.0 - 1.0 / (kappa * kappa);
  scale_ = 16.0 * 15.0 / (8.0 * narrowing * narrowing);
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  Vec3 low = Vec3::Constant(kInfinity), high = Vec3::Constant(-kInfinity);
  for (const Strut& s : struts) {
    const double length = (s.b - s.a).norm();
    if (length <= 0.0 || s.radius_mm <= 0.0) continue;
    const double reach = kappa * s.radius_mm;
    kernels_.push_back({s.a, (s.b - s.a) / length, length, reach});
    low = low.cwiseMin(s.a.cwiseMin(s.b) - Vec3::Constant(reach));
    high = high.cwiseMax(s.a.cwiseMax(s.b) + Vec3::Constant(reach));
  }
  if (kernels_.empty()) return;
  low_ = low;
  high_ = high;
  for (const auto& [cell, margin] : kGrids) grids_.push_back(make_grid(cell, margin));
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
  grid.least_reach.assign(cells, std::numeric_limits<double>::infinity());
  // The half diagonal of a cell turns the distance of its centre into one that holds for all of it.
  const double cell_reach = 0.5 * std::sqrt(3.0) * cell + margin + kBoundSlack;
  std::vector<std::pair<Index, Index>> visits;  // cell, strut
  for (std::size_t s = 0; s < kernels_.size(); ++s) {
    const Kernel& k = kernels_[s];
    const Vec3 b = k.a + k.length * k.direction;
    const double reach = k.reach + cell_reach;
    int from[3], to[3];
    for (int a = 0; a < 3; ++a) {
      from[a] = std::max(0, static_cast<int>(std::floor((std::min(k.a[a], b[a]) - reach - grid.low[a]) / cell)));
      to[a] = std::min(grid.count[a] - 1,
                       static_cast<int>(std::floor((std::max(k.a[a], b[a]) + reach - grid.low[a]) / cell)));
    }
    for (int z = from[2]; z <= to[2]; ++z) {
      for (int y = from[1]; y <= to[1]; ++y) {
        for (int x = from[0]; x <= to[0]; ++x) {
          const Vec3 centre = grid.low + cell * Vec3(x + 0.5, y + 0.5, z + 0.5);
          if (k.distance2(centre) > reach * reach) continue;
          visits.emplace_back((z * grid.count[1] + y) * grid.count[0] + x, static_cast<Index>(s));
        }
      }
    }
  }
  for (const auto& [c, s] : visits) {
    ++grid.first[c + 1];
    grid.least_reach[c] = std::min(grid.least_reach[c], kernels_[s].reach);
  }
  for (std::size_t c = 1; c < grid.first.size(); ++c) grid.first[c] += grid.first[c - 1];
  grid.struts.resize(grid.first.back());
  std::vector<Index> next(grid.first.begin(), grid.first.end() - 1);
  for (const auto& [c, s] : visits) grid.struts[next[c]++] = s;
  return grid;
}

std::ptrdiff_t ConvolutionSolid::Grid::cell_of(const Vec3& p) const {
  std::array<int, 3> at{};
  for (int a = 0; a < 3; ++a) {
    const double x = (p[a] - low[a]) / cell;
    if (!(x >= 0.0 && x < count[a])) return -1;
    at[a] = static_cast<int>(x);
  }
  return (static_cast<std::ptrdiff_t>(at[2]) * count[1] + at[1]) * count[0] + at[0];
}

std::span<const Index> ConvolutionSolid::Grid::near(const Vec3& p) const {
  const std::ptrdiff_t c = cell_of(p);
  if (c < 0) return {};
  return {struts.data() + first[c], struts.data() + first[c + 1]};
}

double ConvolutionSolid::foot_value(const Vec3& p) const {
  double best = -std::numeric_limits<double>::infinity();
  for (const Foot& foot : feet_) best = std::max(best, foot.value(p));
  return best;
}

double ConvolutionSolid::value(const Vec3& p) const {
  double sum = 0.0;
  if (!grids_.empty()) {
    for (const Index s : grids_[0].near(p)) sum += kernels_[s].at(p, scale_);
  }
  return std::max(sum - 1.0, foot_value(p));
}

double ConvolutionSolid::plain_value(const Vec3& p) const {
  double sum = 0.0;
  for (const Kernel& k : kernels_) sum += k.at(p, scale_);
  return std::max(sum - 1.0, foot_value(p));
}

bool ConvolutionSolid::inside(const Vec3& p) const {
  double sum = 0.0;
  if (!grids_.empty()) {
    for (const Index s : grids_[0].near(p)) {
      sum += kernels_[s].at(p, scale_);
      if (sum >= 1.0) return true;
    }
  }
  return foot_value(p) >= 0.0;
}

const ConvolutionSolid::Grid* ConvolutionSolid::grid_for(double radius) const {
  const auto grid = std::find_if(grids_.begin(), grids_.end(), [&](const Grid& g) { return g.margin >= radius; });
  return grid == grids_.end() ? nullptr : &*grid;
}

template <typename Visit>
bool ConvolutionSolid::any_near(const Vec3& centre, double radius, const Visit& visit) const {
  const Grid* grid = grid_for(radius);
  if (grid == nullptr) return std::any_of(kernels_.begin(), kernels_.end(), visit);
  const auto near = grid->near(centre);
  return std::any_of(near.begin(), near.end(), [&](Index s) { return visit(kernels_[s]); });
}

bool ConvolutionSolid::surely_outside(const Vec3& centre, double radius) const {
  double high = kBoundSlack;
  if (any_near(centre, radius, [&](const Kernel& k) { return (high += k.most_in_ball(centre, radius, scale_)) >= 1.0; })) return false;
  return std::all_of(feet_.begin(), feet_.end(), [&](const Foot& foot) {
    return foot.value(centre) + foot.lipschitz() * radius + kBoundSlack < 0.0;
  });
}

double ConvolutionSolid::thinnest_radius(const Vec3& centre, double radius, double enough) const {
  double thinnest = std::numeric_limits<double>::infinity();
  if (const Grid* grid = grid_for(radius)) {
    const std::ptrdiff_t c = grid->cell_of(centre);
    if (c < 0) return thinnest;
    // What the whole cell has is a bound already.
    if (grid->least_reach[c] > kernel_ratio_ * enough) return grid->least_reach[c] / kernel_ratio_;
  }
  (void)any_near(centre, radius, [&](const Kernel& k) {
    const double limit = k.reach + radius + kBoundSlack;
    if (k.reach < thinnest && k.distance2(centre) < limit * limit) thinnest = k.reach;
    return thinnest <= kernel_ratio_ * enough;
  });
  return thinnest / kernel_ratio_;
}

Solid::Bounds ConvolutionSolid::bounds(const Vec3& centre, double radius) const {
  double low = 0.0, high = 0.0;
  (void)any_near(centre, radius, [&](const Kernel& k) {
    high += k.most_in_ball(centre, radius, scale_);
    const Vec3 offset = centre - k.a;
    const double along = offset.dot(k.direction);
    const double farthest = std::sqrt(std::max(0.0, offset.squaredNorm() - along * along)) + radius;
    low += k.contribution(farthest * farthest, along > 0.5 * k.length ? along + radius : along - radius, scale_);
    return false;
  });
  Bounds bounds{low - 1.0, high - 1.0};
  for (const Foot& foot : feet_) {
    const double at = foot.value(centre), spread = foot.lipschitz() * radius;
    bounds.low = std::max(bounds.low, at - spread);
    bounds.high = std::max(bounds.high, at + spread);
  }
  return {bounds.low - kBoundSlack, bounds.high + kBoundSlack};
}

}  // namespace curvesup
