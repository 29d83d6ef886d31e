#include <algorithm>

#include "curvesup/core/format.h"
#include "curvesup/pipeline/slice.h"

namespace curvesup {

namespace {

std::string hours(double seconds) {
  const long minutes = static_cast<long>(seconds / 60.0 + 0.5);
  return minutes >= 60 ? format("%ld h %02ld min", minutes / 60, minutes % 60) : format("%ld min", minutes);
}

double number(const Json& report, const char* section, const char* key) {
  if (!report.contains(section) || !report[section].contains(key) || !report[section][key].is_number()) return 0.0;
  return report[section][key].get<double>();
}

std::string checks_line(const Json& checks) {
  const auto failed = std::count_if(checks.begin(), checks.end(), [](const Json& c) { return !c["ok"].get<bool>(); });
  std::string text = format("checks     %zu passed, %ld failed\n", checks.size() - static_cast<std::size_t>(failed), static_cast<long>(failed));
  constexpr long kShown = 8;  // the summary fits one screen
  long shown = 0;
  for (const Json& check : checks) {
    if (check["ok"].get<bool>() || ++shown > kShown) continue;
    text += format("           FAILED %s: %.4g, limit %.4g; %s\n", check["name"].get<std::string>().c_str(), check["value"].get<double>(),
                   check["limit"].get<double>(), check["detail"].get<std::string>().c_str());
  }
  if (failed > kShown) text += format("           and %ld more: see the report\n", static_cast<long>(failed) - kShown);
  return text;
}

}  // namespace

std::string summary_text(const SliceOutcome& outcome, const std::filesystem::path& out) {
  const Json& r = outcome.report;
  std::string text;
  text += format("model      %s: %.0f tets, %.1f cm3\n", r["input"]["model"].get<std::string>().c_str(), number(r, "model", "tets"),
                 number(r, "model", "volume_mm3") / 1000.0);
  if (r.contains("layers")) {
    text += format("layers     %.0f model, %.0f support; %.2f / %.2f / %.2f mm thick (1, 50, 99 %%)\n", number(r, "layers", "model"),
                   number(r, "layers", "support_printed"), number(r, "layers", "thickness_p1_mm"),
                   number(r, "layers", "thickness_p50_mm"), number(r, "layers", "thickness_p99_mm"));
  }
  if (r.contains("support")) {
    text += format("support    %s, %.2f cm3", r["support"]["method"].get<std::string>().c_str(), number(r, "support", "volume_mm3") / 1000.0);
    if (r["support"].contains("covered_overhang_fraction")) {  // measured by a later stage than the volume; a run may stop between them
      text += format(", covers %.2f %% of %.0f mm2 overhang, %.0f floating pieces", 100.0 * number(r, "support", "covered_overhang_fraction"),
                     number(r, "overhang", "area_mm2"), number(r, "support", "floating_pieces"));
    }
    text += "\n";
  }
  if (r.contains("toolpath")) {
    const Json& length = r["toolpath"]["length_mm"];
    text += format("toolpaths  %.0f paths, %.1f m model, %.1f m support\n", number(r, "toolpath", "paths"),
                   length["model"].get<double>() / 1000.0, length["support"].get<double>() / 1000.0);
  }
  if (r.contains("motion")) {
    text += format("robot      %.0f waypoints in %.0f parts, tilt up to %.0f deg, %.0f unreachable, %.0f collisions\n",
                   number(r, "motion", "waypoints"), number(r, "motion", "parts"), number(r, "motion", "max_tilt_deg"),
                   number(r, "motion", "unreachable"), number(r, "motion", "collisions"));
  }
  if (r.contains("print")) {
    const Json& filament = r["print"]["filament_mm"];
    text += format("print      %s, filament %.1f m model, %.1f m support, %.0f material changes\n", hours(number(r, "print", "time_s")).c_str(),
                   filament["model"].get<double>() / 1000.0, filament["support"].get<double>() / 1000.0,
                   number(r, "print", "material_changes"));
  }
  text += checks_line(r["checks"]);
  double wall = 0.0, peak = 0.0;
  for (const StageTime& time : outcome.times) {
    wall += time.wall_s;
    peak = std::max(peak, time.peak_mb);
  }
  text += format("computed   in %.1f s, %.0f MB at most\n", wall, peak);
  text += "look at    " + (out / "preview.html").string() + ", " + (out / "report.json").string() + "\n";
  return text;
}

}  // namespace curvesup
