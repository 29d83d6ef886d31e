#include "curvesup/pipeline/config.h"

#include <algorithm>
#include <set>

#include "curvesup/core/error.h"
#include "curvesup/core/format.h"
#include "curvesup/core/words.h"
#include "curvesup/io/text_file.h"
#include "curvesup/pipeline/machine_config.h"

namespace curvesup {

namespace fs = std::filesystem;

namespace {

[[noreturn]] void fail(const std::string& where, const std::string& what, const std::string& remedy = {}) {
  throw Error(ErrorKind::usage, where, what, remedy);
}

std::size_t line_of_byte(const std::string& text, std::size_t byte) {
  return 1 + static_cast<std::size_t>(std::count(text.begin(), text.begin() + std::min(byte, text.size()), '\n'));
}

Json parse_json_file(const fs::path& file) {
  std::string text;
  try {
    text = read_file(file);
  } catch (const Error& error) {
    throw Error(ErrorKind::usage, error.where(), error.problem(), error.remedy());
  }
  try {
    Json json = Json::parse(text, nullptr, true, true);
    if (!json.is_object()) fail(file.string(), "the config must be a JSON object");
    return json;
  } catch (const nlohmann::json::parse_error& error) {
    const std::size_t line = line_of_byte(text, error.byte == 0 ? 0 : error.byte - 1);
    fail(file.string() + ":" + std::to_string(line), "not valid JSON", "check commas, quotes and brackets near this line");
  } catch (const nlohmann::json::exception&) {
    fail(file.string(), "holds a number that is too large", "look for exponents above 308");
  }
}

fs::path find_profile(const std::string& name, const fs::path& beside, const ConfigSearch& search, const fs::path& asking) {
  const fs::path path(name);
  if (path.is_absolute() && fs::exists(path)) return path;
  if (!path.is_absolute()) {
    if (fs::exists(beside / path)) return beside / path;
    if (!path.has_parent_path()) {
      for (const fs::path& folder : search.profile_folders) {
        if (fs::exists(folder / path)) return folder / path;
      }
    }
  }
  fail(asking.string(), "\"extends\": \"" + name + "\" names no file beside it and no shipped profile",
       "give a path relative to the config file, or the name of a shipped profile");
}

// Lays `upper` over `lower`, objects key by key.
void merge_over(Json& lower, const Json& upper) {
  if (!lower.is_object() || !upper.is_object()) {
    lower = upper;
    return;
  }
  for (const auto& [key, value] : upper.items()) {
    if (lower.contains(key)) {
      merge_over(lower[key], value);
    } else {
      lower[key] = value;
    }
  }
}

class ExtendsResolver {
 public:
  explicit ExtendsResolver(const ConfigSearch& search) : search_(search) {}

  Json read(const fs::path& file, const std::string& prefix) {
    const fs::path canonical = fs::weakly_canonical(file);
    if (!open_.insert(canonical).second) fail(file.string(), "the file extends itself", "break the circle of \"extends\"");
    const Json merged = flatten(parse_json_file(file), file, prefix);
    open_.erase(canonical);
    return merged;
  }

  std::map<std::string, fs::path> folder_of;

 private:
  Json flatten(Json json, const fs::path& file, const std::string& prefix) {
    Json result = Json::object();
    if (json.contains("extends")) {
      if (!json["extends"].is_string()) fail(file.string(), "\"extends\" must be the name of a file");
      result = read(find_profile(json["extends"].get<std::string>(), file.parent_path(), search_, file), prefix);
      json.erase("extends");
    }
    const fs::path folder = file.parent_path();
    for (auto& [key, value] : json.items()) {
      const std::string path = prefix.empty() ? key : prefix + "." + key;
      if (value.is_object()) value = flatten(value, file, path);
      else folder_of[path] = folder;
    }
    merge_over(result, json);
    return result;
  }

