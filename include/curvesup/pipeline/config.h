#pragma once

#include <filesystem>
#include <limits>
#include <map>
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
  std::vector<std::string> choices = {};  // "true" and "false" among them also accept JSON booleans
  bool nullable = false;
  std::size_t size = 0;       // numbers: exact length; 0: any
};

// All keys in the order in which they are documented: the part's, the machine's, the output's.
[[nodiscard]] std::span<const ConfigKey> config_keys();
[[nodiscard]] std::vector<ConfigKey> part_keys();
[[nodiscard]] std::vector<ConfigKey> machine_keys();
[[nodiscard]] std::vector<ConfigKey> output_keys();

// A config as the user wrote it: files merged, overrides applied, nothing defaulted yet.
struct ConfigSource {
  Json values = Json::object();
  std::map<std::string, std::filesystem::path> folder_of;  // key path -> folder of the file that set it
};

// Where a profile is sought when it is not beside the file that names it.
struct ConfigSearch {
  std::vector<std::filesystem::path> profile_folders;
};

// Reads `file` and everything it `extends`, at the top and inside any object; objects merge key by key, the extending file
// wins. Throws Error{usage} naming file and line for bad JSON, a missing file or a circle of extends.
[[nodiscard]] ConfigSource read_config(const std::filesystem::path& file, const ConfigSearch& search = {});

// One "key.path=value" of the command line; the value is JSON, or plain text where it is no JSON.
void apply_override(ConfigSource& config, std::string_view assignment);

// Every key with its value. Throws Error{usage}: unknown key (with the nearest known one), wrong type, value out of range,
// keys that contradict each other (both are named).
[[nodiscard]] Json resolve_config(const ConfigSource& config);

// The value of one key of a resolved config.
[[nodiscard]] const Json& config_value(const Json& resolved, std::string_view path);

// A path from the config: relative ones are relative to the file that set the key.
[[nodiscard]] std::filesystem::path config_file_path(const ConfigSource& config, std::string_view key, const std::string& value);

[[nodiscard]] Json config_schema();                       // JSON Schema, draft 2020-12
[[nodiscard]] std::string explain_key(std::string_view);  // throws Error{usage} for an unknown key
[[nodiscard]] Json default_config();                      // what `config init` prints

}  // namespace curvesup
