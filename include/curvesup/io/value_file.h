#pragma once

#include <cstddef>
#include <filesystem>
#include <string_view>
#include <vector>

#include "curvesup/core/types.h"

namespace curvesup {

// One finite number a line, one line per `element` ("vertex", "tet": only for the message). A missing final newline,
// Windows line ends and empty lines are accepted. Throws Error{input} with file:line, or with both counts when there
// are not exactly expected_count values.
[[nodiscard]] std::vector<double> read_scalars(const std::filesystem::path& path, std::size_t expected_count,
                                               std::string_view element = "vertex");

// The same with three numbers a line.
[[nodiscard]] std::vector<Vec3> read_vectors(const std::filesystem::path& path, std::size_t expected_count,
                                             std::string_view element = "tet");

}  // namespace curvesup