  const ConfigSearch& search_;
  std::set<fs::path> open_;
};

const ConfigKey* find_key(std::string_view path) {
  for (const ConfigKey& key : config_keys()) {
    if (key.path == path) return &key;
  }
  return nullptr;
}

std::string nearest_key(std::string_view path) {
  std::string best;
  std::size_t best_distance = std::numeric_limits<std::size_t>::max();
  const auto last_word = [](std::string_view p) { return p.substr(p.rfind('.') == std::string_view::npos ? 0 : p.rfind('.') + 1); };
  for (const ConfigKey& key : config_keys()) {
    const std::size_t distance = std::min(edit_distance(path, key.path), edit_distance(last_word(path), last_word(key.path)) + 1);
    if (distance < best_distance) {
      best_distance = distance;
      best = key.path;
    }
  }
  return best;
}

std::string range_text(const ConfigKey& key) {
  const bool low = std::isfinite(key.min), high = std::isfinite(key.max);
  if (low && high) return "from " + shortest(key.min) + " to " + shortest(key.max);
  if (low) return "at least " + shortest(key.min);
  if (high) return "at most " + shortest(key.max);
  return "any number";
}

std::string type_text(const ConfigKey& key) {
  switch (key.type) {
    case KeyType::boolean: return "true or false";
    case KeyType::integer: return "a whole number, " + range_text(key);
    case KeyType::number: return "a number, " + range_text(key);
    case KeyType::text: return "a text";
    case KeyType::choice: {
      std::string text = "one of";
      for (const auto& choice : key.choices) text += " " + choice;
      return text;
    }
    case KeyType::numbers: return (key.size > 0 ? std::to_string(key.size) + " numbers" : std::string("a list of numbers")) +
                                  (std::isfinite(key.min) || std::isfinite(key.max) ? ", each " + range_text(key) : "");
    case KeyType::list: return "a list";
  }
  return {};
}

bool in_range(const ConfigKey& key, double value) { return value >= key.min && value <= key.max && std::isfinite(value); }

bool valid_value(const ConfigKey& key, const Json& value) {
  if (value.is_null()) return key.nullable;
  switch (key.type) {
    case KeyType::boolean: return value.is_boolean();
    case KeyType::integer: return value.is_number_integer() && in_range(key, value.get<double>());
    case KeyType::number: return value.is_number() && in_range(key, value.get<double>());
    case KeyType::text: return value.is_string();
    case KeyType::choice: {
      const std::string text = value.is_boolean() ? (value.get<bool>() ? "true" : "false")
                               : value.is_string() ? value.get<std::string>() : std::string("\n");
      return std::find(key.choices.begin(), key.choices.end(), text) != key.choices.end();
    }
    case KeyType::numbers:
      if (!value.is_array() || (key.size > 0 && value.size() != key.size)) return false;
      return std::all_of(value.begin(), value.end(), [&](const Json& v) { return v.is_number() && in_range(key, v.get<double>()); });
    case KeyType::list: return value.is_array();
  }
  return false;
}

void check_value(const ConfigKey& key, const Json& value) {
  if (!valid_value(key, value)) {
    fail("config key " + key.path, "value " + value.dump() + " is not " + type_text(key) + (key.nullable ? ", or null" : ""));
  }
}

Json& slot(Json& root, std::string_view path) {
  Json* at = &root;
  for (std::size_t begin = 0; begin <= path.size();) {
    const std::size_t dot = std::min(path.find('.', begin), path.size());
    at = &(*at)[std::string(path.substr(begin, dot - begin))];
    begin = dot + 1;
  }
  return *at;
}

const Json* find_value(const Json& root, std::string_view path) {
  const Json* at = &root;
  for (std::size_t begin = 0; begin <= path.size();) {
    const std::size_t dot = std::min(path.find('.', begin), path.size());
    const std::string word(path.substr(begin, dot - begin));
    if (!at->is_object() || !at->contains(word)) return nullptr;
    at = &(*at)[word];
    begin = dot + 1;
  }
  return at;
}

bool is_section(const std::string& path) {
  return std::any_of(config_keys().begin(), config_keys().end(), [&](const ConfigKey& key) { return key.path.starts_with(path + "."); });
}

void check_known(const Json& json, const std::string& prefix) {
  for (const auto& [word, value] : json.items()) {
    const std::string path = prefix.empty() ? word : prefix + "." + word;
    if (find_key(path) != nullptr) continue;
    if (!is_section(path)) fail("config key " + path, "unknown key", "did you mean " + nearest_key(path) + "?");
    if (!value.is_object()) fail("config key " + path, "value " + value.dump() + " is not an object");
    check_known(value, path);
  }
}

void check_contradictions(const Json& values, const Json& resolved) {
  const auto number = [&](const char* path) { return config_value(resolved, path).get<double>(); };
  const Json* count = find_value(values, "layers.count");
  const Json* thickness = find_value(values, "layers.thickness_mm");
  if (count && thickness && !count->is_null() && !thickness->is_null()) {
    fail("config keys layers.count and layers.thickness_mm", "both are given", "give one of them");
  }
  if (number("support.leaf_radius_mm") < 0.5 * number("toolpath.bead_width_mm")) {
    fail("config keys support.leaf_radius_mm and toolpath.bead_width_mm",
         "a strut of radius " + shortest(number("support.leaf_radius_mm")) + " mm is thinner than one bead of " +
             shortest(number("toolpath.bead_width_mm")) + " mm",
         "make the radius at least half the bead width");
  }
  if (number("support.max_radius_mm") < number("support.leaf_radius_mm")) {
    fail("config keys support.max_radius_mm and support.leaf_radius_mm", "the largest strut radius is below the leaf radius");
  }
  if (number("support.min_trunk_radius_mm") > number("support.max_radius_mm")) {
    fail("config keys support.min_trunk_radius_mm and support.max_radius_mm", "the smallest trunk radius is above the largest");
  }
  if (number("support.side_gap_mm") > 0.0 && number("support.side_gap_mm") >= number("support.leaf_radius_mm")) {
    fail("config keys support.side_gap_mm and support.leaf_radius_mm", "the gap beside walls is as wide as half a strut, so struts vanish there");
  }
  if (number("support.foot_radius_mm") > 0.0 && number("support.foot_layers") < 1.0) {
    fail("config keys support.foot_radius_mm and support.foot_layers", "a foot of no layers is none", "set foot_layers to 1 or more");
  }
  if (config_value(resolved, "support.method") == "none" && !config_value(resolved, "support.enforce").empty()) {
    fail("config keys support.enforce and support.method", "regions that need support get none",
         "take the regions out, or set another method");
  }
  const double width = number("toolpath.bead_width_mm");
  if (const Json& narrowest = config_value(resolved, "toolpath.min_bead_mm"); !narrowest.is_null() && narrowest.get<double>() > width) {
    fail("config keys toolpath.min_bead_mm and toolpath.bead_width_mm", "the narrowest bead is wider than a bead");
  }
  if (const Json& widest = config_value(resolved, "toolpath.max_bead_mm"); !widest.is_null()) {
    if (widest.get<double>() < width) fail("config keys toolpath.max_bead_mm and toolpath.bead_width_mm", "the widest bead is narrower than a bead");
    if (widest.get<double>() > 2.0 * width) {
      fail("config keys toolpath.max_bead_mm and toolpath.bead_width_mm", "the widest bead is wider than two beads",
           "make max_bead_mm at most twice bead_width_mm, or null");
    }
  }
  if (const Json& spacing = config_value(resolved, "toolpath.support_line_spacing_mm"); !spacing.is_null()) {
    if (config_value(resolved, "toolpath.support_fill") != "contour+zigzag") {
      fail("config keys toolpath.support_line_spacing_mm and toolpath.support_fill", "rings are not spaced",
           "set support_fill to contour+zigzag");
    }
    if (spacing.get<double>() < number("toolpath.bead_width_mm")) {
      fail("config keys toolpath.support_line_spacing_mm and toolpath.bead_width_mm", "lines are nearer to each other than a bead is wide");
    }
  }
  (void)machine_from_config(config_value(resolved, "machine"));  // throws where the machine contradicts itself
  const std::string source = config_value(resolved, "field.source").get<std::string>();
  const Json& path = config_value(resolved, "field.path");
  if (source != "direction" && (path.is_null() || path == "")) {
    fail("config keys field.source and field.path", "source " + source + " needs a path", "set field.path");
  }
}

}  // namespace

ConfigSource read_config(const fs::path& file, const ConfigSearch& search) {
  ExtendsResolver resolver(search);
  ConfigSource config;
  config.values = resolver.read(file, "");
  config.folder_of = std::move(resolver.folder_of);
  return config;
}

void apply_override(ConfigSource& config, std::string_view assignment) {
  const std::size_t equals = assignment.find('=');
  if (equals == std::string_view::npos || equals == 0) {
    fail("-s " + std::string(assignment), "not of the form key.path=value");
  }
  const std::string path(assignment.substr(0, equals)), text(assignment.substr(equals + 1));
  if (find_key(path) == nullptr) fail("-s " + path, "unknown key", "did you mean " + nearest_key(path) + "?");
  Json value = Json::parse(text, nullptr, false);
  if (value.is_discarded()) value = text;
  slot(config.values, path) = value;
  config.folder_of[path] = fs::path();
}

Json resolve_config(const ConfigSource& config) {
  check_known(config.values, "");
  Json resolved = Json::object();
  for (const ConfigKey& key : config_keys()) {
    const Json* given = find_value(config.values, key.path);
    Json value = given ? *given : key.default_value;
    check_value(key, value);
    if (key.type == KeyType::choice && value.is_boolean()) value = value.get<bool>() ? "true" : "false";
    slot(resolved, key.path) = value;
  }
  check_contradictions(config.values, resolved);
  if (!config_value(resolved, "layers.count").is_null()) slot(resolved, "layers.thickness_mm") = nullptr;
  return resolved;
}

const Json& config_value(const Json& resolved, std::string_view path) {
  const Json* value = find_value(resolved, path);
  if (value == nullptr) fail("config key " + std::string(path), "is missing from the resolved config");
  return *value;
}

fs::path config_file_path(const ConfigSource& config, std::string_view key, const std::string& value) {
  const fs::path path(value);
  const auto folder = config.folder_of.find(std::string(key));
  if (path.is_absolute() || folder == config.folder_of.end()) return path;
  return folder->second / path;
}

namespace {
Json key_schema(const ConfigKey& key) {
  Json schema;
  const auto typed = [&](const char* type) { return key.nullable ? Json::array({type, "null"}) : Json(type); };
  const auto limits = [&](Json& target) {
    if (std::isfinite(key.min)) target["minimum"] = key.min;
    if (std::isfinite(key.max)) target["maximum"] = key.max;
  };
  switch (key.type) {
    case KeyType::boolean: schema["type"] = typed("boolean"); break;
    case KeyType::integer: schema["type"] = typed("integer"); limits(schema); break;
    case KeyType::number: schema["type"] = typed("number"); limits(schema); break;
    case KeyType::text: schema["type"] = typed("string"); break;
    case KeyType::choice: {
      Json choices = key.choices;
      for (const auto& choice : key.choices) {
        if (choice == "true") choices.push_back(true);
        if (choice == "false") choices.push_back(false);
      }
      schema["enum"] = choices;
      break;
    }
    case KeyType::numbers: {
      schema["type"] = typed("array");
      schema["items"]["type"] = "number";
      limits(schema["items"]);
      if (key.size > 0) schema["minItems"] = schema["maxItems"] = key.size;
      break;
    }
    case KeyType::list: schema["type"] = typed("array"); break;
  }
  schema["description"] = key.doc;
  schema["default"] = key.default_value;
  return schema;
}

Json& schema_section(Json& root, std::string_view path) {
  Json* at = &root;
  for (std::size_t begin = 0; begin < path.size();) {
    const std::size_t dot = std::min(path.find('.', begin), path.size());
    at = &(*at)["properties"][std::string(path.substr(begin, dot - begin))];
    if (at->is_null()) *at = {{"type", "object"}, {"additionalProperties", false}, {"properties", {{"extends", {{"type", "string"}}}}}};
    begin = dot + 1;
  }
  return *at;
}
}  // namespace

Json config_schema() {
  Json schema = {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
                 {"title", "curvesup config"},
                 {"type", "object"},
                 {"additionalProperties", false},
                 {"properties", {{"extends", {{"type", "string"}, {"description", "A config file that this one is laid over, key by key."}}}}}};
  for (const ConfigKey& key : config_keys()) {
    const std::size_t dot = key.path.rfind('.');
    schema_section(schema, std::string_view(key.path).substr(0, dot))["properties"][key.path.substr(dot + 1)] = key_schema(key);
  }
  return schema;
}

std::string explain_key(std::string_view path) {
  const ConfigKey* key = find_key(path);
  if (key == nullptr && is_section(std::string(path))) {
    std::string text;
    for (const ConfigKey& row : config_keys()) {
      if (row.path.starts_with(std::string(path) + ".")) text += row.path + ": " + row.doc + "\n";
    }
    return text;
  }
  if (key == nullptr) fail("config key " + std::string(path), "unknown key", "did you mean " + nearest_key(path) + "?");
  return key->path + ": " + key->doc + "\n  takes " + type_text(*key) + (key->nullable ? ", or null" : "") + "\n  default " +
         key->default_value.dump() + "\n";
}

Json default_config() {
  ConfigSource empty;
  return resolve_config(empty);
}

}  // namespace curvesup
