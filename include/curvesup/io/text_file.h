#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace curvesup {

// The bytes of a file. Throws Error{input} naming the path when it is missing, a folder, or cannot be read.
[[nodiscard]] std::string read_file(const std::filesystem::path& path);

// Writes a file as a whole. Throws Error{output} naming the path, and leaves no half-written file behind.
void write_file(const std::filesystem::path& path, std::string_view bytes);

}  // namespace curvesup
