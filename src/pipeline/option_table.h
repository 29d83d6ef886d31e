#pragma once

#include <cmath>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "curvesup/core/angle.h"
#include "curvesup/core/error.h"
#include "curvesup/pipeline/config.h"

namespace curvesup {

// A config key together with the place in an options struct that it sets: defaults, ranges, schema, documentation and the
// mapping come from this one row. Default values are those of a default-constructed Target.
template <class Target>
class OptionTable {
 public:
  explicit OptionTable(std::string section) : section_(std::move(section)) {}

  template <class Field>
  void number(const char* path, Field field, double min, double max, const char* doc) {
    add_number(make(path, KeyType::number, field(defaults_), doc), min, max,
               [field](Target& target, const Json& value) { field(target) = value.get<double>(); });
  }
  // A std::optional<double>; null is nullopt.
  template <class Field>
  void optional_number(const char* path, Field field, double min, double max, const char* doc) {
    ConfigKey key = make(path, KeyType::number, nullptr, doc);
    key.nullable = true;
    add_number(std::move(key), min, max, [field](Target& target, const Json& value) {
      if (value.is_null()) field(target) = std::nullopt;
      else field(target) = value.get<double>();
    });
  }
  template <class Field>
  void angle(const char* path, Field field, double min, double max, const char* doc) {
    add_number(make(path, KeyType::number, rounded(field(defaults_).degrees()), doc), min, max,
               [field](Target& target, const Json& value) { field(target) = Angle::degrees(value.get<double>()); });
  }
  template <class Field>
  void integer(const char* path, Field field, double min, double max, const char* doc) {
    using Number = std::remove_reference_t<decltype(field(defaults_))>;
    add_number(make(path, KeyType::integer, field(defaults_), doc), min, max,
               [field](Target& target, const Json& value) { field(target) = value.get<Number>(); });
  }
  template <class Field>
  void boolean(const char* path, Field field, const char* doc) {
    rows_.push_back({make(path, KeyType::boolean, field(defaults_), doc),
                     [field](Target& target, const Json& value) { field(target) = value.get<bool>(); }});
  }
  template <class Field>
  void text(const char* path, Field field, const char* doc) {
    rows_.push_back({make(path, KeyType::text, field(defaults_), doc),
                     [field](Target& target, const Json& value) { field(target) = value.get<std::string>(); }});
  }
  // An enum whose values 0, 1, ... are called names[0], names[1], ...
  template <class Field>
  void choice(const char* path, Field field, std::vector<std::string> names, const char* doc) {
    using Enum = std::remove_reference_t<decltype(field(defaults_))>;
    ConfigKey key = make(path, KeyType::choice, names[static_cast<std::size_t>(field(defaults_))], doc);
    key.choices = names;
    rows_.push_back({std::move(key), [field, names](Target& target, const Json& value) {
                       const std::string text = value.get<std::string>();
                       for (std::size_t i = 0; i < names.size(); ++i) {
                         if (names[i] == text) field(target) = static_cast<Enum>(i);
                       }
                     }});
  }
  // `size` numbers; element(target, i) is the place of the i-th, which holds the number times `scale`.
  template <class Element>
  void numbers(const char* path, std::size_t size, double scale, Element element, double min, double max, const char* doc) {
    Json values = Json::array();
    for (std::size_t i = 0; i < size; ++i) values.push_back(rounded(element(defaults_, i) / scale));
    ConfigKey key = make(path, KeyType::numbers, values, doc);
    key.size = size;
    add_number(std::move(key), min, max, [element, size, scale](Target& target, const Json& value) {
      for (std::size_t i = 0; i < size; ++i) element(target, i) = value[i].template get<double>() * scale;
    });
  }
  // A row whose value is read elsewhere, or in a way of its own.
  void custom(ConfigKey key, std::function<void(Target&, const Json&)> set = {}) {
    key.path = section_ + "." + key.path;
    rows_.push_back({std::move(key), std::move(set)});
  }

  [[nodiscard]] std::vector<ConfigKey> keys() const {
    std::vector<ConfigKey> keys;
    for (const Row& row : rows_) keys.push_back(row.key);
    return keys;
  }
  // The options that a resolved config holds. Throws Error{usage} naming a key that is missing or of the wrong type.
  [[nodiscard]] Target read(const Json& resolved) const {
    Target target = defaults_;
    for (const Row& row : rows_) {
      if (!row.set) continue;
      try {
        row.set(target, config_value(resolved, row.key.path));
      } catch (const nlohmann::json::exception&) {
        throw Error(ErrorKind::usage, "config key " + row.key.path, "has a value of the wrong type");
      }
    }
    return target;
  }

 private:
  struct Row {
    ConfigKey key;
    std::function<void(Target&, const Json&)> set;
  };

  ConfigKey make(const std::string& path, KeyType type, Json value, const char* doc) const {
    ConfigKey key;
    key.path = section_ + "." + path;
    key.type = type;
    key.default_value = std::move(value);
    key.doc = doc;
    return key;
  }
  void add_number(ConfigKey key, double min, double max, std::function<void(Target&, const Json&)> set) {
    key.min = min;
    key.max = max;
    rows_.push_back({std::move(key), std::move(set)});
  }
  // Degrees and millimetres that went through radians and metres read as they were meant.
  static double rounded(double value) { return std::round(value * 1e9) / 1e9; }

  std::string section_;
  Target defaults_{};
  std::vector<Row> rows_;
};

// The place of an option in its struct, for OptionTable.
#define CURVESUP_FIELD(expression) [](auto& target) -> auto& { return target.expression; }
#define CURVESUP_ELEMENT(expression) [](auto& target, std::size_t i) -> double& { return target.expression; }

}  // namespace curvesup
