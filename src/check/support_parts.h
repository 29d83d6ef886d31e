#pragma once

#include <algorithm>
#include <array>
#include <tuple>

#include "curvesup/check/support_certificate.h"

// The three proofs of the support certificate; each fills its part of the certificate.
namespace curvesup::certificate {

// What the proofs look at.
struct Subject {
  const Model& model;
  const Domain& domain;
  const ScalarField& field;
  const LayerStack& printed;
  const SupportCertificateOptions& options;
  const RunContext& run;

  // Unit gradient of G in a tet of the domain; straight up where it vanishes.
  [[nodiscard]] Vec3 direction(Index tet) const {
    const double length = field.gradient[tet].norm();
    return length > 0.0 ? Vec3(field.gradient[tet] / length) : Vec3(Vec3::UnitZ());
  }
  [[nodiscard]] double thickness(Index tet, int passes) const {
    return 1.0 / (std::max(field.gradient[tet].norm(), 1e-12) * printed.count * passes);
  }
};

class PrintedGrid;
using PrintedGrids = std::array<PrintedGrid, kMaterialCount>;

void prove_coverage(const Subject& subject, const PrintedGrids& grids, const std::vector<Index>& blocked_faces,
                    SupportCertificate& certificate);
void prove_pieces(const Subject& subject, const PrintedGrids& grids, SupportCertificate& certificate);
void prove_skeleton(const Subject& subject, const Skeleton& skeleton, SupportCertificate& certificate);

// Cells of equal size over a box, at most `most_cells`; points outside belong to the border cells.
class CellGrid {
 public:
  CellGrid() = default;
  CellGrid(const Vec3& low, const Vec3& high, double cell_mm, double most_cells = 4e6);

  using Cell = Eigen::Vector3i;
  [[nodiscard]] Cell cell_of(const Vec3& p) const {
    Cell c;
    for (int axis = 0; axis < 3; ++axis)
      c[axis] = static_cast<int>(std::clamp((p[axis] - low_[axis]) * per_mm_, 0.0, size_[axis] - 1.0));
    return c;
  }
  [[nodiscard]] std::size_t index(const Cell& c) const {
    return (static_cast<std::size_t>(c.z()) * size_.y() + c.y()) * size_.x() + c.x();
  }
  [[nodiscard]] std::size_t cells() const { return static_cast<std::size_t>(size_.x()) * size_.y() * size_.z(); }

  // Calls visit(index) for the cells that meet [low, high], until it returns true; says whether it did.
  bool visit(const Vec3& low, const Vec3& high, const auto& visit_cell) const {
    const Cell a = cell_of(low), b = cell_of(high);
    for (int z = a.z(); z <= b.z(); ++z) {
      for (int y = a.y(); y <= b.y(); ++y) {
        const std::size_t row = index({0, y, z});
        for (int x = a.x(); x <= b.x(); ++x) {
          if (visit_cell(row + x)) return true;
        }
      }
    }
    return false;
  }

 private:
  Vec3 low_ = Vec3::Zero();
  double cell_mm_ = 1.0, per_mm_ = 1.0;
  Cell size_ = Cell::Ones();
};

}  // namespace curvesup::certificate
