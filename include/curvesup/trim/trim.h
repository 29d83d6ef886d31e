#pragma once

#include <array>
#include <vector>

#include "curvesup/core/report.h"
#include "curvesup/domain/domain.h"
#include "curvesup/layers/layer_stack.h"
#include "curvesup/solid/solid.h"

namespace curvesup {

struct TrimOptions {
  // Longest step between samples of the solid, or a third of the radius of the thinnest strut that reaches there where that
  // is more. Cut points lie on the surface whatever this is.
  double edge_length_mm = 0.4;
  double min_piece_area_mm2 = 0.32;  // smaller pieces are removed and listed; half a squared bead
  double bead_width_mm = 0.8;
  // Support thicker than this is laid in passes; 0: than a bead is wide, or than 1.2 to 1.5 times the model's median thickness
  // where the width is outside of that.
  double max_height_mm = 0.0;
  int max_passes = 12;
  bool remove_floating = true;  // pieces that nothing carries
};

// A piece that is not printed: smaller than min_piece_area_mm2, or with nothing below it.
struct RemovedPiece {
  Index layer = 0;
  int pass = 0;
  int passes = 1;
  double area_mm2 = 0.0;
  Vec3 centroid = Vec3::Zero();
  bool floating = false;
};

// Areas of the support's layers G = (k + 1/2) / N: untrimmed = kept + in_passes + cut_away + removed.
struct TrimAreas {
  double untrimmed_mm2 = 0.0;
  double kept_mm2 = 0.0;       // printed as one layer
  double in_passes_mm2 = 0.0;  // inside the solid, printed as passes in its place
  double cut_away_mm2 = 0.0;
  double removed_mm2 = 0.0;  // pieces listed as removed
};

struct TrimReport {
  TrimAreas areas;
  // By material: sum of area times height, where the height is the local thickness or, where that is less, the height of the
  // nozzle tip (half a thickness above the layer) over the platform.
  std::array<double, kMaterialCount> untrimmed_volume_mm3{}, printed_volume_mm3{};
  Index support_layers = 0;  // values of k with printed support
  Index support_pieces = 0;  // face-connected parts of a printed support sheet
  Index pieces_in_passes = 0;
  Index passes_max = 1;
  Index triangles = 0;
  double max_height_mm = 0.0;  // the one used
  double model_thickness_p50_mm = 0.0;
  double support_height_p50_mm = 0.0, support_height_p99_mm = 0.0;  // 1 / (N m |grad G|), by printed area
  double support_height_min_mm = 0.0, support_height_max_mm = 0.0;
  std::vector<RemovedPiece> removed;  // by layer; in one, small ones first
  std::vector<Check> checks;
};

struct TrimResult {
  LayerStack stack;  // printed: the model's sheets, and the support's inside the solid
  TrimReport report;
};

// Cuts the support's layers by the solid (paper, equation 2 and the cases N = 0..3 of its trimming step). A triangle is
// skipped only when the solid's interval bound proves it outside; else it is sampled at a lattice. A triangle that is all
// inside stays whole; inside, samples up to four steps apart stand for what lies between when they and their middle are well
// inside: a notch or hole narrower than that can be printed over, no strut can be missed. Cut points are roots of the solid, those on
// an edge decided by the edge alone and shared by its two triangles, so that a sheet stays without cracks. Between them the
// border follows the surface within 0.013 mm, and what it encloses of the triangle is triangulated anew. Inside is value >= 0.
//
// Of the printed sheets, the model's among them, vertices are merged where that does not change what is printed; about half
// of the triangles go. Triangles stay within 0.01 mm of the plane of their tet, borders of the solid move by up to 0.018 mm and
// enclose the same area. The model's borders, and so what it shares with the support, stay.
//
// Support thicker than max_height_mm is laid in m passes at G = (k + (j + 1/2) / m) / N. One m holds for a whole connected
// region of the slab k / N <= G < (k + 1) / N: the pieces of the layer k + 1/2 and all pieces of the passes that lie over or
// under them along grad G. Spots that this leaves thicker than max_height_mm, or than 1.5 times what is usual without it, get
// more passes tet by tet, up to max_passes.
//
// A piece with less than 0.3 of its area over the model, other support or the platform cannot be laid: the lowest layers of
// a trunk beside a model part that is thinner than the trunk. Of such pieces only what rests stays, and beside that as much
// as the layer is thick: the trunk widens as it is carried. The rest is removed and listed.
//
// `untrimmed` is the result of slice_layers. Parallel over layers; same bytes for any thread count.
[[nodiscard]] TrimResult trim_layers(const Domain& domain, const ScalarField& field, const LayerStack& untrimmed,
                                     const Solid& solid, const TrimOptions& options = {}, const RunContext& run = {});

}  // namespace curvesup
