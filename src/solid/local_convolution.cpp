#include "solid/local_convolution.h"

#include <limits>

#include "solid/convolution_kernel.h"

namespace curvesup {

namespace {

constexpr std::size_t kLanes = 4;

// What each of the kernels in the columns of a table adds at a point. The same operations in the same order, however many
// are done at once: so the same bits.
__attribute__((target_clones("avx2", "default"), optimize("O3"))) void contributions(
    const double* __restrict table, std::size_t rows, const double* __restrict p, double scale, double* __restrict out) {
  const double x = p[0], y = p[1], z = p[2];
  const double *ax = table, *ay = ax + rows, *az = ay + rows, *dx = az + rows, *dy = dx + rows, *dz = dy + rows,
               *length = dz + rows, *reach2 = length + rows, *inverse_reach2 = reach2 + rows;
  for (std::size_t i = 0; i < rows; ++i) {
    const double ox = x - ax[i], oy = y - ay[i], oz = z - az[i];
    const double along = ox * dx[i] + oy * dy[i] + oz * dz[i];
    const double distance2 = ox * ox + oy * oy + oz * oz - along * along;
    out[i] = chord_contribution(reach2[i] - distance2, along, length[i], inverse_reach2[i], scale);
  }
}

}  // namespace

void ConvolutionSolid::Local::focus(const Vec3& centre, double radius) {
  LocalSolid::focus(centre, radius);
  near_.clear();
  for (const Index s : solid_.near(centre, radius)) {
    if (solid_.kernels_[s].reaches(centre, radius)) near_.push_back(s);
  }
  without_cone_ = std::lower_bound(near_.begin(), near_.end(), solid_.first_cone_) - near_.begin();
  rows_ = (near_.size() + kLanes - 1) / kLanes * kLanes;
  table_.assign(rows_ * kColumns, 0.0);  // a kernel without reach adds nothing
  contribution_.resize(rows_);
  for (std::size_t i = 0; i < near_.size(); ++i) {
    const Kernel& k = solid_.kernels_[near_[i]];
    const double reach2 = k.reach * k.reach;
    const std::array<double, kColumns> row = {k.a.x(), k.a.y(), k.a.z(), k.direction.x(), k.direction.y(), k.direction.z(), k.length, reach2, 1.0 / reach2};
    for (int c = 0; c < kColumns; ++c) table_[c * rows_ + i] = row[c];
  }
}

double ConvolutionSolid::Local::value(const Vec3& p) {
  if (!covers(p, 0.0)) return solid_.value(p);
  contributions(table_.data(), rows_, p.data(), solid_.scale_, contribution_.data());
  double sum = 0.0;
  for (std::size_t i = 0; i < without_cone_; ++i) sum += contribution_[i];
  for (std::size_t i = without_cone_; i < near_.size(); ++i) {
    if (contribution_[i] > 0.0) sum += solid_.contribution(near_[i], p);
  }
  return solid_.feet_.empty() ? sum - 1.0 : std::max(sum - 1.0, solid_.foot_value(p));
}

bool ConvolutionSolid::Local::surely_outside(const Vec3& centre, double radius) const {
  if (!covers(centre, radius)) return solid_.surely_outside(centre, radius);
  return solid_.surely_outside(near_, centre, radius);
}

bool ConvolutionSolid::Local::surely_inside(const Vec3& centre, double radius) const {
  if (!covers(centre, radius)) return solid_.surely_inside(centre, radius);
  return solid_.surely_inside(near_, centre, radius);
}

double ConvolutionSolid::Local::thinnest_radius(const Vec3& centre, double radius, double enough) const {
  if (!covers(centre, radius)) return solid_.thinnest_radius(centre, radius, enough);
  return solid_.thinnest_radius(near_, centre, radius, enough);
}

}  // namespace curvesup
