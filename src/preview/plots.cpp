#include "curvesup/preview/plots.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <optional>

#include "chart.h"
#include "curvesup/core/format.h"
#include "curvesup/core/parallel.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/motion/kinematics.h"
#include "print_clock.h"

namespace curvesup {

namespace {

constexpr const char* kMaterialName[] = {"part", "support"};
constexpr ChartColour kMaterialColour[] = {kModelColour, kSupportColour};
constexpr double kDegrees = 180.0 / std::numbers::pi;

using Form = ChartSeries::Form;

Plot plot(const char* name, const Chart& chart, const char* caption) { return {name, chart.title, caption, draw_chart(chart)}; }

// Area and printed height of every triangle, measured once.
class MeasuredStack {
 public:
  MeasuredStack(const LayerStack& stack, const ScalarField& field, const RunContext& run) : stack_(stack), size_(stack.triangles.size()) {
    parallel_for(stack.sheets.size(), 4, run, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t s = begin; s < end; ++s) measure(stack.sheets[s], field);
    });
  }

  [[nodiscard]] const std::vector<Sheet>& sheets() const { return stack_.sheets; }

  // Calls visit(sheet, area_mm2, height_mm).
  void each_triangle(const auto& visit) const {
    for (const Sheet& sheet : stack_.sheets) {
      for (Index t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) visit(sheet, size_[t].area, size_[t].height);
    }
  }

 private:
  struct Size {
    double area = 0.0, height = 0.0;  // 0 where the field has no direction
  };

  void measure(const Sheet& sheet, const ScalarField& field) {
    for (Index t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) {
      const auto& c = stack_.triangles[t];
      const Vec3 &a = stack_.vertices[c[0]], &b = stack_.vertices[c[1]], &d = stack_.vertices[c[2]];
      const Vec3& gradient = field.gradient[stack_.triangle_tet[t]];
      const double slope = gradient.norm();
      if (slope <= 0.0) continue;
      const double thickness = 1.0 / (stack_.count * sheet.passes * slope);
      // On the platform a bead has only the height down to it.
      const double above = (a.z() + b.z() + d.z()) / 3.0 + 0.5 * thickness * gradient.z() / slope;
      size_[t] = {triangle_area(a, b, d), std::clamp(above, 0.0, thickness)};
    }
  }

  const LayerStack& stack_;
  std::vector<Size> size_;
};

// The thickness above which 0.1 % of the area lies.
double common_limit(const MeasuredStack& stack) {
  constexpr int kFine = 4096;
  double most = 0.0, area = 0.0;
  stack.each_triangle([&](const Sheet&, double triangle, double height) {
    most = std::max(most, height);
    area += triangle;
  });
  std::vector<double> fine(kFine, 0.0);
  const auto bin_of = [&](double height) { return std::clamp(static_cast<int>(height / most * kFine), 0, kFine - 1); };
  if (most > 0.0) stack.each_triangle([&](const Sheet&, double t, double height) { fine[bin_of(height)] += t; });
  int bin = kFine;
  for (double above = 0.0; bin > 1 && above + fine[bin - 1] <= 0.001 * area; --bin) above += fine[bin - 1];
  return most * bin / kFine;
}

Plot thickness_plot(const MeasuredStack& stack) {
  constexpr int kBins = 60;
  const double most = common_limit(stack);
  const double width = most > 0.0 ? most / kBins : 1.0;
  std::array<std::vector<double>, kMaterialCount> sum;
  for (auto& s : sum) s.assign(kBins, 0.0);
  stack.each_triangle([&](const Sheet& sheet, double triangle, double height) {
    sum[static_cast<int>(sheet.material)][std::clamp(static_cast<int>(height / width), 0, kBins - 1)] += triangle / 100.0;
  });
  Chart chart{"Layer thickness", "thickness, mm", {{"area, cm²", {}}}};
  for (int m = 0; m < kMaterialCount; ++m) {
    ChartSeries bars{kMaterialName[m], kMaterialColour[m], Form::bars, {}, {}, {}, width};
    for (int i = 0; i < kBins; ++i) {
      const double base = m == 0 ? 0.0 : sum[0][i];
      bars.x.push_back((i + 0.5) * width);
      bars.base.push_back(base);
      bars.y.push_back(base + sum[m][i]);
    }
    chart.panels[0].series.push_back(std::move(bars));
  }
  return plot("layer_thickness", chart, "How much layer area has which thickness. Curved layers are thinner where they come together and thicker where they spread; a nozzle can only lay what is neither too thin nor too thick for it. The last bar holds everything thicker.");
}

