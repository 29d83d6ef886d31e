#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "curvesup/core/report.h"
#include "curvesup/domain/domain.h"
#include "curvesup/layers/layer_stack.h"
#include "curvesup/toolpath/toolpaths.h"

namespace curvesup {

enum class SeamRule : std::uint8_t { nearest, aligned, sharpest_corner, random };

// contour: rings all over. contour_zigzag: some rings, and lines inside of them that turn by a right angle from layer to
// layer; the lines are equally far apart along the surface.
enum class FillPattern : std::uint8_t { contour, contour_zigzag };

// What may differ between model and support.
struct MaterialToolpathOptions {
  double speed_mm_s = 10.0;
  FillPattern pattern = FillPattern::contour;
  int perimeters = 2;                      // rings around the lines
  double line_angle_deg = 45.0;            // of the lines' normal from the x axis, on even layers
  std::optional<double> line_spacing_mm;   // wider than a bead: what lies between the lines stays open; null: nothing does
};

struct ToolpathOptions {
  double bead_width_mm = 0.8;
  double min_bead_mm = 0.2;  // centre lines have a width from here ...
  double max_bead_mm = 1.2;  // ... to here
  std::array<MaterialToolpathOptions, kMaterialCount> material{};  // by Material
  SeamRule seam = SeamRule::nearest;
  unsigned seed = 1;  // of SeamRule::random
  bool link_rings = true;
  // Layers of support that are laid before those of the model, as long as no model bead among them has higher support
  // within reach of the nozzle.
  int support_batch_layers = 1;
  double batch_clearance_mm = 4.0;

  // Support this near under the model is never sparse.
  int interface_layers = 1;
  double interface_gap_mm = 0.0;  // between the model and the support under it

  double first_layer_speed_factor = 0.5;  // where the bead touches the platform
  double overhang_speed_factor = 1.0;     // where nothing was laid under the bead
  double min_speed_mm_s = 2.0;            // the slow-down of small layers goes no lower
  double min_layer_time_s = 5.0;          // from the start of a layer of one material to that of the next one
  double max_flow_mm3_s = 8.0;
  std::optional<double> min_height_mm, max_height_mm;  // null: no check

  double filament_diameter_mm = 1.75;
  double travel_speed_mm_s = 50.0, jump_overhead_s = 1.5, material_change_s = 60.0;  // of the time estimate
  double retract_travel_mm = 2.0;  // a jump farther than this is counted as a retraction
};

// A piece that got no path of its own.
struct UnprintedPiece {
  Index layer = 0;
  Material material = Material::model;
  Vec3 position = Vec3::Zero();
  double area_mm2 = 0.0;
};

struct ToolpathReport {
  Index paths = 0, points = 0, pieces = 0;
  Index pieces_without_path = 0;  // with an area that a bead can fill
  Index dots = 0;                 // pieces or centres smaller than a bead, laid as one short line
  Index dust_pieces = 0;          // under 2 % of a bead's square: part of the bead next to them
  double dust_area_mm2 = 0.0;
  Index rings = 0, centre_lines = 0, lines = 0;
  Index sparse_pieces = 0;     // with lines that leave room between them
  Index interface_pieces = 0;  // of a material that is filled sparsely, dense because the model lies right over them
  Index jumps = 0, jumps_inside_pieces = 0, naive_jumps = 0, naive_jumps_inside_pieces = 0, retractions = 0;
  Index material_changes = 0;
  double travel_mm = 0.0;
  std::array<double, kMaterialCount> length_mm{}, volume_mm3{}, layer_volume_mm3{}, filament_mm{};
  double time_s = 0.0, laying_time_s = 0.0;
  double overhang_mm = 0.0;    // length of beads over nothing; 0 when nobody asks for their speed
  double slowed_mm = 0.0;      // length of beads that were slowed down for min_layer_time_s
  double max_flow_mm3_s = 0.0;
  int batched_layers = 0;      // layers of support that were laid before the model of the layer below
  double min_height_mm = 0.0, max_height_mm = 0.0;
  int groups = 0;
  std::vector<UnprintedPiece> unprinted;  // dust and pieces without a path, the largest first, at most 100
  std::vector<Check> checks;
};

struct ToolpathResult {
  Toolpaths toolpaths;
  ToolpathReport report;
};

// Beads over all sheets of the printed stack, in print order: layers ascending (by support_batch_layers), at most one
// change of material a layer, inside a material the pieces that others rest on first, then by travel.
//
// Every point lies on a triangle of its sheet; the segment that ends at a point has the height of the layer under it
// and volume = height * width * length exactly. Distances are measured along the surface; no path crosses a gap.
// Same bytes for any number of threads. Near linear in the triangles. Throws Error{usage} for options out of range.
[[nodiscard]] ToolpathResult plan_toolpaths(const Domain& domain, const ScalarField& field, const LayerStack& printed,
                                            const ToolpathOptions& options = {}, const RunContext& run = {});

// The same from the gradient of G on each triangle of the stack: all that the planner needs of domain and field.
[[nodiscard]] ToolpathResult plan_toolpaths(std::span<const Vec3> triangle_gradient, const LayerStack& printed,
                                            const ToolpathOptions& options = {}, const RunContext& run = {});

}  // namespace curvesup
