#pragma once

#include <algorithm>
#include <numeric>
#include <vector>

#include "curvesup/core/types.h"

namespace curvesup {

// Union-find; the root of a set is its lowest element, so the result does not depend on the order of the joins.
class DisjointSets {
 public:
  explicit DisjointSets(std::size_t count) : parent_(count) { std::iota(parent_.begin(), parent_.end(), 0); }
  // Elements that are new are sets of their own.
  void grow_to(std::size_t count) {
    const std::size_t known = parent_.size();
    if (count <= known) return;
    parent_.resize(count);
    std::iota(parent_.begin() + known, parent_.end(), static_cast<Index>(known));
  }
  Index root(Index element) {
    while (parent_[element] != element) element = parent_[element] = parent_[parent_[element]];
    return element;
  }
  // Whether they were apart.
  bool join(Index a, Index b) {
    a = root(a);
    b = root(b);
    if (a == b) return false;
    parent_[std::max(a, b)] = std::min(a, b);
    return true;
  }

 private:
  std::vector<Index> parent_;
};

}  // namespace curvesup
