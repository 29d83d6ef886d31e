#pragma once

#include <array>
#include <string>
#include <utility>
#include <vector>

#include "curvesup/model/diagnose.h"

namespace curvesup {

// What the diagnoses of tets and of surfaces share: problems are added to the result where there are elements to name.
class ProblemList {
 protected:
  using Severity = MeshProblem::Severity;

  void add(std::string name, Severity severity, std::string element, int ids_per_element, std::vector<Index> ids,
           std::string text, std::string remedy) {
    if (ids.empty()) return;
    result_.problems.push_back({std::move(name), severity, std::move(element), ids_per_element, std::move(ids),
                                std::move(text), std::move(remedy)});
  }

  template <std::size_t N>
  static std::vector<Index> flat(const std::vector<std::array<Index, N>>& list) {
    std::vector<Index> ids;
    for (const auto& element : list) ids.insert(ids.end(), element.begin(), element.end());
    return ids;
  }

  MeshDiagnosis result_;
};

}  // namespace curvesup
