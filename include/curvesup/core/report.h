#pragma once

#include <string>
#include <vector>

namespace curvesup {

// One thing that was proved, or was not. Every check can fail; `value` is what was measured, `limit` what it may be.
struct Check {
  std::string name;  // e.g. "skeleton.leaves_conserved"
  bool ok = false;
  double value = 0.0;
  double limit = 0.0;
  std::string detail;  // one sentence: what is compared, and the first offending places
};

[[nodiscard]] inline Check check_at_most(std::string name, double value, double limit, std::string detail = {}) {
  return {std::move(name), value <= limit, value, limit, std::move(detail)};
}
[[nodiscard]] inline Check check_at_least(std::string name, double value, double limit, std::string detail = {}) {
  return {std::move(name), value >= limit, value, limit, std::move(detail)};
}
[[nodiscard]] inline Check check_equal(std::string name, double value, double limit, std::string detail = {}) {
  return {std::move(name), value == limit, value, limit, std::move(detail)};
}

}  // namespace curvesup
