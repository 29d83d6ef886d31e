#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <span>

#include "check/emitted_sync.h"
#include "check/polyline_match.h"
#include "curvesup/core/error.h"
#include "curvesup/core/parallel.h"
#include "curvesup/io/vtk_file.h"

namespace curvesup::emitted {

namespace {

constexpr double kNearHop_mm = 3.0;  // shorter crossings may hop
constexpr double kHop_mm = 1.0;

// Of an array, as it is, or in another type.
template <class Value>
std::vector<Value> values_of(std::vector<VtkArray>& arrays, const char* name, std::size_t count) {
  for (VtkArray& array : arrays) {
    if (array.name != name) continue;
    std::vector<Value> values;
    if (auto* same = std::get_if<std::vector<Value>>(&array.values)) values = std::move(*same);
    else std::visit([&](const auto& from) { values.assign(from.begin(), from.end()); }, array.values);
    if (values.size() == count) return values;
  }
  throw Error(ErrorKind::input, "toolpaths.vtp", std::string("has no array ") + name, "slice again");
}

}  // namespace

SourcePaths read_source(const std::filesystem::path& file) {
  VtkPolyData data = read_vtp(file);
  const std::size_t points = data.points.size(), paths = data.line_ends.size();
  bool in_order = data.line_points.size() == points;
  for (std::size_t i = 0; in_order && i < points; ++i) in_order = data.line_points[i] == static_cast<Index>(i);
  if (!in_order) throw Error(ErrorKind::input, "toolpaths.vtp", "its lines do not take the points in their order", "slice again");
  SourcePaths source;
  source.layer = values_of<int>(data.cell_data, "layer", paths);
  const auto material = values_of<std::uint8_t>(data.cell_data, "material", paths), kind = values_of<std::uint8_t>(data.cell_data, "kind", paths);
  source.material.assign(material.begin(), material.end());
  source.kind.assign(kind.begin(), kind.end());
  source.group = values_of<int>(data.cell_data, "group", paths);
  source.first.push_back(0);
  source.first.insert(source.first.end(), data.line_ends.begin(), data.line_ends.end());
  source.volume_mm3 = values_of<float>(data.point_data, "volume_mm3", points);
  const auto offsets = values_of<double>(data.point_data, "tip_offset_mm", points);
  const auto widths = values_of<float>(data.point_data, "width_mm", points);
  source.tips = std::move(data.points);
  source.normals.resize(points);
  const auto normals = values_of<double>(data.point_data, "normal", 3 * points);
  for (std::size_t i = 0; i < points; ++i) {
    const Vec3 normal(normals[3 * i], normals[3 * i + 1], normals[3 * i + 2]);
    source.tips[i] += offsets[i] * normal;
    source.normals[i] = normal.cast<float>();
  }
  source.beads.resize(paths);
  for (std::size_t path = 0; path < paths; ++path) {
    for (auto i = static_cast<std::size_t>(source.first[path]); i < static_cast<std::size_t>(source.first[path + 1]); ++i) {
      PathBead& bead = source.beads[path];
      bead = {std::max(bead.height_mm, 2.0 * offsets[i]), std::max(bead.width_mm, static_cast<double>(widths[i]))};
    }
  }
  return source;
}

namespace {

// One path and its chains.
class OnePathCheck {
 public:
  OnePathCheck(const Programs& programs, const SourcePaths& source, const Machine& machine, Findings& findings, EmittedFigures& figures)
      : programs_(programs), source_(source), machine_(machine), findings_(findings), figures_(figures), platform_(frame_of(machine.platform.pose)) {
    const double diameter = machine.extruder.filament_diameter_mm;
    filament_area_ = std::numbers::pi / 4.0 * diameter * diameter;
  }

  void run(std::span<const Chain> chains) {
    const int path = chains.front().path;
    const Place place = place_of(chains.front());
    for (std::size_t s = 0; s < chains.size(); ++s) {
      const bool whole = chains[s].section == static_cast<int>(s) + 1 && chains[s].sections == static_cast<int>(chains.size());
      findings_.expect(whole, Rule::path_order, place, "the sections of the path are not whole or not in order");
    }
    check_labels(path, chains.front(), place);
    follow(path, chains, place);
  }

