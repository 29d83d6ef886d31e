#pragma once

#include <limits>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace curvesup {

using Json = nlohmann::ordered_json;

enum class KeyType { boolean, integer, number, text, choice, numbers, list };

// One row of the table that defaults, validation, schema and documentation are made of.
struct ConfigKey {
  std::string path;           // "support.leaf_radius_mm"
  KeyType type = KeyType::number;
  Json default_value;         // null allowed only when nullable
  std::string doc;            // one sentence
  double min = -std::numeric_limits<double>::infinity(), max = std::numeric_limits<double>::infinity();  // of each number
  std::vector<std::string> choices = {};
  bool nullable = false;
  std::size_t size = 0;       // numbers: exact length; 0: any
};

// All keys in the order in which they are documented. config_keys() = the part's keys, then machine_keys().
[[nodiscard]] std::span<const ConfigKey> config_keys();
[[nodiscard]] std::vector<ConfigKey> machine_keys();

}  // namespace curvesup
