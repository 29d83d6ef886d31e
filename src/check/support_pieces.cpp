#include <algorithm>
#include <cmath>

#include "check/printed_grid.h"
#include "check/sheet_pieces.h"
#include "curvesup/core/parallel.h"
#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup::certificate {

namespace {

constexpr double kRestingPart = 0.2;  // of a piece's area

// The segment from just below q to q + reach * down against a triangle, its border included.
bool meets(const std::array<Vec3, 3>& c, const Vec3& q, const Vec3& down, double reach) {
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

// Whether something printed before `sheet` lies within 1.5 layers along `down` from q.
bool rests(const Subject& subject, const PrintedGrids& grids, const Vec3& q, const Vec3& down, double thickness,
           const Sheet& sheet) {
  if (down.z() < 0.0 && q.z() + 1.5 * thickness * down.z() <= 0.0) return true;
  // Most of support stands on support.
  for (const Material material : {Material::support, Material::model}) {
    const PrintedGrid& grid = grids[static_cast<int>(material)];
    const bool found = grid.visit_below(q, down, thickness, 0.0, 0.0, [&](Index t) {
      return grid.sheet(t).iso_value < sheet.iso_value &&
             meets(corners_of(subject.printed, t), q, down, 1.5 * std::max(thickness, grid.thickness(t)));
    });
    if (found) return true;
  }
  return false;
}

// Points at equal steps of area through the piece decide; stops as soon as the outcome is certain.
bool piece_rests(const Subject& subject, const PrintedGrids& grids, const Piece& piece) {
  const LayerStack& stack = subject.printed;
  const Sheet& sheet = stack.sheets[piece.sheet];
  const int count = static_cast<int>(std::clamp(std::ceil(8.0 * piece.area), 32.0, 256.0));
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
      resting += rests(subject, grids, q, -subject.direction(tet), subject.thickness(tet, sheet.passes), sheet);
      if (resting >= kRestingPart * count) return true;
      if (resting + (count - sample - 1) < kRestingPart * count) return false;
    }
    done += area;
  }
  return resting >= kRestingPart * count;
}

}  // namespace

void prove_pieces(const Subject& subject, const PrintedGrids& grids, SupportCertificate& certificate) {
  std::vector<Index> support;
  for (Index s = 0; s < static_cast<Index>(subject.printed.sheets.size()); ++s) {
    if (subject.printed.sheets[s].material == Material::support) support.push_back(s);
  }
  if (support.empty()) return;
  std::vector<Index> pieces(support.size(), 0);
  std::vector<std::vector<SupportCertificate::FloatingPiece>> floating(support.size());
  parallel_for(support.size(), 2, subject.run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) {
      const Sheet& sheet = subject.printed.sheets[support[i]];
      for (const Piece& piece : pieces_of(subject.printed, support[i])) {
        ++pieces[i];
        if (piece_rests(subject, grids, piece)) continue;
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