Plot support_volume_plot(const MeasuredStack& stack) {
  Index first = 0, last = 0;
  for (const Sheet& sheet : stack.sheets()) first = std::min(first, sheet.layer), last = std::max(last, sheet.layer);
  std::vector<double> volume(last - first + 1, 0.0);
  stack.each_triangle([&](const Sheet& sheet, double area, double height) {
    if (sheet.material == Material::support) volume[sheet.layer - first] += area * height;
  });
  ChartSeries bars{"", kSupportColour, Form::bars, {}, volume};
  for (Index k = first; k <= last; ++k) bars.x.push_back(k);
  return plot("support_volume", {"Support volume by layer", "layer k", {{"volume, mm³", {bars}}}},
              "Plastic that each layer of support takes. Low layers carry the trunks of the tree, high ones its tips.");
}

// Mean, least and largest value in equal steps of the way along the print.
struct Strip {
  std::vector<double> x, least, mean, largest;
};

class StripBuilder {
 public:
  StripBuilder(double end, int bins) : width_(end > 0.0 ? end / bins : 1.0), bins_(bins), bin_(bins) {}
  void add(double x, double value, double weight) {
    Bin& b = bin_[std::clamp(static_cast<int>(x / width_), 0, bins_ - 1)];
    b.least = std::min(b.least, value);
    b.largest = std::max(b.largest, value);
    b.sum += value * weight;
    b.weight += weight;
  }
  [[nodiscard]] Strip strip(double unit) const {
    Strip out;
    for (int i = 0; i < bins_; ++i) {
      if (bin_[i].weight <= 0.0) continue;
      out.x.push_back((i + 0.5) * width_ / unit);
      out.least.push_back(bin_[i].least);
      out.mean.push_back(bin_[i].sum / bin_[i].weight);
      out.largest.push_back(bin_[i].largest);
    }
    return out;
  }

 private:
  struct Bin {
    double least = 1e300, largest = -1e300, sum = 0.0, weight = 0.0;
  };
  double width_;
  int bins_;
  std::vector<Bin> bin_;
};

constexpr int kStripBins = 400;

ChartPanel strip_panel(const std::string& label, const Strip& strip, const ChartColour& colour) {
  const auto lighter = [](double c) { return 1.0 - 0.45 * (1.0 - c); };
  ChartSeries range{"least to largest", {lighter(colour.r), lighter(colour.g), lighter(colour.b)}, Form::bars, strip.x, strip.largest, strip.least, 1.0};
  range.bar_width = strip.x.size() > 1 ? (strip.x.back() - strip.x.front()) / static_cast<double>(strip.x.size() - 1) : 1.0;
  return {label, {range, {"mean", colour, Form::line, strip.x, strip.mean}}};
}

// A few far higher values would press all others together: the axis ends below them, and the legend says how high they are.
void leave_out_rare_peaks(ChartPanel& panel, const char* unit) {
  ChartSeries& range = panel.series[0];
  std::vector<double> largest = range.y;
  std::sort(largest.begin(), largest.end());
  if (largest.empty()) return;
  const double common = largest[largest.size() * 98 / 100];
  if (largest.back() <= 1.6 * common) return;
  panel.y_most = 1.3 * common;
  range.name += format(", peaks up to %.2f %s cut off", largest.back(), unit);
}

Plot along_plot(const Toolpaths& toolpaths, const PrintClock& clock) {
  double total = 0.0;
  const auto each_segment = [&](const auto& visit) {
    for (const Path& path : toolpaths.paths) {
      for (Index p = path.first_point + 1; p < path.first_point + path.point_count; ++p) {
        visit(p, (toolpaths.points[p].position - toolpaths.points[p - 1].position).norm());
      }
    }
  };
  each_segment([&](Index, double length) { total += length; });
  StripBuilder height(total, kStripBins), tilt(total, kStripBins);
  double at = 0.0;
  each_segment([&](Index p, double length) {
    at += length;
    height.add(at - 0.5 * length, toolpaths.points[p].height_mm, length);
    tilt.add(at - 0.5 * length, std::acos(std::clamp(clock.axis[p].z(), -1.0f, 1.0f)) * kDegrees, length);
  });
  ChartPanel heights = strip_panel("bead height, mm", height.strip(1000.0), {0.13, 0.45, 0.42});
  leave_out_rare_peaks(heights, "mm");
  return plot("along_the_print",
              {"Bead height and nozzle tilt along the print", "length laid, m",
               {heights, strip_panel("tilt from vertical, °", tilt.strip(1000.0), {0.42, 0.25, 0.55})}},
              "From the first bead to the last: how thick the bead is, and how far the nozzle leans from vertical. The band reaches from the least to the largest value in each four-hundredth of the print.");
}

// What a print of so many seconds is measured in.
struct TimeUnit {
  explicit TimeUnit(double end_s) : seconds(end_s > 3.0 * 3600.0 ? 3600.0 : 60.0), name(seconds > 60.0 ? "h" : "min") {}
  double seconds;
  const char* name;
};

