#include "solid/local_convolution.h"

#include <algorithm>
#include <cmath>

#include "solid/convolution_kernel.h"

namespace curvesup {

namespace {

constexpr std::size_t kLanes = 4;

// The columns of a table.
struct Columns {
  const double *ax, *ay, *az, *dx, *dy, *dz, *length, *reach2, *inverse_reach2;
  Columns(const std::vector<double>& table, std::size_t rows)
      : ax(table.data()), ay(ax + rows), az(ay + rows), dx(az + rows), dy(dx + rows), dz(dy + rows),
        length(dz + rows), reach2(length + rows), inverse_reach2(reach2 + rows) {}
};

// The sum, in order, of what each kernel adds at a point. Some kernels at once; most of those near do not reach the point, so
// that whole groups of them end early. The same operations in the same order, however many are done at once: so the same bits.
__attribute__((target_clones("avx2", "default"), optimize("O3"))) double sum_at(const Columns& k, std::size_t rows, const double* p,
                                                                                  double scale) {
  const double x = p[0], y = p[1], z = p[2];
  double sum = 0.0;
  for (std::size_t i = 0; i < rows; i += kLanes) {
    double along[kLanes], half2[kLanes], room[kLanes], part[kLanes];
#pragma GCC unroll 1
    for (std::size_t l = 0; l < kLanes; ++l) {
      const double ox = x - k.ax[i + l], oy = y - k.ay[i + l], oz = z - k.az[i + l];
      along[l] = ox * k.dx[i + l] + oy * k.dy[i + l] + oz * k.dz[i + l];
      half2[l] = k.reach2[i + l] - (ox * ox + oy * oy + oz * oz - along[l] * along[l]);
      const double above = along[l] - k.length[i + l], beside = above > -along[l] ? above : -along[l], beyond = beside > 0.0 ? beside : 0.0;
      room[l] = half2[l] - beyond * beyond;  // as Kernel::contribution asks
    }
    double most = room[0];
    for (std::size_t l = 1; l < kLanes; ++l) most = room[l] > most ? room[l] : most;
    if (most <= 0.0) continue;
#pragma GCC unroll 1
    for (std::size_t l = 0; l < kLanes; ++l) {
      part[l] = chord_contribution(half2[l], __builtin_sqrt(half2[l]), along[l], k.length[i + l], k.inverse_reach2[i + l], scale);
    }
    for (std::size_t l = 0; l < kLanes; ++l) sum += part[l];
  }
  return sum;
}

// The most that each kernel adds in a ball, as Kernel::most_in_ball.
__attribute__((target_clones("avx2", "default"), optimize("O3"))) void most_in_ball(const Columns& k, std::size_t rows, const double* p, double radius,
                                                                                    double scale, double* __restrict out) {
  const double x = p[0], y = p[1], z = p[2];
  for (std::size_t i = 0; i < rows; ++i) {
    const double ox = x - k.ax[i], oy = y - k.ay[i], oz = z - k.az[i];
    const double along = ox * k.dx[i] + oy * k.dy[i] + oz * k.dz[i];
    const double distance2 = ox * ox + oy * oy + oz * oz - along * along;
    const double beside = __builtin_sqrt(distance2 > 0.0 ? distance2 : 0.0) - radius, nearest = beside > 0.0 ? beside : 0.0;
    const double middle = 0.5 * k.length[i], low = along - radius, high = along + radius;
    const double foot = middle < low ? low : high < middle ? high : middle;
    const double half2 = k.reach2[i] - nearest * nearest;
    out[i] = chord_contribution(half2, __builtin_sqrt(half2), foot, k.length[i], k.inverse_reach2[i], scale);
  }
}

}  // namespace

void ConvolutionSolid::Local::focus(const Vec3& centre, double radius, const Neighbourhood& around, double half_height) {
  LocalSolid::focus(centre, radius, around, half_height);
  if (std::isinf(around.radius)) {
    solid_.find_parts(centre, radius, near_);
  } else {
    near_.clear();
    const double height = around.up.dot(centre);
    const float low = static_cast<float>(height - half_height), high = static_cast<float>(height + half_height);
    for (std::size_t i = 0; i < around.parts.size(); ++i) {
      if (!around.extents.empty() && (around.extents[i].low > high || around.extents[i].high < low)) continue;
      if (solid_.kernels_[around.parts[i]].reaches(centre, radius)) near_.push_back(around.parts[i]);
    }
  }
  without_cone_ = std::lower_bound(near_.begin(), near_.end(), solid_.first_cone_) - near_.begin();
  rows_ = (without_cone_ + kLanes - 1) / kLanes * kLanes;
  table_.resize(rows_ * kColumns);
  most_.resize(rows_);
  for (std::size_t i = 0; i < without_cone_; ++i) {
    const Kernel& k = solid_.kernels_[near_[i]];
    const double reach2 = k.reach * k.reach;
    const std::array<double, kColumns> row = {k.a.x(), k.a.y(), k.a.z(), k.direction.x(), k.direction.y(),
                                                 k.direction.z(), k.length, reach2, 1.0 / reach2};
    for (int c = 0; c < kColumns; ++c) table_[c * rows_ + i] = row[c];
  }
  for (std::size_t i = without_cone_; i < rows_; ++i) {
    for (int c = 0; c < kColumns; ++c) table_[c * rows_ + i] = 0.0;  // a kernel without reach adds nothing
  }
}

double ConvolutionSolid::Local::value(const Vec3& p) {
  if (!in_focus(p)) return solid_.value(p);
  double sum = sum_at({table_, rows_}, rows_, p.data(), solid_.scale_);
  for (std::size_t i = without_cone_; i < near_.size(); ++i) sum += solid_.contribution(near_[i], p);
  return solid_.feet_.empty() ? sum - 1.0 : std::max(sum - 1.0, solid_.foot_value(p));
}

bool ConvolutionSolid::Local::surely_outside(const Vec3& centre, double radius) {
  most_in_ball({table_, rows_}, rows_, centre.data(), radius, solid_.scale_, most_.data());
  double high = kBoundSlack;
  for (std::size_t i = 0; i < without_cone_; ++i) high += most_[i];
  for (std::size_t i = without_cone_; i < near_.size(); ++i) high += solid_.kernels_[near_[i]].most_in_ball(centre, radius, solid_.scale_);
  return high < 1.0 && solid_.feet_outside(centre, radius);
}

bool ConvolutionSolid::Local::surely_inside(const Vec3& centre, double radius) const {
  return solid_.surely_inside(near_, centre, radius);
}

double ConvolutionSolid::Local::thinnest_radius(const Vec3& centre, double radius, double enough) const {
  return solid_.thinnest_radius(near_, centre, radius, enough);
}

}  // namespace curvesup
