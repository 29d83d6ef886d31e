#pragma once

#include <string>
#include <vector>

#include "curvesup/emit/emit.h"

// The files around the two programs: what the board needs once, the player, the page for the operator.
namespace curvesup::emit {

[[nodiscard]] EmittedFile small_file(std::string name, std::string description, std::string text);
[[nodiscard]] std::string config_snippet(const Machine& machine);
[[nodiscard]] std::vector<EmittedFile> tool_macros(const Machine& machine);
[[nodiscard]] std::string player_script();
[[nodiscard]] std::string operator_page(const Machine& machine, const EmitOptions& options,
                                        const std::vector<EmittedPart>& parts, const EmitReport& report);

}  // namespace curvesup::emit
