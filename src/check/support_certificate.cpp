#include "curvesup/check/support_certificate.h"

#include <cmath>

#include "check/printed_grid.h"
#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"

namespace curvesup {

namespace certificate {

CellGrid::CellGrid(const Vec3& low, const Vec3& high, double cell_mm, double most_cells)
    : low_(low), cell_mm_(cell_mm) {
  const Vec3 extent = (high - low).cwiseMax(1e-9);
  const auto cells_along = [&](int axis) { return std::floor(extent[axis] / cell_mm_) + 1.0; };
  while (cells_along(0) * cells_along(1) * cells_along(2) > most_cells) cell_mm_ *= 1.25;
  size_ = Cell(static_cast<int>(cells_along(0)), static_cast<int>(cells_along(1)), static_cast<int>(cells_along(2)));
  per_mm_ = 1.0 / cell_mm_;
}

}  // namespace certificate

namespace {

constexpr std::size_t kNamed = 5;

// "12, 40, 41 and 7 more", or nothing.
std::string first_of(const auto& list, const auto& text_of) {
  std::string text;
  for (std::size_t i = 0; i < list.size() && i < kNamed; ++i) text += (i ? ", " : "") + text_of(list[i]);
  if (list.size() > kNamed) text += format(" and %zu more", list.size() - kNamed);
  return text;
}

std::string ids(const std::vector<Index>& list) {
  return first_of(list, [](Index i) { return std::to_string(i); });
}

Check none_of(std::string name, const std::vector<Index>& found, const std::string& what, const char* element) {
  return check_equal(std::move(name), static_cast<double>(found.size()), 0.0,
                     found.empty() ? what : what + "; " + element + " " + ids(found));
}

void add_support_checks(const SupportCertificateOptions& options, SupportCertificate& c) {
  std::string covered =
      format("covered part of %.1f mm2 of overhang, by %d samples; model layers and platform alone cover %.4f",
             c.overhang_area_mm2, c.samples, c.floor_fraction);
  if (!c.uncovered.empty()) {
    covered += "; uncovered in face " + first_of(c.uncovered, [](const SupportCertificate::UncoveredFace& f) {
                 return format("%d (%.2f mm2)", f.face, f.area_mm2);
               });
  }
  c.checks.push_back(check_at_least("certificate.coverage", c.covered_fraction, options.min_covered_fraction, covered));

  std::string floating = format("of %d support pieces rest on nothing", c.pieces);
  if (!c.floating.empty()) {
    floating +=
        "; first " + first_of(c.floating, [](const SupportCertificate::FloatingPiece& p) {
          return format("layer %d at (%.1f %.1f %.1f)", p.layer, p.centroid.x(), p.centroid.y(), p.centroid.z());
        });
  }
  c.checks.push_back(check_equal("certificate.floating_pieces", static_cast<double>(c.floating.size()), 0.0, floating));
}

void add_skeleton_checks(const SupportCertificateOptions& options, SupportCertificate& c) {
  constexpr double kAngleSlackDeg = 0.1;
  c.checks.push_back(check_at_most("certificate.edge_angle_deg", c.max_edge_angle_deg,
                                   options.self_support.degrees() + kAngleSlackDeg,
                                   "steepest edge against -grad G of the tet that it enters" +
                                       (c.steep_edges.empty() ? std::string() : "; edges " + ids(c.steep_edges))));
  c.checks.push_back(
      none_of("certificate.edges_through_model", c.edges_through_model, "edges that run inside the model", "edges"));
  c.checks.push_back(none_of("certificate.leaves_grounded", c.ungrounded_leaves, "leaves that reach no end", "nodes"));
  c.checks.push_back(
      none_of("certificate.branch_counts", c.miscounted_nodes, "nodes where branch counts do not add up", "nodes"));
  c.checks.push_back(check_equal("certificate.leaf_count_at_ends", c.leaf_count_at_ends, c.leaves,
                                 "sum of branch counts at the ends; number of leaves"));
  c.checks.push_back(
      none_of("certificate.ends", c.bad_ends,
              "ends off the platform or off an upward face of the model, or less than a layer below a leaf", "nodes"));
}

}  // namespace

SupportCertificate certify_support(const Model& model, const std::vector<Index>& blocked_faces, const Domain& domain,
                                   const ScalarField& field, const LayerStack& printed, const Skeleton* skeleton,
                                   const SupportCertificateOptions& options, const RunContext& run) {
  SupportCertificate result;
  const certificate::Subject subject{model, domain, field, printed, options, run};
  certificate::PrintedGrids grids;
  // The skeleton takes about as long as both grids.
  parallel_for(3, 1, run, [&](std::size_t, std::size_t, std::size_t job) {
    if (job > 0) grids[job - 1] = certificate::PrintedGrid(subject, static_cast<Material>(job - 1));
    if (job == 0 && skeleton != nullptr) certificate::prove_skeleton(subject, *skeleton, result);
  });
  run.progress(0.3);
  certificate::prove_coverage(subject, grids, blocked_faces, result);
  run.progress(0.5);
  certificate::prove_pieces(subject, grids, result);
  run.progress(0.9);
  add_support_checks(options, result);
  if (skeleton != nullptr) add_skeleton_checks(options, result);
  return result;
}

}  // namespace curvesup
