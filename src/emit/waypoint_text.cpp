#include "curvesup/emit/emit.h"
#include "emit/duet_job.h"
#include "emit/text.h"

namespace curvesup {

namespace {

using namespace emit;

void append_row(std::string& text, const Vec3& tip, const Vec3& axis, double e_mm, bool jump, Material material) {
  for (int i = 0; i < 3; ++i) {
    append_fixed(text, tip[i], 4);
    text += ' ';
  }
  for (int i = 0; i < 3; ++i) {
    append_fixed(text, axis[i], 6);
    text += ' ';
  }
  append_fixed(text, e_mm, 5);
  text += jump ? " 1" : " 0";
  text += material == Material::model ? " 1\n" : " 0\n";
}

std::string rows_of_toolpath(const Toolpaths& toolpaths, const Path& path, double per_mm3) {
  std::string text;
  double e = 0.0;
  for (Index i = 0; i < path.point_count; ++i) {
    const PathPoint& point = toolpaths.points[static_cast<std::size_t>(path.first_point + i)];
    e += point.volume_mm3 * per_mm3;
    append_row(text, point.position + point.tip_offset_mm * point.normal, point.normal, e, i == 0, path.material);
  }
  return text;
}

// The chains of one path: first .. last - 1 of motion.paths.
std::string rows_of_motion(const Motion& motion, std::size_t first, std::size_t last, double per_mm3) {
  std::string text;
  double e = 0.0;
  for (std::size_t chain = first; chain < last; ++chain) {
    const PathMotion& path = motion.paths[chain];
    for (Index i = 0; i < path.waypoint_count; ++i) {
      const Waypoint& waypoint = motion.waypoints[static_cast<std::size_t>(path.first_waypoint + i)];
      if (i > 0) e += waypoint.volume_mm3 * per_mm3;
      append_row(text, waypoint.tip_mm, waypoint.axis, e, i == 0, path.material);
    }
  }
  return text;
}

}  // namespace

std::vector<EmittedFile> emit_waypoints(const Toolpaths& toolpaths, const Motion& motion, const Machine& machine) {
  struct Range {
    std::size_t first = 0, last = 0;
  };
  std::vector<Range> chains(toolpaths.paths.size());
  for (std::size_t i = 0; i < motion.paths.size(); ++i) {
    Range& range = chains[static_cast<std::size_t>(motion.paths[i].path)];
    if (range.first == range.last) range.first = i;
    range.last = i + 1;
  }
  std::vector<EmittedFile> files(toolpaths.paths.size());
  for (std::size_t i = 0; i < files.size(); ++i) {
    const Path& path = toolpaths.paths[i];
    files[i].name = "waypoints/" + padded(static_cast<int>(i) + 1, 5) + (path.material == Material::support ? "S" : "") + ".txt";
    files[i].description = "waypoints of path " + std::to_string(i);
    files[i].write = [&toolpaths, &motion, &path, range = chains[i], per_mm3 = filament_per_mm3(machine, path.material)](const ByteSink& sink) {
      sink(range.first < range.last ? rows_of_motion(motion, range.first, range.last, per_mm3) : rows_of_toolpath(toolpaths, path, per_mm3));
    };
  }
  return files;
}

}  // namespace curvesup
