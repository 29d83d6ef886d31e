#include "check/printed_grid.h"

#include <cmath>
#include <limits>

#include "check/sheet_pieces.h"

namespace curvesup::certificate {

namespace {

constexpr double kCellMm = 1.0;
constexpr int kClasses = 12;  // the last one takes whatever is thicker

std::pair<Vec3, Vec3> box_of(const LayerStack& stack, Index triangle) {
  const auto c = corners_of(stack, triangle);
  return {c[0].cwiseMin(c[1]).cwiseMin(c[2]), c[0].cwiseMax(c[1]).cwiseMax(c[2])};
}

}  // namespace

PrintedGrid::PrintedGrid(const Subject& subject, Material material) : subject_(&subject) {
  const LayerStack& stack = subject.printed;
  sheet_of_.assign(stack.triangles.size(), kNone);
  std::vector<Index> chosen;
  for (Index s = 0; s < static_cast<Index>(stack.sheets.size()); ++s) {
    const Sheet& sheet = stack.sheets[s];
    if (sheet.material != material) continue;
    for (Index t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) {
      sheet_of_[t] = s;
      chosen.push_back(t);
    }
  }
  if (chosen.empty()) return;
  std::vector<double> thickness_mm;
  thickness_mm.reserve(chosen.size());
  for (const Index t : chosen) thickness_mm.push_back(thickness(t));
  std::vector<double> sorted = thickness_mm;
  const auto middle = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2);
  std::nth_element(sorted.begin(), middle, sorted.end());
  std::array<std::vector<Index>, kClasses> members;
  std::array<double, kClasses> most{};
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    int k = 0;
    for (double bound = *middle; k + 1 < kClasses && thickness_mm[i] > bound; bound *= 2.0) ++k;
    members[k].push_back(chosen[i]);
    most[k] = std::max(most[k], thickness_mm[i]);
  }
  for (int k = 0; k < kClasses; ++k) {
    if (!members[k].empty()) classes_.push_back(make_class(members[k], most[k]));
  }
}

PrintedGrid::Class PrintedGrid::make_class(const std::vector<Index>& triangles, double most_mm) const {
  const LayerStack& stack = subject_->printed;
  Class made;
  made.most_mm = most_mm;
  made.low = Vec3::Constant(std::numeric_limits<double>::max());
  made.high = -made.low;
  for (const Index t : triangles) {
    const auto [low, high] = box_of(stack, t);
    made.low = made.low.cwiseMin(low);
    made.high = made.high.cwiseMax(high);
  }
  made.grid = CellGrid(made.low, made.high, std::max(kCellMm, 0.5 * most_mm));
  const auto for_each_entry = [&](const auto& use) {
    for (const Index t : triangles) {
      const auto [low, high] = box_of(stack, t);
      made.grid.visit(low, high, [&](std::size_t cell) {
        use(cell, t);
        return false;
      });
    }
  };
  made.first.assign(made.grid.cells() + 1, 0);
  for_each_entry([&](std::size_t cell, Index) { ++made.first[cell + 1]; });
  for (std::size_t c = 0; c < made.grid.cells(); ++c) made.first[c + 1] += made.first[c];
  made.entries.resize(made.first.back());
  for_each_entry([&](std::size_t cell, Index t) { made.entries[made.first[cell]++] = t; });
  // Filling moved each start to its end; the starts are the ends of the cells before.
  for (std::size_t c = made.grid.cells(); c > 0; --c) made.first[c] = made.first[c - 1];
  made.first[0] = 0;
  return made;
}

}  // namespace curvesup::certificate
