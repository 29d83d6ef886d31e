#include "scene.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "page_assets.h"

namespace curvesup {

namespace {

static_assert(std::endian::native == std::endian::little, "the page holds little-endian buffers");

std::string html_escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    if (c == '&') out += "&amp;";
    else if (c == '<') out += "&lt;";
    else if (c == '>') out += "&gt;";
    else if (c == '"') out += "&quot;";
    else out += c;
  }
  return out;
}

// JSON that cannot end the script element it stands in.
std::string script_json(const nlohmann::ordered_json& value) {
  const std::string text = value.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    if (c == '<') out += "\\u003c";
    else out += c;
  }
  return out;
}

}  // namespace

void QuantisedBox::add(const Vec3& p, std::vector<std::uint16_t>& out) const {
  for (int i = 0; i < 3; ++i) {
    const double size = high[i] - low[i];
    const double fraction = size > 0.0 ? (p[i] - low[i]) / size : 0.0;
    out.push_back(static_cast<std::uint16_t>(std::lround(65535.0 * std::clamp(fraction, 0.0, 1.0))));
  }
}

void add_direction(const Vec3& unit, std::vector<std::int8_t>& out) {
  const double sum = std::abs(unit.x()) + std::abs(unit.y()) + std::abs(unit.z());
  double u = sum > 0.0 ? unit.x() / sum : 0.0, v = sum > 0.0 ? unit.y() / sum : 0.0;
  if (unit.z() < 0.0) {
    const double folded = (1.0 - std::abs(v)) * (u < 0.0 ? -1.0 : 1.0);
    v = (1.0 - std::abs(u)) * (v < 0.0 ? -1.0 : 1.0);
    u = folded;
  }
  out.push_back(static_cast<std::int8_t>(std::lround(127.0 * u)));
  out.push_back(static_cast<std::int8_t>(std::lround(127.0 * v)));
}

std::string base64(std::string_view bytes) {
  constexpr char kDigits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  out.reserve((bytes.size() + 2) / 3 * 4);
  const auto byte = [&](std::size_t i) { return i < bytes.size() ? static_cast<unsigned char>(bytes[i]) : 0u; };
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const unsigned word = byte(i) << 16 | byte(i + 1) << 8 | byte(i + 2);
    out += kDigits[word >> 18];
    out += kDigits[word >> 12 & 63];
    out += i + 1 < bytes.size() ? kDigits[word >> 6 & 63] : '=';
    out += i + 2 < bytes.size() ? kDigits[word & 63] : '=';
  }
  return out;
}

void Scene::add_box(const char* name, const QuantisedBox& box) {
  const Vec3 low = box.empty() ? Vec3::Zero() : box.low, high = box.empty() ? Vec3::Ones() : box.high;
  info[name] = {{"low", {low.x(), low.y(), low.z()}}, {"high", {high.x(), high.y(), high.z()}}};
}

void Scene::add_bytes(const char* name, const char* type, const void* values, std::size_t count, std::size_t size) {
  data_.resize((data_.size() + 3) / 4 * 4);
  buffers_[name] = {{"type", type}, {"offset", data_.size()}, {"count", count}};
  data_.append(static_cast<const char*>(values), count * size);
}

std::string Scene::page(const std::string& title) const {
  nlohmann::ordered_json all = info;
  all["buffers"] = buffers_;
  // The template is cut at its @names; none of the inserted texts is searched again.
  std::string out;
  out.reserve(data_.size() / 3 * 4 + 2'000'000);
  const std::string_view page = assets::page_html();
  std::size_t from = 0;
  while (true) {
    const std::size_t at = page.find("@@", from);
    out += page.substr(from, at - from);
    if (at == std::string_view::npos) break;
    const std::size_t end = page.find("@@", at + 2);
    const std::string_view name = page.substr(at + 2, end - at - 2);
    if (name == "title") out += html_escaped(title);
    if (name == "style") out += assets::page_css();
    if (name == "three") out += assets::three_js();
    if (name == "viewer") out += assets::viewer_js();
    if (name == "report") out += assets::report_js();
    if (name == "scene") out += script_json(all);
    if (name == "data") out += base64(data_);
    from = end + 2;
  }
  return out;
}

}  // namespace curvesup