 private:
  [[nodiscard]] Place place_of(const Chain& chain) const {
    return {programs_.job.file, programs_.job.paths[static_cast<std::size_t>(chain.job_comment)].line};
  }
  [[nodiscard]] const JobMove& job_move(const Chain& chain, std::size_t k) const { return programs_.job.moves[chain.job_first + k]; }
  [[nodiscard]] const RobotMove& robot_move(const Chain& chain, std::size_t k) const {
    return programs_.parts[chain.part].moves[chain.robot_first + k];
  }

  void check_labels(int path, const Chain& chain, const Place& place) {
    const auto p = static_cast<std::size_t>(path);
    const PathComment& said = programs_.parts[chain.part].paths[static_cast<std::size_t>(chain.robot_comment)];
    const JobPath& in_job = programs_.job.paths[static_cast<std::size_t>(chain.job_comment)];
    findings_.expect(in_job.layer == source_.layer[p] && said.layer == source_.layer[p], Rule::layers, place, "the path belongs to another layer");
    findings_.expect(said.material == source_.material[p], Rule::path_order, place, "the path is of the other material");
    const int wanted_tool = machine_.filaments[static_cast<std::size_t>(std::clamp(source_.material[p], 0, 1))].tool;
    findings_.expect(chain.moves > 0 && job_move(chain, 0).tool == wanted_tool, Rule::tool_and_heat, place, "the path is printed with the wrong tool");
    static constexpr std::string_view kTypes[] = {"Perimeter", "Gap fill", "Solid infill"};
    const std::string_view type = source_.material[p] == 1 ? "Support material" : kTypes[std::clamp(source_.kind[p], 0, 2)];
    findings_.expect(in_job.type == type, Rule::layers, place, "the type comment is another one");
  }

  // Every vertex of the emitted polyline has its place on the source's, and every point of that one on the emitted one.
  void follow(int path, std::span<const Chain> chains, const Place& place) {
    const auto begin = static_cast<std::size_t>(source_.first[static_cast<std::size_t>(path)]);
    const auto end = static_cast<std::size_t>(source_.first[static_cast<std::size_t>(path) + 1]);
    if (end < begin + 2) return findings_.fail(Rule::polyline, place, "toolpaths.vtp has no segments for this path");
    const Tolerances& tolerances = machine_.tolerances;
    const PolylineLimits limits{tolerances.chord_mm + 1e-3, tolerances.chord_mm + tolerances.corner_mm};
    const auto measure = [&](double distance, const Place& at, const char* what) {
      figures_.max_polyline_distance_mm = std::max(figures_.max_polyline_distance_mm, distance);
      findings_.at_most(Rule::polyline, distance, limits.vertex, at, what);
    };
    tips_.assign(1, programs_.job.from_mm(chains.front().job_first));
    for (const Chain& chain : chains) {
      measure((programs_.job.from_mm(chain.job_first) - tips_.back()).norm(), place, "a section starts where the one before did not end");
      for (std::size_t k = 0; k < chain.moves; ++k) tips_.emplace_back(job_move(chain, k).tip_mm);
    }
    const std::vector<PolylinePlace> places = match_polylines(std::span(source_.tips).subspan(begin, end - begin), tips_, limits);
    measure(places[0].distance, place, "the path starts elsewhere");
    double volume = 0.0;
    const double per_e = filament_area_ / machine_.filaments[static_cast<std::size_t>(std::clamp(source_.material[static_cast<std::size_t>(path)], 0, 1))].flow;
    std::size_t vertex = 0;
    for (const Chain& chain : chains) {
      for (std::size_t k = 0; k < chain.moves; ++k) {
        const JobMove& move = job_move(chain, k);
        const Place at{programs_.job.file, move.line};
        const PolylinePlace& here = places[++vertex];
        measure(here.distance, at, "the nozzle leaves the path");
        findings_.at_most(Rule::source_points, here.aside, limits.aside, at, "the nozzle cuts off points of the path");
        check_tilt(robot_move(chain, k), begin + here.segment, here.share, at);
        volume += static_cast<double>(move.e_mm) * per_e;
      }
    }
    measure((tips_.back() - source_.tips[end - 1]).norm(), place, "the path ends elsewhere");
    for (std::size_t p = begin + places.back().segment; p < end; ++p) {
      const double left = (source_.tips[p] - tips_.back()).norm();
      findings_.at_most(Rule::source_points, left, limits.aside, place, "the end of the path is not printed");
    }
    double wanted = 0.0;
    for (std::size_t p = begin; p < end; ++p) wanted += static_cast<double>(source_.volume_mm3[p]);
    const double rounding = 1e-6 * per_e * static_cast<double>(chains.size());
    findings_.at_most(Rule::path_volume, std::max(0.0, std::abs(volume - wanted) - rounding) / std::max(wanted, 1e-9), 1e-3, place, "the path gets another volume");
  }

