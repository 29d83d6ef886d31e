#pragma once

#include <array>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "curvesup/core/run_context.h"
#include "curvesup/field/field.h"
#include "curvesup/skeleton/skeleton.h"
#include "curvesup/solid/solid.h"

namespace curvesup {

struct ConvolutionOptions {
  // kappa = R / rho, in (1, 1.85). A wide kernel rounds forks more, and fills more between struts: 2 to 3 percent of the
  // support's volume from 1.3 to 1.5. At 1.3 a leaf has its full radius in the topmost layer.
  double kernel_ratio = 1.3;
  double foot_radius_mm = 0.0;  // of the cone at each platform end; 0, or less than the trunk: none
  int foot_layers = 3;          // the cone's height in layers
};

// A straight strut of the wanted radius. Where a cone is given the strut is only what of it lies inside: coaxial, of
// cone_radius_mm at b, and wider by cone_slope for each mm from b towards a.
struct Strut {
  Vec3 a = Vec3::Zero(), b = Vec3::Zero();
  double radius_mm = 0.0;
  double cone_radius_mm = std::numeric_limits<double>::infinity();
  double cone_slope = 0.0;
};

// How a trunk stands on the model: the radius of its cone at a model end, how much wider the cone gets for each mm up the
// trunk, and how far below the end the trunk goes on into the model.
struct ModelStand {
  Index node = kNone;  // of the skeleton
  double radius_mm = 0.0;
  double slope = 1.0;
  double depth_mm = 0.0;
};

// A trunk that ends on the model stands there on a part of its radius and widens upwards: its full section would reach beside
// a thin part of the model, or out from a wall, and be laid on air. Its cone opens by stand_angle. `field` is the one on the
// domain. O(edges).
[[nodiscard]] std::vector<ModelStand> stands_on_model(const Skeleton& skeleton, const Domain& domain, const ScalarField& field);

// The struts of a skeleton: leaf edges reach one radius past their leaf and platform ends one radius below the
// platform, so that the first and the last layer have the full radius; neighbours of one radius are joined while no node
// between them lies off the joined strut by more than two percent of the radius. Branches that end on the model get the
// cones of `stands`, measured along the branch. O(edges).
[[nodiscard]] std::vector<Strut> struts_of(const Skeleton& skeleton, double kernel_ratio = ConvolutionOptions{}.kernel_ratio,
                                           std::span<const ModelStand> stands = {});

// Convolution surface around struts (paper, section III-B, equations 3 and 4): value(p) = -1 + sum of F_e(p).
// Kernel (1 - d^2 / R^2)^2, R = kappa rho, measured along the chord that the strut's line cuts from the ball (p, R), so
// that F_e = w (l / R)^4 [s^3/3 - s^4/2 + s^5/5] between the strut's ends; w = 15 / (8 (1 - 1/kappa^2)^2) makes the
// radius around a long strut exactly rho, whatever rho is. Splitting a strut changes nothing. The sums are taken over a
// grid but in the order of the strut ids: the same bits as the plain sum. value() and bounds() are O(struts near p).
// Throws Error{usage} for kernel_ratio out of range.
class ConvolutionSolid : public Solid {
 public:
  explicit ConvolutionSolid(const Skeleton& skeleton, const ConvolutionOptions& options = {},
                            std::span<const ModelStand> stands = {}, const RunContext& run = {});
  explicit ConvolutionSolid(std::span<const Strut> struts, const ConvolutionOptions& options = {});

  [[nodiscard]] double value(const Vec3& p) const override;
  [[nodiscard]] Bounds bounds(const Vec3& centre, double radius) const override;
  [[nodiscard]] bool inside(const Vec3& p) const override;
  [[nodiscard]] bool surely_outside(const Vec3& centre, double radius) const override;
  [[nodiscard]] bool surely_inside(const Vec3& centre, double radius) const override;
  // The smallest strut radius among the kernels that reach into the ball.
  [[nodiscard]] double thinnest_radius(const Vec3& centre, double radius, double enough) const override;
  // A part is the number of a kernel.
  void find_parts(const Vec3& centre, double radius, std::vector<Index>& parts) const override;
  [[nodiscard]] Extent extent(Index part, const Vec3& up) const override;
  [[nodiscard]] std::unique_ptr<LocalSolid> local() const override;

