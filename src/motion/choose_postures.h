#pragma once

#include <optional>
#include <vector>

#include "motion/chain.h"
#include "motion/deposit.h"
#include "motion/placed_paths.h"

namespace curvesup {

// Turn of the head and branch of the arm along paths, in print order: each path prefers to go on as the one before ended.
class PostureChooser {
 public:
  // Cell and deposit must outlive this.
  PostureChooser(const Cell& cell, const Deposit& deposit, const MotionOptions& options, const RunContext& run)
      : cell_(cell), deposit_(deposit), options_(options), run_(run) {}

  // The paths of the next run. Those that the arm cannot follow have no sections, and say where.
  [[nodiscard]] std::vector<PlannedPath> choose(const PlacedPaths& placed);

 private:
  struct Guess {
    std::size_t path = 0;
    std::optional<ArmSection> section;  // that nothing touches
  };
  [[nodiscard]] std::vector<Guess> guess(const PlacedPaths& placed, std::size_t from, double yaw, std::size_t most) const;
  bool take(std::vector<Guess>& guesses, std::vector<PlannedPath>& planned, std::size_t& p);
  [[nodiscard]] std::optional<double> turned_yaw(const PlacedPaths& placed, std::size_t p) const;
  [[nodiscard]] PlannedPath plan(const PlacedPaths& placed, std::size_t p);
  [[nodiscard]] bool links_touch(const ArmSection& section, Index before) const;
  void go_on_from(const ArmPath& arm);

  const Cell& cell_;
  const Deposit& deposit_;
  const MotionOptions& options_;
  const RunContext& run_;
  ArmState state_;
};

}  // namespace curvesup