  // Angles are worked out where one is the largest so far.
  void check_tilt(const RobotMove& move, std::size_t segment, double share, const Place& place) {
    const Vec3 normal = source_.normal(segment, share), axis = platform_.rotation.transpose() * tool_axis(move.pose.rotation_vector);
    const double cosine = axis.dot(normal) / normal.norm();
    const double limit = machine_.tolerances.max_tilt_deviation.degrees() + machine_.tolerances.axis.degrees() + 0.1;
    if (cosine >= least_cosine_ && cosine >= std::cos(limit * std::numbers::pi / 180.0)) return;
    least_cosine_ = std::min(least_cosine_, cosine);
    const double degrees = std::atan2(axis.cross(normal).norm(), axis.dot(normal)) * 180.0 / std::numbers::pi;
    figures_.max_tilt_deviation_deg = std::max(figures_.max_tilt_deviation_deg, degrees);
    findings_.at_most(Rule::tilt_deviation, degrees, limit, place, "the nozzle leans too far from the layer normal");
  }

  const Programs& programs_;
  const SourcePaths& source_;
  const Machine& machine_;
  Findings& findings_;
  EmittedFigures& figures_;
  ArmFrame platform_;
  double filament_area_ = 1.0;
  double least_cosine_ = 2.0;  // of the nozzle axis and the layer normal
  std::vector<Vec3> tips_;     // of the path, as emitted
};

class PathCheck {
 public:
  PathCheck(const Programs& programs, SourcePaths source, const Machine& machine, Findings& findings, EmittedFigures& figures)
      : programs_(programs), source_(std::move(source)), machine_(machine), findings_(findings), figures_(figures) {}

  void run(const RunContext& run) {
    place_part();
    figures_.paths = source_.count();
    find_paths();
    constexpr std::size_t kTogether = 32;
    std::vector<Findings> found(chunk_count(paths_.size(), kTogether));
    std::vector<EmittedFigures> figures(found.size());
    parallel_for(paths_.size(), kTogether, run, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
      OnePathCheck one(programs_, source_, machine_, found[chunk], figures[chunk]);
      for (std::size_t i = begin; i < end; ++i) one.run(std::span(programs_.chains).subspan(paths_[i].first, paths_[i].count));
    });
    for (std::size_t i = 0; i < found.size(); ++i) {
      findings_.merge(found[i]);
      figures_.max_polyline_distance_mm = std::max(figures_.max_polyline_distance_mm, figures[i].max_polyline_distance_mm);
      figures_.max_tilt_deviation_deg = std::max(figures_.max_tilt_deviation_deg, figures[i].max_tilt_deviation_deg);
    }
    check_volumes();
    check_groups();
  }

 private:
  // The chains of one path: they follow each other.
  struct Range {
    std::size_t first = 0, count = 0;
  };

  [[nodiscard]] Place place_of(const Chain& chain) const {
    return {programs_.job.file, programs_.job.paths[static_cast<std::size_t>(chain.job_comment)].line};
  }

