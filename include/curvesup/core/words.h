#pragma once

#include <cstddef>
#include <string_view>

namespace curvesup {

// How many letters have to be put in, taken out or changed to make one word of the other: small for a slip of the finger.
// O(length of a times length of b).
[[nodiscard]] std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace curvesup
