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

// Square roots may set errno, so a compiler does not take several at once unless it is told to: they get a loop of their own.
[[gnu::always_inline]] inline void take_roots(double* values, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) values[i] = std::sqrt(values[i] > 0.0 ? values[i] : 0.0);
}

// What each kernel adds at a point. The same operations in the same order, however many are done at once: so the same bits.
__attribute__((target_clones("avx2", "default"), optimize("O3"))) void contributions(const Columns& k, std::size_t rows, const double* p,
                                                                                     double scale, double* __restrict out) {
  const double x = p[0], y = p[1], z = p[2];
  for (std::size_t i = 0; i < rows; ++i) {
    const double ox = x - k.ax[i], oy = y - k.ay[i], oz = z - k.az[i];
    const double along = ox * k.dx[i] + oy * k.dy[i] + oz * k.dz[i];
    out[i] = k.reach2[i] - (ox * ox + oy * oy + oz * oz - along * along);
  }
  take_roots(out, rows);
  for (std::size_t i = 0; i < rows; ++i) {
    const double ox = x - k.ax[i], oy = y - k.ay[i], oz = z - k.az[i];
    const double along = ox * k.dx[i] + oy * k.dy[i] + oz * k.dz[i];
    const double half2 = k.reach2[i] - (ox * ox + oy * oy + oz * oz - along * along);
    out[i] = chord_contribution(half2, out[i], along, k.length[i], k.inverse_reach2[i], scale);
  }
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

void ConvolutionSolid::Local::focus(const Vec3& centre, double radius) {
  LocalSolid::focus(centre, radius);
  near_.clear();
  for (const Index s : solid_.near(centre, radius)) {
    if (solid_.kernels_[s].reaches(centre, (1.0 + kRounding) * radius)) near_.push_back(s);
  }
  without_cone_ = std::lower_bound(near_.begin(), near_.end(), solid_.first_cone_) - near_.begin();
  rows_ = (near_.size() + kLanes - 1) / kLanes * kLanes;
  table_.assign(rows_ * kColumns, 0.0);  // a kernel without reach adds nothing
  contribution_.resize(rows_);
  for (std::size_t i = 0; i < near_.size(); ++i) {
    const Kernel& k = solid_.kernels_[near_[i]];
    const double reach2 = k.reach * k.reach;
    const std::array<double, kColumns> row = {k.a.x(), k.a.y(), k.a.z(), k.direction.x(), k.direction.y(),
                                                 k.direction.z(), k.length, reach2, 1.0 / reach2};
    for (int c = 0; c < kColumns; ++c) table_[c * rows_ + i] = row[c];
  }
}

double ConvolutionSolid::Local::value(const Vec3& p) {
  if (!in_focus(p)) return solid_.value(p);
  contributions({table_, rows_}, rows_, p.data(), solid_.scale_, contribution_.data());
  double sum = 0.0;
  for (std::size_t i = 0; i < without_cone_; ++i) sum += contribution_[i];
  for (std::size_t i = without_cone_; i < near_.size(); ++i) {
    if (contribution_[i] > 0.0) sum += solid_.contribution(near_[i], p);
  }
  return solid_.feet_.empty() ? sum - 1.0 : std::max(sum - 1.0, solid_.foot_value(p));
}

bool ConvolutionSolid::Local::surely_outside(const Vec3& centre, double radius) {
  most_in_ball({table_, rows_}, rows_, centre.data(), radius, solid_.scale_, contribution_.data());
  double high = kBoundSlack;
  for (std::size_t i = 0; i < near_.size(); ++i) high += contribution_[i];
  return high < 1.0 && solid_.feet_outside(centre, radius);
}

bool ConvolutionSolid::Local::surely_inside(const Vec3& centre, double radius) const {
  return solid_.surely_inside(near_, centre, radius);
}

double ConvolutionSolid::Local::thinnest_radius(const Vec3& centre, double radius, double enough) const {
  return solid_.thinnest_radius(near_, centre, radius, enough);
}

}  // namespace curvesup
