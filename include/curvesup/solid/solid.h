#pragma once

#include <limits>
#include <memory>
#include <span>

#include "curvesup/core/types.h"

namespace curvesup {

class LocalSolid;

// A support solid as an implicit function; inside is value(p) >= 0 (paper, equation 2). Safe to call from many threads.
class Solid {
 public:
  virtual ~Solid() = default;
  [[nodiscard]] virtual double value(const Vec3& p) const = 0;

  struct Bounds {
    double low = 0.0, high = 0.0;
  };
  // Bounds that enclose value(p) for every p in the ball; conservative, never wrong.
  [[nodiscard]] virtual Bounds bounds(const Vec3& centre, double radius) const = 0;

  // Four questions that a solid may answer faster than by value() and bounds().
  // value(p) >= 0, exactly.
  [[nodiscard]] virtual bool inside(const Vec3& p) const { return value(p) >= 0.0; }
  // Whether value(p) < 0 is proved for every p in the ball.
  [[nodiscard]] virtual bool surely_outside(const Vec3& centre, double radius) const {
    return bounds(centre, radius).high < 0.0;
  }
  // No part of the solid with a smaller radius than this lies in the ball. 0 where nothing is known; the search may end as
  // soon as the answer is known to be `enough` or less.
  [[nodiscard]] virtual double thinnest_radius(const Vec3& /*centre*/, double /*radius*/, double /*enough*/) const { return 0.0; }
  // Whether value(p) >= 0 is proved for every p in the ball.
  [[nodiscard]] virtual bool surely_inside(const Vec3& centre, double radius) const {
    return bounds(centre, radius).low >= 0.0;
  }

  // For many questions about one place after the other.
  [[nodiscard]] virtual std::unique_ptr<LocalSolid> local() const;
};

// A ball, and what of a solid may matter in it; the numbers are the solid's own affair. As it is made: all of it, everywhere.
struct Neighbourhood {
  Vec3 centre = Vec3::Zero();
  double radius = std::numeric_limits<double>::infinity();
  std::span<const Index> parts;
};

// The solid as seen by one thread near one place: the same answers, sooner. value() is right everywhere; the other questions
// are about what of their ball lies in the ball that is in focus.
class LocalSolid {
 public:
  explicit LocalSolid(const Solid& solid) : solid_(solid) {}
  virtual ~LocalSolid() = default;

  // On what lies in the ball and, where that is known already, in a neighbourhood whose parts were those of a focus.
  virtual void focus(const Vec3& centre, double radius, const Neighbourhood& around) {
    centre_ = centre;
    radius2_ = radius * radius * (1.0 + kRounding);
    outer_centre_ = around.centre;
    outer_radius2_ = around.radius * around.radius * (1.0 + kRounding);
  }
  void focus(const Vec3& centre, double radius) { focus(centre, radius, Neighbourhood{}); }
  [[nodiscard]] bool in_focus(const Vec3& p) const {
    return (p - centre_).squaredNorm() <= radius2_ && (p - outer_centre_).squaredNorm() <= outer_radius2_;
  }
  [[nodiscard]] virtual std::span<const Index> parts() const { return {}; }  // what of the solid matters in the focus
  [[nodiscard]] virtual double value(const Vec3& p) { return solid_.value(p); }
  [[nodiscard]] virtual bool surely_outside(const Vec3& centre, double radius) { return solid_.surely_outside(centre, radius); }
  [[nodiscard]] virtual bool surely_inside(const Vec3& centre, double radius) const { return solid_.surely_inside(centre, radius); }
  [[nodiscard]] virtual double thinnest_radius(const Vec3& centre, double radius, double enough) const {
    return solid_.thinnest_radius(centre, radius, enough);
  }

 protected:
  static constexpr double kRounding = 1e-9;  // relative; of points on the border of the focus

 private:
  const Solid& solid_;
  Vec3 centre_ = Vec3::Zero();
  double radius2_ = -1.0;
  Vec3 outer_centre_ = Vec3::Zero();
  double outer_radius2_ = 0.0;
};

inline std::unique_ptr<LocalSolid> Solid::local() const { return std::make_unique<LocalSolid>(*this); }

}  // namespace curvesup