  // Each path once, in order.
  void find_paths() {
    int before = -1;
    for (std::size_t first = 0; first < programs_.chains.size();) {
      const Chain& chain = programs_.chains[first];
      std::size_t end = first + 1;
      while (end < programs_.chains.size() && programs_.chains[end].path == chain.path) ++end;
      if (chain.path != before + 1) findings_.fail(Rule::path_order, place_of(chain), "path " + std::to_string(chain.path) + " follows path " + std::to_string(before));
      before = chain.path;
      if (chain.path >= 0 && chain.path < static_cast<int>(source_.count())) paths_.push_back({first, end - first});
      first = end;
    }
    findings_.expect(before + 1 == static_cast<int>(source_.count()), Rule::path_order, {programs_.job.file, 0}, "the last path is missing");
  }

  // With placement `automatic` the part was turned about z and moved: found from the ends of the chains.
  void place_part() {
    if (machine_.place != Placement::automatic) return;
    Vec3 mean_from = Vec3::Zero(), mean_to = Vec3::Zero();
    std::vector<std::pair<Vec3, Vec3>> pairs;
    for (const Chain& chain : programs_.chains) {
      if (chain.path < 0 || chain.path >= static_cast<int>(source_.count()) || chain.moves == 0) continue;
      const auto path = static_cast<std::size_t>(chain.path);
      if (chain.section == 1) pairs.emplace_back(source_.tips[static_cast<std::size_t>(source_.first[path])], programs_.job.from_mm(chain.job_first));
      if (chain.section == chain.sections) {
        pairs.emplace_back(source_.tips[static_cast<std::size_t>(source_.first[path + 1]) - 1], programs_.job.moves[chain.job_first + chain.moves - 1].tip_mm);
      }
    }
    if (pairs.empty()) return;
    for (const auto& [from, to] : pairs) {
      mean_from += from / static_cast<double>(pairs.size());
      mean_to += to / static_cast<double>(pairs.size());
    }
    double along = 0.0, across = 0.0;
    for (const auto& [from, to] : pairs) {
      const Vec3 a = from - mean_from, b = to - mean_to;
      along += a.x() * b.x() + a.y() * b.y();
      across += a.x() * b.y() - a.y() * b.x();
    }
    const Mat3 turn = rotation_from(Vec3(0.0, 0.0, std::atan2(across, along)));
    Vec3 shift = mean_to - turn * mean_from;
    shift.z() = 0.0;
    for (Vec3& tip : source_.tips) tip = turn * tip + shift;
    for (Eigen::Vector3f& normal : source_.normals) normal = (turn * normal.cast<double>()).cast<float>();
  }

  void check_volumes() {
    const double area = std::numbers::pi / 4.0 * machine_.extruder.filament_diameter_mm * machine_.extruder.filament_diameter_mm;
    std::map<int, double> wanted, got;
    for (std::size_t path = 0; path < source_.count(); ++path) {
      double& volume = wanted[machine_.filaments[static_cast<std::size_t>(std::clamp(source_.material[path], 0, 1))].tool];
      for (int p = source_.first[path]; p < source_.first[path + 1]; ++p) volume += static_cast<double>(source_.volume_mm3[static_cast<std::size_t>(p)]);
    }
    double e[kMaterialCount] = {};
    for (const JobMove& move : programs_.job.moves) {
      if (!move.has_xyz || !move.has_e) continue;
      for (std::size_t m = 0; m < kMaterialCount; ++m) {
        if (machine_.filaments[m].tool != move.tool) continue;
        e[m] += static_cast<double>(move.e_mm);
        break;
      }
    }
    for (std::size_t m = 0; m < kMaterialCount; ++m) {
      figures_.volume_mm3[m] = e[m] * area / machine_.filaments[m].flow;
      got[machine_.filaments[m].tool] += figures_.volume_mm3[m];
    }
    for (const auto& [tool, volume] : wanted) {
      findings_.at_most(Rule::volume, std::abs(got[tool] - volume) / std::max(volume, 1e-9), 1e-3, {programs_.job.file, 0},
                        "the volume of tool " + std::to_string(tool) + " is not the one of the toolpaths");
    }
  }

