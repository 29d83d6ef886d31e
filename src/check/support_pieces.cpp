#include <algorithm>
#include <cmath>
#include <limits>

#include "check/sheet_pieces.h"
#include "check/support_parts.h"
#include "curvesup/core/parallel.h"
#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup::certificate {

namespace {

constexpr double kRestingPart = 0.2;  // of a piece's area

// All printed triangles by cell.
class PrintedGrid {
 public:
  explicit PrintedGrid(const Subject& subject) : subject_(subject) {
    const LayerStack& stack = subject.printed;
    Vec3 low = Vec3::Constant(std::numeric_limits<double>::max()), high = -low;
    for (const Vec3& p : stack.vertices) {
      low = low.cwiseMin(p);
      high = high.cwiseMax(p);
    }
    if (stack.vertices.empty()) low = high = Vec3::Zero();
    grid_ = CellGrid(low, high, 1.5);
    sheet_of_.resize(stack.triangles.size(), kNone);
    for (Index s = 0; s < static_cast<Index>(stack.sheets.size()); ++s) {
      const Sheet& sheet = stack.sheets[s];
      std::fill_n(sheet_of_.begin() + sheet.first_triangle, sheet.triangle_count, s);
      for (Index t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) {
        const double thickness = subject.thickness(stack.triangle_tet[t], sheet.passes);
        if (std::isfinite(thickness)) thickest_ = std::max(thickest_, thickness);
      }
    }
    const auto for_each_entry = [&](const auto& use) {
      for (Index t = 0; t < static_cast<Index>(stack.triangles.size()); ++t) {
        if (sheet_of_[t] == kNone) continue;
        const auto c = corners_of(stack, t);
        grid_.visit(c[0].cwiseMin(c[1]).cwiseMin(c[2]), c[0].cwiseMax(c[1]).cwiseMax(c[2]), [&](std::size_t cell) {
          use(cell, t);
          return false;
        });
      }
    };
    first_.assign(grid_.cells() + 1, 0);
    for_each_entry([&](std::size_t cell, Index) { ++first_[cell + 1]; });
    for (std::size_t c = 0; c < grid_.cells(); ++c) first_[c + 1] += first_[c];
    entries_.resize(first_.back());
    std::vector<std::size_t> next(first_.begin(), first_.end() - 1);
    for_each_entry([&](std::size_t cell, Index t) { entries_[next[cell]++] = t; });
  }

  // Whether something printed before `sheet` lies within 1.5 layers along `down` from q.
  [[nodiscard]] bool rests(const Vec3& q, const Vec3& down, double thickness, const Sheet& sheet) const {
    if (down.z() < 0.0 && q.z() + 1.5 * thickness * down.z() <= 0.0) return true;
    // A layer as thick as the thickest one counts from farther away; few columns are.
    const Vec3 far = q + 1.5 * std::max(thickness, thickest_) * down;
    return grid_.visit(q.cwiseMin(far), q.cwiseMax(far), [&](std::size_t cell) {
      for (std::size_t i = first_[cell]; i < first_[cell + 1]; ++i) {
        const Index t = entries_[i];
        const Sheet& below = subject_.printed.sheets[sheet_of_[t]];
        if (!(below.iso_value < sheet.iso_value)) continue;
        const double reach =
            1.5 * std::max(thickness, subject_.thickness(subject_.printed.triangle_tet[t], below.passes));
        if (meets(corners_of(subject_.printed, t), q, down, reach)) return true;
      }
      return false;
    });
  }

 private:
  // The segment from just below q to q + reach * down against a triangle, its border included.
  static bool meets(const std::array<Vec3, 3>& c, const Vec3& q, const Vec3& down, double reach) {
    const Vec3 n = area_normal(c[0], c[1], c[2]);
    const double slope = n.dot(down);
    if (slope == 0.0) return false;
    const double depth = n.dot(c[0] - q) / slope;
    if (!(depth > 1e-6 * reach) || depth > reach) return false;
    const Vec3 hit = q + depth * down;
    const double slack = -1e-9 * n.squaredNorm();
    return n.dot((c[1] - c[0]).cross(hit - c[0])) >= slack && n.dot((c[2] - c[1]).cross(hit - c[1])) >= slack &&
           n.dot((c[0] - c[2]).cross(hit - c[2])) >= slack;
  }

  const Subject& subject_;
  CellGrid grid_;
  std::vector<Index> sheet_of_;
  std::vector<std::size_t> first_;
  std::vector<Index> entries_;
  double thickest_ = 0.0;
};

// Points at equal steps of area through the piece decide; stops as soon as the outcome is certain.
bool piece_rests(const Subject& subject, const PrintedGrid& grid, const Piece& piece) {
  const LayerStack& stack = subject.printed;
  const Sheet& sheet = stack.sheets[piece.sheet];
  const int count = static_cast<int>(std::clamp(std::ceil(8.0 * piece.area), 16.0, 256.0));
  const double step = piece.area / count;
  int resting = 0, sample = 0;
  double done = 0.0;
  for (const Index t : piece.triangles) {
    const auto c = corners_of(stack, t);
    const double area = triangle_area(c[0], c[1], c[2]);
    for (; sample < count && (sample + 0.5) * step < done + area; ++sample) {
      // Uniform in the triangle: one coordinate from the place in the walk, one from the golden ratio.
      double u = std::clamp(((sample + 0.5) * step - done) / area, 0.0, 1.0);
      double v = std::fmod(0.5 + sample * 0.6180339887498949, 1.0);
      if (u + v > 1.0) {
        u = 1.0 - u;
        v = 1.0 - v;
      }
      const Index tet = stack.triangle_tet[t];
      const Vec3 q = c[0] + u * (c[1] - c[0]) + v * (c[2] - c[0]);
      resting += grid.rests(q, -subject.direction(tet), subject.thickness(tet, sheet.passes), sheet);
      if (resting >= kRestingPart * count) return true;
      if (resting + (count - sample - 1) < kRestingPart * count) return false;
    }
    done += area;
  }
  return resting >= kRestingPart * count;
}

}  // namespace

void prove_pieces(const Subject& subject, SupportCertificate& certificate) {
  std::vector<Index> support;
  for (Index s = 0; s < static_cast<Index>(subject.printed.sheets.size()); ++s) {
    if (subject.printed.sheets[s].material == Material::support) support.push_back(s);
  }
  if (support.empty()) return;
  const PrintedGrid grid(subject);
  std::vector<Index> pieces(support.size(), 0);
  std::vector<std::vector<SupportCertificate::FloatingPiece>> floating(support.size());
  parallel_for(support.size(), 2, subject.run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      const Sheet& sheet = subject.printed.sheets[support[i]];
      for (const Piece& piece : pieces_of(subject.printed, support[i])) {
        ++pieces[i];
        if (piece_rests(subject, grid, piece)) continue;
        floating[i].push_back({sheet.layer, sheet.pass, piece.centroid, piece.area});
      }
    }
  });
  for (std::size_t i = 0; i < support.size(); ++i) {
    certificate.pieces += pieces[i];
    certificate.floating.insert(certificate.floating.end(), floating[i].begin(), floating[i].end());
  }
}

}  // namespace curvesup::certificate