  // The same function by a loop over all struts.
  [[nodiscard]] double plain_value(const Vec3& p) const;
  [[nodiscard]] std::size_t strut_count() const { return kernels_.size(); }
  // Box outside of which value() is negative.
  [[nodiscard]] const Vec3& low() const { return low_; }
  [[nodiscard]] const Vec3& high() const { return high_; }

 private:
  struct alignas(64) Kernel {  // one cache line
    Vec3 a, direction;
    double length, reach;  // R
    // F_e for a point at distance sqrt(distance2) from the strut's line, `along` from its start; scale = 16 w.
    [[nodiscard]] double contribution(double distance2, double along, double scale) const;
    [[nodiscard]] Vec3 from_strut(const Vec3& p) const;  // from its nearest point
    [[nodiscard]] double most_in_ball(const Vec3& centre, double radius, double scale) const;
    [[nodiscard]] double least_in_ball(const Vec3& centre, double radius, double scale) const;
    [[nodiscard]] double at(const Vec3& p, double scale) const;
    [[nodiscard]] bool reaches(const Vec3& centre, double radius) const;
  };
  class Local;
  // Of the struts from first_cone_ on.
  struct Cone {
    double radius_at_start, slope;
    [[nodiscard]] double part(double distance2, double below_start) const;
  };
  // Which struts can contribute anywhere in a cell, or within `margin` of it.
  struct Grid {
    Vec3 low = Vec3::Zero();
    double cell = 1.0, margin = 0.0;
    std::array<int, 3> count{};
    std::vector<Index> first, struts;
    [[nodiscard]] std::span<const Index> near(const Vec3& p) const;
  };
  // A cone from the platform up around a trunk.
  struct Foot {
    Vec3 centre;
    double radius, top_radius, height;
    [[nodiscard]] double value(const Vec3& p) const;
    [[nodiscard]] double lipschitz() const;
  };

  void build(std::span<const Strut> struts, const ConvolutionOptions& options, const RunContext& run = {});
  void add_feet(const Skeleton& skeleton, const ConvolutionOptions& options);
  [[nodiscard]] Grid make_grid(double cell, double margin) const;
  [[nodiscard]] double foot_value(const Vec3& p) const;
  [[nodiscard]] bool feet_outside(const Vec3& centre, double radius) const;
  [[nodiscard]] double contribution(Index strut, const Vec3& p) const;
  // The sum over struts in ascending order; it may end as soon as it has reached `enough`.
  [[nodiscard]] double sum_over(std::span<const Index> struts, const Vec3& p, double enough) const;
  [[nodiscard]] double thin_reach(Index strut) const;
  // All struts that may reach into the ball, and others.
  [[nodiscard]] std::span<const Index> near(const Vec3& centre, double radius) const;
  // The same questions as above, by the struts that may reach into the ball.
  [[nodiscard]] bool surely_inside(std::span<const Index> near, const Vec3& centre, double radius) const;
  [[nodiscard]] double thinnest_radius(std::span<const Index> near, const Vec3& centre, double radius, double enough) const;

  std::vector<Kernel> kernels_;
  Index first_cone_ = 0;
  std::vector<Cone> cones_;
  std::vector<Foot> feet_;
  std::vector<Index> all_;   // struts
  std::vector<Grid> grids_;  // [0] for value(), then ever coarser ones for bounds()
  Vec3 low_ = Vec3::Zero(), high_ = Vec3::Zero();
  double kernel_ratio_ = 1.3, scale_ = 0.0;  // kappa and 16 w
};

}  // namespace curvesup
