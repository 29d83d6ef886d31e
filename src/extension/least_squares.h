#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "curvesup/core/run_context.h"
#include "curvesup/core/types.h"

namespace curvesup {

// One equation of a weighted least-squares problem: sum of coefficient · x[unknown] = target, at most five different unknowns.
struct LeastSquaresRow {
  std::array<Index, 5> unknown{};
  std::array<double, 5> coefficient{};
  int size = 0;
  double target = 0.0;
  double weight = 0.0;

  void add(Index i, double value) {
    unknown[size] = i;
    coefficient[size] = value;
    ++size;
  }
};

// Minimises sum of weight · (row · x - target)² by the normal equations: CHOLMOD's supernodal factorisation, analysed once
// for all rows, so that weights and targets may change from solve to solve. Every sum has one fixed order and the
// factorisation runs on one thread of OpenBLAS: the result does not depend on any thread count (another processor's kernels
// may differ in the last digit). Throws Error{solver} when the matrix is not positive definite or memory runs out.
class LeastSquaresSolver {
 public:
  LeastSquaresSolver(Index unknowns, std::span<const LeastSquaresRow> rows, const RunContext& run = {});
  ~LeastSquaresSolver();
  LeastSquaresSolver(const LeastSquaresSolver&) = delete;
  LeastSquaresSolver& operator=(const LeastSquaresSolver&) = delete;

  // The rows must have the unknowns of those given at construction.
  [[nodiscard]] std::vector<double> solve(std::span<const LeastSquaresRow> rows, const RunContext& run = {});
  // |A x - b| / |b| of the last solve (0 when b is 0).
  [[nodiscard]] double residual() const { return residual_; }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  double residual_ = 0.0;
};

}  // namespace curvesup
