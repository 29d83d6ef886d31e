#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stdexcept>
#include <string>
#include <vector>

#include "curvesup/check/check_output.h"
#include "curvesup/emit/emit.h"
#include "curvesup/io/sha256.h"
#include "curvesup/io/vtk_file.h"
#include "curvesup/motion/motion.h"
#include "helpers/temp_folder.h"
#include "helpers/toolpath_shapes.h"

// A small print, written as the pipeline writes it, for tests that break it.
namespace curvesup {

struct WrittenPrint {
  Machine machine;
  std::map<std::string, std::string> files;  // by name, without manifest.json
  nlohmann::json parts;                      // of the manifest
};

// Straight strokes with sharp turns: every inner point stops both machines.
inline void add_zigzag(Toolpaths& toolpaths, const Vec3& corner, Index layer, Material material) {
  std::vector<Vec3> positions, normals;
  for (int i = 0; i < 10; ++i) positions.push_back(corner + Vec3(i % 2 == 0 ? 0.0 : 12.0, 0.8 * i, 0.0));
  normals.assign(positions.size(), Vec3::UnitZ());
  shapes::add_path(toolpaths, positions, normals, layer, material);
}

// Three layers of model and support; the second ring of the model leans, and needs marks and gates.
inline Toolpaths three_layers() {
  Toolpaths toolpaths;
  for (Index k = 0; k < 3; ++k) {
    const double z = 0.3 + 0.6 * k;
    shapes::add_ring(toolpaths, Vec3(-15, 0, z), 6.0, 0.0, k, 80, Material::support);
    shapes::add_ring(toolpaths, Vec3(15, 0, z), 14.0, 0.15 * k, k, 240, Material::model);
    if (k == 1) add_zigzag(toolpaths, Vec3(40, 0, z), k, Material::model);
  }
  return toolpaths;
}

inline std::string toolpaths_file(const Toolpaths& toolpaths) {
  VtkPolyData data;
  std::vector<double> normal, offset, volume, width;
  for (const PathPoint& point : toolpaths.points) {
    data.line_points.push_back(static_cast<Index>(data.points.size()));
    data.points.push_back(point.position);
    for (int i = 0; i < 3; ++i) normal.push_back(point.normal[i]);
    offset.push_back(point.tip_offset_mm);
    volume.push_back(point.volume_mm3);
    width.push_back(point.width_mm);
  }
  std::vector<std::int32_t> layer, group;
  std::vector<std::uint8_t> material, kind;
  for (const Path& path : toolpaths.paths) {
    data.line_ends.push_back(path.first_point + path.point_count);
    layer.push_back(path.layer);
    group.push_back(path.group);
    material.push_back(static_cast<std::uint8_t>(path.material));
    kind.push_back(static_cast<std::uint8_t>(path.kind));
  }
  data.point_data = {{"normal", 3, normal}, {"tip_offset_mm", 1, offset}, {"volume_mm3", 1, volume}, {"width_mm", 1, width}};
  data.cell_data = {{"layer", 1, layer}, {"group", 1, group}, {"material", 1, material}, {"kind", 1, kind}};
  return to_vtp(data, VtkPrecision::float64);
}

inline WrittenPrint write_print(const Toolpaths& toolpaths, const Machine& machine, const MotionOptions& options = {}) {
  const MotionResult motion = plan_motion(toolpaths, machine, options);
  if (!motion.report.unreachable.empty()) throw std::runtime_error("out of reach");
  const EmittedFiles emitted = emit_robot(toolpaths, motion.motion, machine);
  WrittenPrint print;
  print.machine = machine;
  for (const EmittedFile& file : emitted.files) print.files[file.name] = text_of(file);
  print.files["toolpaths.vtp"] = toolpaths_file(toolpaths);
  print.parts = nlohmann::json::array();
  for (const EmittedPart& part : emitted.parts) {
    nlohmann::json paths = nlohmann::json::array();
    for (const EmittedChain& chain : part.chains) paths.push_back(chain.path);
    print.parts.push_back({{"file", part.file}, {"paths", paths}, {"moves", part.moves}, {"expected_s", part.expected_s}, {"duet_offset", part.duet_offset}});
  }
  return print;
}

// Writes the files with a manifest that fits them, then checks the folder.
inline CheckOutputResult check_written(const WrittenPrint& print, bool fresh_hashes = true, const WrittenPrint* hashed = nullptr, int threads = 1) {
  const TempFolder folder;
  nlohmann::json files = nlohmann::json::array();
  for (const auto& [name, content] : print.files) {
    std::filesystem::create_directories((folder.path() / name).parent_path());
    folder.write(name, content);
  }
  const WrittenPrint& listed = fresh_hashes || !hashed ? print : *hashed;
  for (const auto& [name, content] : listed.files) {
    files.push_back({{"path", name}, {"bytes", content.size()}, {"sha256", sha256_hex(content)}});
  }
  folder.write("manifest.json", nlohmann::json{{"files", files}, {"robot_parts", print.parts}}.dump());
  RunContext run;
  run.threads = threads;
  return check_output(folder.path(), print.machine, run);
}

}  // namespace curvesup
