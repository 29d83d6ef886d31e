#pragma once

#include <cmath>
#include <limits>
#include <memory>
#include <span>
#include <vector>

#include "curvesup/core/types.h"

namespace curvesup {

class LocalSolid;

// From where to where something reaches along a direction, in mm from the origin, or a little farther.
struct Extent {
  float low = 0.0f, high = 0.0f;
};

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
  // Half the width down to which strips are to be found in the ball where something was cut off the solid's struts; 0 where
  // nothing was.
  [[nodiscard]] virtual double thinnest_rest(const Vec3& /*centre*/, double /*radius*/) const { return 0.0; }
  // Whether value(p) >= 0 is proved for every p in the ball.
  [[nodiscard]] virtual bool surely_inside(const Vec3& centre, double radius) const {
    return bounds(centre, radius).low >= 0.0;
  }

  // The parts of which it is made that may matter in a ball; the numbers are the solid's own affair. None where it has no parts.
  virtual void find_parts(const Vec3& /*centre*/, double /*radius*/, std::vector<Index>& parts) const { parts.clear(); }
  [[nodiscard]] virtual Extent extent(Index /*part*/, const Vec3& /*up*/) const { return {}; }

  // For many questions about one place after the other.
  [[nodiscard]] virtual std::unique_ptr<LocalSolid> local() const;
};

// A ball, and the parts of a solid that may matter where one asks in it. As it is made: all of it, everywhere.
struct Neighbourhood {
  Vec3 centre = Vec3::Zero();
  double radius = std::numeric_limits<double>::infinity();
  std::span<const Index> parts;
  Vec3 up = Vec3::Zero();            // unit
  std::span<const Extent> extents;  // of the parts along that, if they are known
};

// The solid as seen by one thread near one place: the same answers, sooner. value() is right everywhere; the other questions
// are about what of their ball is in focus.
class LocalSolid {
 public:
  explicit LocalSolid(const Solid& solid) : solid_(solid) {}
  virtual ~LocalSolid() = default;

  // On what lies in the ball and, where that is known already, in a neighbourhood: there within half_height of the plane
  // across its `up` through the ball's centre.
  virtual void focus(const Vec3& centre, double radius, const Neighbourhood& around, double half_height = kEverywhere) {
    centre_ = centre;
    radius2_ = radius * radius * (1.0 + kRounding);
    half_height_ = half_height + kRounding;
    up_ = around.up;
    outer_centre_ = around.centre;
    outer_radius2_ = around.radius * around.radius * (1.0 + kRounding);
  }
  void focus(const Vec3& centre, double radius) { focus(centre, radius, Neighbourhood{}); }
  [[nodiscard]] bool in_focus(const Vec3& p) const {
    return (p - centre_).squaredNorm() <= radius2_ && std::abs(up_.dot(p - centre_)) <= half_height_ &&
           (p - outer_centre_).squaredNorm() <= outer_radius2_;
  }
  [[nodiscard]] virtual double value(const Vec3& p) { return solid_.value(p); }
  [[nodiscard]] virtual bool surely_outside(const Vec3& centre, double radius) { return solid_.surely_outside(centre, radius); }
  [[nodiscard]] virtual bool surely_inside(const Vec3& centre, double radius) const { return solid_.surely_inside(centre, radius); }
  [[nodiscard]] virtual double thinnest_radius(const Vec3& centre, double radius, double enough) const {
    return solid_.thinnest_radius(centre, radius, enough);
  }
  [[nodiscard]] double thinnest_rest(const Vec3& centre, double radius) const { return solid_.thinnest_rest(centre, radius); }

 protected:
  static constexpr double kEverywhere = std::numeric_limits<double>::infinity();
  static constexpr double kRounding = 1e-9;  // relative, and mm; of points on the border of the focus

 private:
  const Solid& solid_;
  Vec3 centre_ = Vec3::Zero();
  double radius2_ = -1.0, half_height_ = 0.0;
  Vec3 up_ = Vec3::Zero();
  Vec3 outer_centre_ = Vec3::Zero();
  double outer_radius2_ = 0.0;
};

inline std::unique_ptr<LocalSolid> Solid::local() const { return std::make_unique<LocalSolid>(*this); }

}  // namespace curvesup
