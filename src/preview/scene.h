#pragma once

#include <cstdint>
#include <nlohmann/json.hpp>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "curvesup/core/types.h"

namespace curvesup {

// Positions as three 16-bit fractions of a box.
struct QuantisedBox {
  Vec3 low = Vec3::Constant(1e300), high = Vec3::Constant(-1e300);

  void include(const Vec3& p) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  [[nodiscard]] bool empty() const { return low.x() > high.x(); }
  void add(const Vec3& p, std::vector<std::uint16_t>& out) const;
};

// Unit vector in two bytes (octahedral), within 1 degree.
void add_direction(const Vec3& unit, std::vector<std::int8_t>& out);

// Named binary buffers and a JSON object that says what they are: what the viewer's script draws.
class Scene {
 public:
  nlohmann::ordered_json info = nlohmann::ordered_json::object();

  template <class T>
  void add(const char* name, const std::vector<T>& values) {
    add_bytes(name, type_name<T>(), values.data(), values.size(), sizeof(T));
  }
  void add_box(const char* name, const QuantisedBox& box);
  [[nodiscard]] std::size_t bytes() const { return data_.size(); }

  // The whole page.
  [[nodiscard]] std::string page(const std::string& title) const;

 private:
  template <class T>
  static const char* type_name() {
    if constexpr (std::is_same_v<T, std::uint16_t>) return "Uint16Array";
    if constexpr (std::is_same_v<T, std::uint32_t>) return "Uint32Array";
    if constexpr (std::is_same_v<T, std::int16_t>) return "Int16Array";
    if constexpr (std::is_same_v<T, std::int32_t>) return "Int32Array";
    if constexpr (std::is_same_v<T, std::uint8_t>) return "Uint8Array";
    if constexpr (std::is_same_v<T, std::int8_t>) return "Int8Array";
    if constexpr (std::is_same_v<T, float>) return "Float32Array";
  }
  void add_bytes(const char* name, const char* type, const void* values, std::size_t count, std::size_t size);

  nlohmann::ordered_json buffers_ = nlohmann::ordered_json::object();
  std::string data_;
};

[[nodiscard]] std::string base64(std::string_view bytes);

}  // namespace curvesup