  // ;LAYER: counts each group of the toolpaths once.
  void check_groups() {
    int count = -1, group = -1;
    for (const Chain& chain : programs_.chains) {
      if (chain.path < 0 || chain.path >= static_cast<int>(source_.count())) continue;
      const int now = source_.group[static_cast<std::size_t>(chain.path)];
      if (count < 0 || now != group) ++count;
      group = now;
      const JobPath& said = programs_.job.paths[static_cast<std::size_t>(chain.job_comment)];
      findings_.expect(said.group == count, Rule::layers, place_of(chain), "the path belongs to another printed group");
    }
    findings_.expect(programs_.job.header.layers == count + 1, Rule::header, {programs_.job.file, 0}, "num_layers is not the number of printed groups");
  }

  const Programs& programs_;
  SourcePaths source_;
  const Machine& machine_;
  Findings& findings_;
  EmittedFigures& figures_;
  std::vector<Range> paths_;
};

// Ways between chains leave and arrive along the nozzle, and lift as far as is needed.
class TravelCheck {
 public:
  TravelCheck(const Programs& programs, const Machine& machine, Findings& findings) : programs_(programs), machine_(machine), findings_(findings) {}

  void run() {
    for (std::size_t c = 0; c < programs_.chains.size(); ++c) {
      const Chain& chain = programs_.chains[c];
      if (chain.moves == 0 || chain.robot_first == 0) continue;
      const std::vector<RobotMove>& moves = programs_.parts[chain.part].moves;
      const Pose start = moves[chain.robot_first - 1].pose, finish = moves[chain.robot_first + chain.moves - 1].pose;
      const double hop = 1e-3 * std::min(kHop_mm, machine_.tolerances.travel_clearance_mm);
      const double lift = 1e-3 * machine_.tolerances.travel_clearance_mm;
      if (chain.robot_first >= 2) {
        const bool near = c > 0 && (end_of(programs_.chains[c - 1]) - start.position_m).norm() < 1e-3 * kNearHop_mm;
        expect_lift(start, moves[chain.robot_first - 2].pose, moves[chain.robot_first - 1], near ? hop : lift, "the nozzle is not lowered from above");
      }
      if (chain.robot_first + chain.moves < moves.size()) {
        const bool near = c + 1 < programs_.chains.size() && (start_of(programs_.chains[c + 1]) - finish.position_m).norm() < 1e-3 * kNearHop_mm;
        const RobotMove& up = moves[chain.robot_first + chain.moves];
        expect_lift(finish, up.pose, up, near ? hop : lift, "the nozzle is not lifted enough");
      }
    }
  }

 private:
  [[nodiscard]] Vec3 end_of(const Chain& chain) const {
    if (chain.moves == 0) return Vec3::Constant(1e9);
    return programs_.parts[chain.part].moves[chain.robot_first + chain.moves - 1].pose.position_m;
  }
  [[nodiscard]] Vec3 start_of(const Chain& chain) const {
    if (chain.moves == 0 || chain.robot_first == 0) return Vec3::Constant(1e9);
    return programs_.parts[chain.part].moves[chain.robot_first - 1].pose.position_m;
  }

  void expect_lift(const Pose& bead, const Pose& away, const RobotMove& move, double least_m, const char* what) {
    const Vec3 axis = tool_axis(bead.rotation_vector), way = away.position_m - bead.position_m;
    const double along = way.dot(axis), aside = (way - along * axis).norm();
    const bool good = move.kind == RobotMove::Kind::linear && along >= least_m - 1e-5 && aside <= 2e-5 + 1e-3 * along;
    if (!good) findings_.fail(Rule::travel_lift, {file_of(move), move.line}, what);
  }
  [[nodiscard]] std::string_view file_of(const RobotMove& move) const {
    for (const RobotPart& part : programs_.parts) {
      if (!part.moves.empty() && &move >= part.moves.data() && &move < part.moves.data() + part.moves.size()) return part.file;
    }
    return {};
  }

  const Programs& programs_;
  const Machine& machine_;
  Findings& findings_;
};

}  // namespace

void check_paths(const Programs& programs, SourcePaths source, const Machine& machine, const RunContext& run, Findings& findings, EmittedFigures& figures) {
  PathCheck(programs, std::move(source), machine, findings, figures).run(run);
  TravelCheck(programs, machine, findings).run();
}

}  // namespace curvesup::emitted
