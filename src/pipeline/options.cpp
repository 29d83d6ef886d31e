#include "options.h"

#include <algorithm>
#include <cmath>

#include "curvesup/core/error.h"
#include "curvesup/io/surface_file.h"
#include "option_table.h"

namespace curvesup {

namespace {

ConfigKey plain_key(const char* path, KeyType type, Json value, const char* doc, bool nullable = false) {
  ConfigKey key;
  key.path = path;
  key.type = type;
  key.default_value = std::move(value);
  key.doc = doc;
  key.nullable = nullable;
  return key;
}

ConfigKey ranged_key(const char* path, KeyType type, Json value, double min, double max, const char* doc, bool nullable = false) {
  ConfigKey key = plain_key(path, type, std::move(value), doc, nullable);
  key.min = min;
  key.max = max;
  return key;
}

const OptionTable<PlaceOptions>& place_table() {
  static const auto table = [] {
    OptionTable<PlaceOptions> t("model");
    ConfigKey axis = plain_key("up_axis", KeyType::choice, "z", "Axis of the file that points up; y: (x, y, z) -> (x, -z, y).");
    axis.choices = {"x", "y", "z"};
    t.custom(axis, [](PlaceOptions& options, const Json& value) { options.up_axis = value.get<std::string>(); });
    t.number("scale", CURVESUP_FIELD(scale), 1e-6, 1e6, "Factor on the file's coordinates, applied first.");
    t.numbers("rotate_deg", 3, 1.0, CURVESUP_ELEMENT(rotate_deg[static_cast<int>(i)]), -3600, 3600,
              "Rotation about x, then y, then z, about the origin, after the up axis.");
    t.numbers("translate_mm", 3, 1.0, CURVESUP_ELEMENT(translate_mm[static_cast<int>(i)]), -1e8, 1e8, "Move after the rotation.");
    t.boolean("drop_to_platform", CURVESUP_FIELD(drop_to_platform), "Move along z until the lowest vertex is at z = 0.");
    t.custom(ranged_key("max_tet_volume_mm3", KeyType::number, 20.0, 1e-6, 1e9, "Tets that fill a .stl or .obj surface are not larger, after scaling."));
    return t;
  }();
  return table;
}

const OptionTable<FieldOptions>& field_table() {
  static const auto table = [] {
    OptionTable<FieldOptions> t("field");
    t.choice("source", CURVESUP_FIELD(source), {"direction", "scalar_file", "vector_file"},
             "Where G comes from: one constant direction, a value per vertex, or a vector per tet.");
    t.custom(plain_key("path", KeyType::text, nullptr, "File of the scalars or vectors.", true));
    t.numbers("direction", 3, 1.0, CURVESUP_ELEMENT(direction[static_cast<int>(i)]), -1e6, 1e6,
              "The constant print direction, in the placed frame; [0, 0, 1] gives planar layers.");
    return t;
  }();
  return table;
}

// What several stages share has one key; each stage's own table reads it.
constexpr const char* kAngleDoc = "A face steeper than this against the print direction needs support; no branch is steeper.";
constexpr const char* kLeafRadiusDoc = "Radius of a strut that carries one leaf; thicker ones follow by area.";

const OptionTable<SkeletonOptions>& skeleton_table() {
  static const auto table = [] {
    OptionTable<SkeletonOptions> t("support");
    t.angle("self_support_angle_deg", CURVESUP_FIELD(self_support), 1, 89, kAngleDoc);
    t.number("leaf_radius_mm", CURVESUP_FIELD(leaf_radius_mm), 0.01, 100, kLeafRadiusDoc);
    t.custom(ranged_key("leaf_spacing_mm", KeyType::number, nullptr, 0, 1000,
                        "No overhang point is farther than this from a leaf, across d_p; null: leaf radius + half a bead; 0: "
                        "every overhang vertex, as in the paper.", true),
             [](SkeletonOptions& options, const Json& value) { options.leaf_spacing_mm = value.is_null() ? -1.0 : value.get<double>(); });
    t.number("merge_radius_mm", CURVESUP_FIELD(merge_radius_mm), 0, 1000, "Nodes of one layer nearer than this to a host follow it.");
    t.number("max_radius_mm", CURVESUP_FIELD(max_radius_mm), 0.01, 1000, "No strut is thicker than this.");
    t.number("min_trunk_radius_mm", CURVESUP_FIELD(min_trunk_radius_mm), 0, 1000, "Struts that carry two leaves or more are at least this thick.");
    t.number("thickening_per_mm", CURVESUP_FIELD(thickening_per_mm), 0, 1, "Radius gained per millimetre of the way down.");
    ConfigKey contact = plain_key("allow_model_contact", KeyType::choice, "true", "Whether branches may end on the model.");
    contact.choices = {"true", "false", "prefer_platform"};
    t.custom(contact, [](SkeletonOptions& options, const Json& value) {
      const std::string text = value.get<std::string>();
      options.model_contact = text == "true" ? ModelContact::allowed : text == "false" ? ModelContact::forbidden : ModelContact::prefer_platform;
    });
    t.choice("host_direction", CURVESUP_FIELD(host_direction), {"normal", "down"},
             "Where a host branch goes: against the layer normal (the paper), or straight down.");
    return t;
  }();
  return table;
}

const OptionTable<SolidOptions>& solid_table() {
  static const auto table = [] {
    OptionTable<SolidOptions> t("support");
    t.choice("method", CURVESUP_FIELD(method), {"tree", "envelope", "none"},
             "tree: the solid around the skeleton; envelope: the alpha-shape of straight rays; none.");
    t.number("kernel_ratio", CURVESUP_FIELD(convolution.kernel_ratio), 1.1, 1.84, "Radius of the convolution kernel over the strut radius.");
    t.number("foot_radius_mm", CURVESUP_FIELD(convolution.foot_radius_mm), 0, 1000, "Radius of the cone at each platform end; 0: none.");
    t.integer("foot_layers", CURVESUP_FIELD(convolution.foot_layers), 0, 1000, "Height of that cone in layers.");
    t.integer("interface_layers", CURVESUP_FIELD(interface.interface_layers), 0, 100, "Full layers of support right under the overhang.");
    t.number("top_gap_mm", CURVESUP_FIELD(interface.top_gap_mm), 0, 10, "Gap between the overhang and the support under it, along d_p.");
    t.number("side_gap_mm", CURVESUP_FIELD(interface.side_gap_mm), 0, 10, "Gap between the support and the model's walls.");
    t.number("envelope_alpha_mm", CURVESUP_FIELD(envelope_alpha_mm), 0.01, 1000, "Alpha, a radius, of the envelope method.");
    return t;
  }();
  return table;
}

const OptionTable<TrimOptions>& trim_table() {
  static const auto table = [] {
    OptionTable<TrimOptions> t("support");
    t.custom(ranged_key("min_piece_area_mm2", KeyType::number, nullptr, 0, 1000,
                        "Smaller pieces of a support layer are removed and listed; null: half a squared bead.", true),
             [](TrimOptions& options, const Json& value) { options.min_piece_area_mm2 = value.is_null() ? -1.0 : value.get<double>(); });
    t.integer("max_passes", CURVESUP_FIELD(max_passes), 1, 100, "Most passes in which a thick support layer is laid.");
    return t;
  }();
  return table;
}

const OptionTable<HullOptions>& hull_table() {
  static const auto table = [] {
    OptionTable<HullOptions> t("domain");
    t.number("hull_edge_mm", CURVESUP_FIELD(edge_length_mm), 0.1, 1000, "Edge length of the remeshed hull.");
    t.number("hull_margin_mm", CURVESUP_FIELD(margin_mm), 0.01, 1000, "Distance of the hull from model and trajectories.");
    return t;
  }();
  return table;
}

const OptionTable<DomainOptions>& domain_table() {
  static const auto table = [] {
    OptionTable<DomainOptions> t("domain");
    t.number("max_tet_volume_mm3", CURVESUP_FIELD(max_tet_volume_mm3), 1e-3, 1e6, "Largest tet of the support domain.");
    return t;
  }();
  return table;
}

const OptionTable<ExtensionOptions>& extension_table() {
  static const auto table = [] {
    OptionTable<ExtensionOptions> t("domain");
    t.number("floor_weight", CURVESUP_FIELD(floor_weight), 0, 1e6,
             "How strongly layers are kept flat at the floor; stronger: fewer support layers, thicker columns.");
    t.number("outflow_weight", CURVESUP_FIELD(outflow_weight), 0, 1e6, "How strongly supports are kept from leaving the hull sideways.");
    t.integer("outflow_rounds", CURVESUP_FIELD(outflow_rounds), 0, 100, "Rounds in which the sides of the hull that leave it are found.");
    return t;
  }();
  return table;
}

const OptionTable<ToolpathOptions>& toolpath_table() {
  static const auto table = [] {
    OptionTable<ToolpathOptions> t("toolpath");
    t.number("bead_width_mm", CURVESUP_FIELD(bead_width_mm), 0.05, 20, "Width of a bead, and distance of neighbouring rings.");
    t.custom(ranged_key("min_bead_mm", KeyType::number, nullptr, 0.01, 20,
                        "Narrowest bead where rings meet or a piece is thin; null: a quarter of the bead width.", true),
             [](ToolpathOptions& options, const Json& value) { options.min_bead_mm = value.is_null() ? 0.0 : value.get<double>(); });
    t.custom(ranged_key("max_bead_mm", KeyType::number, nullptr, 0.05, 40,
                        "Widest bead where rings meet or a piece is thin, up to twice the bead width; null: one and a half times that.", true),
             [](ToolpathOptions& options, const Json& value) { options.max_bead_mm = value.is_null() ? 0.0 : value.get<double>(); });
    t.choice("seam", CURVESUP_FIELD(seam), {"nearest", "aligned", "sharpest_corner", "random"}, "Where a ring starts.");
    t.integer("seed", CURVESUP_FIELD(seed), 0, 4294967295.0, "Seed of the random seam.");
    t.boolean("link_rings", CURVESUP_FIELD(link_rings), "Join the rings of a piece by short steps on the surface.");
    t.integer("support_batch_layers", CURVESUP_FIELD(support_batch_layers), 1, 1000, "Layers of support that are laid before those of the model, where the nozzle meets none of them.");
    t.number("model_speed_mm_s", CURVESUP_FIELD(material[0].speed_mm_s), 0.1, 500, "Speed of the nozzle on the model.");
    t.number("support_speed_mm_s", CURVESUP_FIELD(material[1].speed_mm_s), 0.1, 500, "Speed of the nozzle on the support.");
    t.choice("model_fill", CURVESUP_FIELD(material[0].pattern), {"contour", "contour+zigzag"},
             "Rings all over the model's layers, or some rings and lines inside of them that turn from layer to layer.");
    t.choice("support_fill", CURVESUP_FIELD(material[1].pattern), {"contour", "contour+zigzag"}, "The same of the support's layers.");
    t.integer("model_perimeters", CURVESUP_FIELD(material[0].perimeters), 1, 1000, "Rings around the lines of the model.");
    t.integer("support_perimeters", CURVESUP_FIELD(material[1].perimeters), 1, 1000, "Rings around the lines of the support.");
    t.number("model_line_angle_deg", CURVESUP_FIELD(material[0].line_angle_deg), -360, 360, "Normal of the model's lines from the x axis, on even layers.");
    t.number("support_line_angle_deg", CURVESUP_FIELD(material[1].line_angle_deg), -360, 360, "Normal of the support's lines from the x axis, on even layers.");
    t.optional_number("support_line_spacing_mm", CURVESUP_FIELD(material[1].line_spacing_mm), 0.05, 100,
                      "Distance of the support's lines; room stays between them, but not right under the model. Null: none.");
    t.number("batch_clearance_mm", CURVESUP_FIELD(batch_clearance_mm), 0, 100, "Support laid ahead is nowhere this near to the model beads below it.");
    t.number("overhang_speed_factor", CURVESUP_FIELD(overhang_speed_factor), 0.01, 10, "Factor on the speed where nothing was laid under the bead.");
    t.number("first_layer_speed_factor", CURVESUP_FIELD(first_layer_speed_factor), 0.01, 10, "Factor on the speed where the bead touches the platform.");
    t.number("min_speed_mm_s", CURVESUP_FIELD(min_speed_mm_s), 0.1, 500, "The slow-down of small layers goes no lower.");
    t.number("min_layer_time_s", CURVESUP_FIELD(min_layer_time_s), 0, 3600, "Least time for a layer of one material; what takes less is laid more slowly.");
    t.number("max_flow_mm3_s", CURVESUP_FIELD(max_flow_mm3_s), 0.01, 1000, "Most plastic that the nozzle melts.");
    t.optional_number("min_height_mm", CURVESUP_FIELD(min_height_mm), 0.001, 100, "Beads are not lower than this; a check when set.");
    t.optional_number("max_height_mm", CURVESUP_FIELD(max_height_mm), 0.001, 100,
                      "Beads are not higher than this: a check when set. Support layers thicker than this are laid in passes; null: than a bead is wide, within 1.2 and 1.5 times the model's median.");
    return t;
  }();
  return table;
}

template <class Target>
void append(std::vector<ConfigKey>& keys, const OptionTable<Target>& table) {
  for (ConfigKey& key : table.keys()) keys.push_back(std::move(key));
}

}  // namespace

PlaceOptions place_options(const Json& config) { return place_table().read(config); }
FieldOptions field_options(const Json& config) { return field_table().read(config); }
HullOptions hull_options(const Json& config) {
  HullOptions options = hull_table().read(config);
  options.self_support = skeleton_options(config).self_support;
  return options;
}
ExtensionOptions extension_options(const Json& config) { return extension_table().read(config); }
DomainOptions domain_options(const Json& config) { return domain_table().read(config); }
SkeletonOptions skeleton_options(const Json& config) {
  SkeletonOptions options = skeleton_table().read(config);
  options.bead_width_mm = toolpath_options(config).bead_width_mm;
  return options;
}
ToolpathOptions toolpath_options(const Json& config) {
  ToolpathOptions options = toolpath_table().read(config);
  const InterfaceOptions interface = solid_options(config).interface;
  options.interface_layers = std::max(1, interface.interface_layers);
  options.interface_gap_mm = interface.top_gap_mm;
  // In whole nanometres: nobody asks for the last bit of a product.
  const auto of_width = [&](double part) { return std::round(part * options.bead_width_mm * 1e6) / 1e6; };
  if (options.min_bead_mm == 0.0) options.min_bead_mm = of_width(0.25);
  if (options.max_bead_mm == 0.0) options.max_bead_mm = of_width(1.5);
  return options;
}

namespace {

Vec3 vec_at(const Json& numbers, std::size_t first) {
  return {numbers[first].get<double>(), numbers[first + 1].get<double>(), numbers[first + 2].get<double>()};
}

[[noreturn]] void bad_region(const std::string& key, const Json& region) {
  throw Error(ErrorKind::usage, "config key " + key, "value " + region.dump() + " is no region",
              "give {\"box\": [x0,y0,z0,x1,y1,z1]}, {\"sphere\": [x,y,z,r]}, {\"faces\": [ids]} or {\"mesh\": \"file.stl\"}");
}

Region read_region(const std::string& key, const Json& json, const ConfigSource& source) {
  if (!json.is_object() || json.size() != 1) bad_region(key, json);
  const auto& [shape, value] = *json.items().begin();
  const auto numbers = [&](std::size_t count) {
    const bool good = value.is_array() && (count == 0 || value.size() == count) &&
                      std::all_of(value.begin(), value.end(), [](const Json& v) { return v.is_number(); });
    if (!good) bad_region(key, json);
  };
  if (shape == "box") {
    numbers(6);
    return Region::box(vec_at(value, 0), vec_at(value, 3));
  }
  if (shape == "sphere") {
    numbers(4);
    return Region::sphere(vec_at(value, 0), value[3].get<double>());
  }
  if (shape == "faces") {
    numbers(0);
    if (!std::all_of(value.begin(), value.end(), [](const Json& v) { return v.is_number_integer(); })) bad_region(key, json);
    return Region::of_faces(value.get<std::vector<Index>>());
  }
  if (shape != "mesh" || !value.is_string()) bad_region(key, json);
  return Region::inside(read_surface_file(config_file_path(source, key, value.get<std::string>())));
}

std::vector<Region> read_regions(const std::string& key, const Json& config, const ConfigSource& source) {
  std::vector<Region> regions;
  for (const Json& region : config_value(config, key)) regions.push_back(read_region(key, region, source));
  return regions;
}

}  // namespace

OverhangOptions overhang_options(const Json& config, const ConfigSource& source) {
  OverhangOptions options;
  options.self_support = skeleton_options(config).self_support;
  options.enforce = read_regions("support.enforce", config, source);
  options.block = read_regions("support.block", config, source);
  return options;
}

SupportCertificateOptions certificate_options(const Json& config) {
  const SkeletonOptions skeleton = skeleton_options(config);
  return {.self_support = skeleton.self_support, .leaf_radius_mm = skeleton.leaf_radius_mm, .bead_width_mm = skeleton.bead_width_mm,
          .top_gap_mm = solid_options(config).interface.top_gap_mm, .enforced_faces = {}};
}

SolidOptions solid_options(const Json& config) { return solid_table().read(config); }

TrimOptions trim_options(const Json& config) {
  TrimOptions options = trim_table().read(config);
  const ToolpathOptions toolpath = toolpath_options(config);
  if (options.min_piece_area_mm2 < 0.0) options.min_piece_area_mm2 = 0.5 * toolpath.bead_width_mm * toolpath.bead_width_mm;
  options.bead_width_mm = toolpath.bead_width_mm;
  options.max_height_mm = toolpath.max_height_mm.value_or(0.0);
  options.edge_length_mm = skeleton_options(config).leaf_radius_mm;
  return options;
}

ToolpathCertificateOptions toolpath_certificate_options(const Json& config) {
  const ToolpathOptions toolpath = toolpath_options(config);
  ToolpathCertificateOptions options;
  options.bead_width_mm = toolpath.bead_width_mm;
  options.interface_layers = toolpath.interface_layers;
  options.interface_gap_mm = toolpath.interface_gap_mm;
  for (int m = 0; m < kMaterialCount; ++m) {
    options.perimeters[m] = toolpath.material[m].pattern == FillPattern::contour_zigzag ? toolpath.material[m].perimeters : 0;
    options.line_spacing_mm[m] = toolpath.material[m].line_spacing_mm.value_or(0.0);
    options.dense[m] = options.line_spacing_mm[m] <= options.bead_width_mm;
  }
  return options;
}

std::vector<ConfigKey> part_keys() {
  std::vector<ConfigKey> keys;
  append(keys, place_table());
  append(keys, field_table());
  keys.push_back(ranged_key("layers.count", KeyType::integer, nullptr, 1, 100000, "N, the number of layers over the model's G in [0, 1].", true));
  keys.push_back(ranged_key("layers.thickness_mm", KeyType::number, 0.6, 0.01, 100, "Wanted median layer thickness, used where count is null.", true));
  append(keys, solid_table());
  append(keys, skeleton_table());
  append(keys, trim_table());
  keys.push_back(plain_key("support.enforce", KeyType::list, Json::array(),
                           "Regions that need support whatever their angle: {\"box\": [x0,y0,z0,x1,y1,z1]}, {\"sphere\": [x,y,z,r]}, "
                           "{\"faces\": [ids]} or {\"mesh\": \"file.stl\"}."));
  keys.push_back(plain_key("support.block", KeyType::list, Json::array(), "Regions that get no support; same forms as enforce."));
  append(keys, hull_table());
  append(keys, domain_table());
  append(keys, extension_table());
  append(keys, toolpath_table());
  return keys;
}

std::vector<ConfigKey> output_keys() {
  return {plain_key("output.artifacts", KeyType::list, {"domain", "layers", "skeleton", "toolpaths", "robot", "duet", "preview", "plots"},
                    "Which of the large outputs are written; report, manifest and config always are."),
          plain_key("output.waypoints", KeyType::boolean, false, "Write waypoints/NNNNN.txt, one file a path, for other post-processors.")};
}

}  // namespace curvesup
