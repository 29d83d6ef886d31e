#include "motion/choose_postures.h"

#include <algorithm>

#include "curvesup/core/parallel.h"

namespace curvesup {
namespace {

constexpr std::size_t kGuesses = 64;    // paths whose postures are worked out at the same time, at most
constexpr std::size_t kFewGuesses = 4;  // where the head had to turn

}  // namespace

// Most paths can go on as the one before ended: those are worked out together, as if all could; the first one that cannot
// turns the head, or is planned by itself.
std::vector<PlannedPath> PostureChooser::choose(const PlacedPaths& placed) {
  std::vector<PlannedPath> planned(placed.paths.size());
  std::size_t most = kGuesses;
  for (std::size_t p = 0; p < planned.size();) {
    std::vector<Guess> guesses = guess(placed, p, state_.yaw, most);
    const bool all = take(guesses, planned, p);
    if (p == planned.size()) break;
    if (all && !guesses.empty()) {
      most = std::min(kGuesses, 2 * most);
      continue;
    }
    most = kFewGuesses;
    const std::optional<double> held = turned_yaw(placed, p);
    if (held) {
      guesses = guess(placed, p, *held, 1);
      if (take(guesses, planned, p)) continue;
    }
    planned[p] = plan(placed, p);
    ++p;
  }
  return planned;
}

// The next paths, `most` at most, held as the arm stands but at that turn of the head.
std::vector<PostureChooser::Guess> PostureChooser::guess(const PlacedPaths& placed, std::size_t from, double yaw, std::size_t most) const {
  std::vector<Guess> guesses;
  if (!state_.known) return guesses;
  for (std::size_t p = from; p < placed.paths.size() && guesses.size() < most; ++p) {
    if (!placed.drafts[p].empty()) guesses.push_back({p, std::nullopt});
  }
  const Deposit* obstacles = options_.avoid_collisions ? &deposit_ : nullptr;
  parallel_for(guesses.size(), 2, run_, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t g = begin; g < end; ++g) {
      guesses[g].section = hold_posture(cell_, obstacles, placed.drafts[guesses[g].path], state_.branch, yaw);
    }
  });
  return guesses;
}

// Takes paths over up to the first that is not held, which `p` becomes; false when there is one.
bool PostureChooser::take(std::vector<Guess>& guesses, std::vector<PlannedPath>& planned, std::size_t& p) {
  for (Guess& guess : guesses) {
    p = guess.path;
    if (!guess.section) return false;
    planned[p] = {cut_section(cell_, std::move(*guess.section), state_), options_.avoid_collisions};
    go_on_from(planned[p++].arm);
  }
  return true;
}

// Another turn of the head with which a path can be held, as far as its key waypoints tell.
std::optional<double> PostureChooser::turned_yaw(const PlacedPaths& placed, std::size_t p) const {
  if (!state_.known || placed.drafts[p].empty()) return std::nullopt;
  const std::optional<double> held = held_yaw(cell_, placed.drafts[p], options_, state_.yaw, state_.branch);
  return held && *held != state_.yaw ? held : std::nullopt;
}

// One path, whatever it takes.
PlannedPath PostureChooser::plan(const PlacedPaths& placed, std::size_t p) {
  if (placed.drafts[p].empty()) return {};
  PlannedPath planned{plan_arm_path(cell_, nullptr, placed.drafts[p], options_, state_), false};
  ArmPath& arm = planned.arm;
  if (options_.avoid_collisions && arm.unreachable == kNone) {
    planned.links_free = true;
    Index at = placed.paths[p].first_point;
    for (const ArmSection& section : arm.sections) {
      planned.links_free = planned.links_free && !links_touch(section, at);
      at = section.last_point(at);
    }
    if (!planned.links_free) {
      ArmPath clear = plan_arm_path(cell_, &deposit_, placed.drafts[p], options_, state_);
      if (clear.unreachable == kNone) arm = std::move(clear);
    }
  }
  if (arm.unreachable == kNone) {
    go_on_from(arm);
  } else {
    arm.sections.clear();
  }
  return planned;
}

// With the clearance that is kept from all that is printed.
bool PostureChooser::links_touch(const ArmSection& section, Index before) const {
  for (const ArmPoint& point : section.points) {
    if (point.draft.point != kNone) before = point.draft.point;
    if (touching_link(cell_, deposit_, point.joints, before, cell_.machine().tolerances.clearance_mm)) return true;
  }
  return false;
}

void PostureChooser::go_on_from(const ArmPath& arm) {
  const ArmPoint& last = arm.sections.back().points.back();
  state_ = {true, last.yaw, arm.sections.back().branch, last.joints};
}

}  // namespace curvesup
