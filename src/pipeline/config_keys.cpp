#include "curvesup/pipeline/config.h"

namespace curvesup {

namespace {

std::vector<ConfigKey> part_keys() {
  using enum KeyType;
  const Json none = nullptr;
  return {
      {"model.up_axis", choice, "z", "Axis of the file that points up: z as is, y: (x, y, z) -> (x, -z, y), x: (x, y, z) -> (-z, y, x).", 0, 0, {"x", "y", "z"}},
      {"model.scale", number, 1.0, "Factor on the file's coordinates, applied first.", 1e-6, 1e6},
      {"model.rotate_deg", numbers, {0, 0, 0}, "Rotation about x, then y, then z, about the origin, after the up axis.", -3600, 3600, {}, false, 3},
      {"model.translate_mm", numbers, {0, 0, 0}, "Move after the rotation.", -1e5, 1e5, {}, false, 3},
      {"model.drop_to_platform", boolean, false, "Move down (or up) until the lowest vertex is at z = 0."},

      {"field.source", choice, "direction", "Where G comes from: one constant direction, a value per vertex, or a vector per tet.", 0, 0, {"direction", "scalar_file", "vector_file"}},
      {"field.path", text, none, "File of the scalars or vectors.", 0, 0, {}, true},
      {"field.direction", numbers, {0, 0, 1}, "The constant print direction, in the placed frame; (0, 0, 1) gives planar layers.", -1e6, 1e6, {}, false, 3},

      {"layers.count", integer, none, "N, the number of layers over the model's G in [0, 1].", 1, 100000, {}, true},
      {"layers.thickness_mm", number, 0.6, "Wanted median layer thickness, used where count is null.", 0.01, 100, {}, true},

      {"support.method", choice, "tree", "tree: the skeleton's solid; envelope: the alpha-shape of straight rays; none.", 0, 0, {"tree", "envelope", "none"}},
      {"support.self_support_angle_deg", number, 45.0, "alpha: a face this much steeper than the print direction allows needs support.", 1, 89},
      {"support.leaf_radius_mm", number, 0.8, "Radius of a strut that carries one leaf; thicker ones follow by area.", 0.01, 100},
      {"support.leaf_spacing_mm", number, none, "No overhang point is farther than this from a leaf, across d_p; null: leaf radius + half a bead; 0: every overhang vertex.", 0, 1000, {}, true},
      {"support.merge_radius_mm", number, 6.0, "Nodes of one layer nearer than this to a host follow it.", 0, 1000},
      {"support.max_radius_mm", number, 6.0, "No strut is thicker than this.", 0.01, 1000},
      {"support.min_trunk_radius_mm", number, 0.0, "Struts that end on the platform are at least this thick there.", 0, 1000},
      {"support.thickening_per_mm", number, 0.0, "Radius gained per millimetre below the leaf.", 0, 1},
      {"support.allow_model_contact", choice, "true", "Whether branches may end on the model: true, false, or prefer_platform.", 0, 0, {"true", "false", "prefer_platform"}},
      {"support.host_direction", choice, "normal", "Where a host branch goes: against the layer normal (the paper), or straight down.", 0, 0, {"normal", "down"}},
      {"support.kernel_ratio", number, 1.5, "kappa: support radius of the convolution kernel over the strut radius.", 1.1, 1.85},
      {"support.foot_radius_mm", number, 0.0, "Radius of the foot where a trunk meets the platform; 0: no foot.", 0, 1000},
      {"support.foot_height_mm", number, 2.0, "Height over which a trunk widens to its foot.", 0.01, 1000},
      {"support.interface_layers", integer, 0, "Full support layers directly below the overhang.", 0, 1000},
      {"support.top_gap_mm", number, 0.0, "Gap between support and overhang along d_p.", 0, 100},
      {"support.side_gap_mm", number, 0.0, "Gap between support and the model's sides along the layer.", 0, 100},
      {"support.enforce", list, Json::array(), "Regions that need support whatever their angle: {\"box\": [x0,y0,z0,x1,y1,z1]}, {\"sphere\": [x,y,z,r]}, {\"faces\": [ids]} or {\"mesh\": \"file.stl\"}."},
      {"support.block", list, Json::array(), "Regions that get no support; same forms as enforce."},
      {"support.envelope_alpha_mm", number, 8.0, "Alpha (a radius) of the envelope method.", 0.01, 1000},
      {"support.min_piece_area_mm2", number, none, "Smaller pieces of a support layer are removed and listed; null: half a squared bead.", 0, 1000, {}, true},

      {"domain.hull_edge_mm", number, 5.0, "Edge length of the remeshed hull.", 0.1, 1000},
      {"domain.hull_margin_mm", number, 3.0, "Distance of the hull from model and trajectories.", 0.01, 1000},
      {"domain.max_tet_volume_mm3", number, 20.0, "Largest tet of the support domain.", 1e-3, 1e6},
  };
}

std::vector<ConfigKey> output_keys() {
  using enum KeyType;
  return {
      {"output.artifacts", list, {"domain", "layers", "skeleton", "toolpaths", "robot", "duet", "preview", "plots"}, "Which of the large outputs are written; report, manifest and config always are."},
      {"output.waypoints", boolean, false, "Write waypoints/NNNNN.txt, one file a path, for other post-processors."},
  };
}

std::vector<ConfigKey> all_keys() {
  std::vector<ConfigKey> keys;
  const auto append = [&](std::vector<ConfigKey> rows) {
    for (ConfigKey& row : rows) {
      const bool numeric = row.type == KeyType::integer || row.type == KeyType::number || row.type == KeyType::numbers;
      if (!numeric) {
        row.min = -std::numeric_limits<double>::infinity();
        row.max = -row.min;
      }
      keys.push_back(std::move(row));
    }
  };
  append(part_keys());
  append(toolpath_keys());
  append(machine_keys());
  append(output_keys());
  return keys;
}

}  // namespace

std::span<const ConfigKey> config_keys() {
  static const std::vector<ConfigKey> keys = all_keys();
  return keys;
}

}  // namespace curvesup
