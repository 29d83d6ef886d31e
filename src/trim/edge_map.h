#pragma once

#include <cstdint>
#include <vector>

#include "curvesup/core/types.h"

namespace curvesup {

// From an undirected edge (two vertex ids) to one Index. Open addressing; never iterated, so its order cannot matter.
class EdgeMap {
 public:
  EdgeMap() : keys_(64, kEmpty), values_(64) {}

  // The slot of edge ab, and whether it was just made (then it holds kNone). The reference dies with the next call.
  struct Slot {
    Index& value;
    bool is_new;
  };
  Slot at(Index a, Index b) {
    if (2 * (size_ + 1) > keys_.size()) grow();
    const std::uint64_t key = make_key(a, b);
    const std::size_t i = find(key);
    const bool is_new = keys_[i] == kEmpty;
    if (is_new) {
      keys_[i] = key;
      values_[i] = kNone;
      ++size_;
    }
    return {values_[i], is_new};
  }

 private:
  static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};
  static std::uint64_t make_key(Index a, Index b) {
    if (a > b) std::swap(a, b);
    return static_cast<std::uint64_t>(a) << 32 | static_cast<std::uint32_t>(b);
  }
  [[nodiscard]] std::size_t find(std::uint64_t key) const {
    std::size_t i = (key * 0x9E3779B97F4A7C15ull >> 20) & (keys_.size() - 1);
    while (keys_[i] != kEmpty && keys_[i] != key) i = (i + 1) & (keys_.size() - 1);
    return i;
  }
  void grow() {
    std::vector<std::uint64_t> keys(2 * keys_.size(), kEmpty);
    std::vector<Index> values(keys.size());
    keys.swap(keys_);
    values.swap(values_);
    for (std::size_t i = 0; i < keys.size(); ++i) {
      if (keys[i] == kEmpty) continue;
      const std::size_t to = find(keys[i]);
      keys_[to] = keys[i];
      values_[to] = values[i];
    }
  }
  std::vector<std::uint64_t> keys_;
  std::vector<Index> values_;
  std::size_t size_ = 0;
};

}  // namespace curvesup