Plot time_plot(const Toolpaths& toolpaths, const PrintClock& clock) {
  const TimeUnit unit(clock.end_s);
  std::array<double, 3> time{};
  for (const Path& path : toolpaths.paths) {
    if (path.point_count == 0) continue;
    const double seconds = clock.point_s[path.first_point + path.point_count - 1] - clock.point_s[path.first_point];
    time[static_cast<int>(path.material)] += seconds / unit.seconds;
  }
  time[2] = std::max(clock.end_s / unit.seconds - time[0] - time[1], 0.0);
  Chart chart{"Time by material", "", {{format("time, %s", unit.name), {}}}, {}};
  const ChartColour colours[] = {kModelColour, kSupportColour, {0.5, 0.55, 0.6}};
  const char* names[] = {"part", "support", "travel and changes"};
  for (int i = 0; i < 3; ++i) {
    chart.panels[0].series.push_back({"", colours[i], Form::bars, {static_cast<double>(i)}, {time[i]}, {}, 0.6});
    chart.x_names.push_back(format("%s: %.1f %s", names[i], time[i], unit.name));
  }
  return plot("time_by_material", chart, "Where the time of the print goes: laying the part, laying the support, and everything in between.");
}

Plot joints_plot(const Motion& motion, const Arm& arm) {
  double end = 0.0;
  for (const PathMotion& chain : motion.paths) {
    for (Index t = 0; t < chain.travel_count; ++t) end += motion.travels[chain.first_travel + t].duration_s;
    for (Index w = 0; w < chain.waypoint_count; ++w) end += motion.waypoints[chain.first_waypoint + w].duration_s;
  }
  std::vector<StripBuilder> angle(6, StripBuilder(end, kStripBins));
  StripBuilder distance(end, kStripBins);
  double now = 0.0;
  for (const PathMotion& chain : motion.paths) {
    for (Index t = 0; t < chain.travel_count; ++t) now += motion.travels[chain.first_travel + t].duration_s;
    for (Index w = 0; w < chain.waypoint_count; ++w) {
      const Waypoint& waypoint = motion.waypoints[chain.first_waypoint + w];
      now += waypoint.duration_s;
      for (int j = 0; j < 6; ++j) angle[j].add(now, waypoint.joints[j] * kDegrees, 1.0);
      distance.add(now, singularity_metric(arm, waypoint.joints), 1.0);
    }
  }
  constexpr const char* kJoint[] = {"base", "shoulder", "elbow", "wrist 1", "wrist 2", "wrist 3"};
  constexpr ChartColour kColours[] = {{0.12, 0.35, 0.65}, {0.85, 0.45, 0.05}, {0.15, 0.55, 0.25},
                                      {0.75, 0.15, 0.15}, {0.45, 0.3, 0.65}, {0.4, 0.4, 0.4}};
  const TimeUnit unit(end);
  Chart chart{"Joint angles and distance from singular poses", format("time, %s", unit.name), {{"joint angle, °", {}, false}, {}}};
  for (int j = 0; j < 6; ++j) {
    const Strip strip = angle[j].strip(unit.seconds);
    chart.panels[0].series.push_back({kJoint[j], kColours[j], Form::line, strip.x, strip.mean});
  }
  chart.panels[1] = {"singularity metric", {}};
  const Strip strip = distance.strip(unit.seconds);
  chart.panels[1].series.push_back({"", {0.7, 0.1, 0.3}, Form::line, strip.x, strip.least});
  return plot("joints", chart, "Angles of the six joints while printing, and how far the arm stays from poses in which it loses a direction (stretched elbow, aligned wrist, hand above the base); 0 would be such a pose.");
}

}  // namespace

std::vector<Plot> make_plots(const PlotInput& input, const RunContext& run) {
  std::vector<std::function<Plot()>> jobs;
  std::optional<MeasuredStack> stack;
  std::optional<PrintClock> clock;
  if (input.layers && input.field && !input.layers->triangles.empty()) {
    stack.emplace(*input.layers, *input.field, run);
    jobs.push_back([&] { return thickness_plot(*stack); });
    jobs.push_back([&] { return support_volume_plot(*stack); });
  }
  if (input.toolpaths && !input.toolpaths->paths.empty()) {
    clock = run_clock(*input.toolpaths, input.motion);
    jobs.push_back([&] { return along_plot(*input.toolpaths, *clock); });
    jobs.push_back([&] { return time_plot(*input.toolpaths, *clock); });
  }
  if (input.motion && !input.motion->waypoints.empty()) jobs.push_back([&] { return joints_plot(*input.motion, input.arm); });
  std::vector<Plot> plots(jobs.size());
  parallel_for(jobs.size(), 1, run, [&](std::size_t begin, std::size_t, std::size_t) { plots[begin] = jobs[begin](); });
  return plots;
}

}  // namespace curvesup
