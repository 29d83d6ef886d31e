#include "extension/least_squares.h"

#include <cholmod.h>

#include <algorithm>
#include <cmath>

#include "curvesup/core/error.h"

extern "C" {
void openblas_set_num_threads(int);
int openblas_get_num_threads();
// Of the OpenMP runtime that CHOLMOD brings along, if it was built with any.
[[gnu::weak]] void omp_set_max_active_levels(int);
[[gnu::weak]] int omp_get_max_active_levels();
}

namespace curvesup {
namespace {

constexpr const char* kStage = "extension";

// OpenBLAS splits its products by thread, which changes the last bits of a sum. CHOLMOD starts four OpenMP threads several
// times a supernode, whatever the machine has: their waiting costs more than all of the factorisation.
class SingleThreadedAlgebra {
 public:
  SingleThreadedAlgebra() : blas_threads_(openblas_get_num_threads()) {
    openblas_set_num_threads(1);
    if (has_openmp()) {
      openmp_levels_ = omp_get_max_active_levels();
      omp_set_max_active_levels(0);
    }
  }
  ~SingleThreadedAlgebra() {
    openblas_set_num_threads(blas_threads_);
    if (has_openmp()) omp_set_max_active_levels(openmp_levels_);
  }
  SingleThreadedAlgebra(const SingleThreadedAlgebra&) = delete;
  SingleThreadedAlgebra& operator=(const SingleThreadedAlgebra&) = delete;

 private:
  static bool has_openmp() { return &omp_set_max_active_levels != nullptr && &omp_get_max_active_levels != nullptr; }

  int blas_threads_ = 1;
  int openmp_levels_ = 1;
};

}  // namespace

// The lower triangle of the normal equations by columns, its factor, and where each product of two coefficients goes.
struct LeastSquaresSolver::Impl {
  cholmod_common common{};
  cholmod_sparse* matrix = nullptr;
  cholmod_factor* factor = nullptr;
  Index unknowns = 0;
  std::vector<Index> slot;  // of the pairs (a, b <= a) of every row, row after row

  explicit Impl(Index n) : unknowns(n) {
    cholmod_start(&common);
    common.print = 0;
    common.supernodal = CHOLMOD_SUPERNODAL;
    common.final_ll = 1;
    common.nmethods = 1;
    common.method[0].ordering = CHOLMOD_METIS;
    common.postorder = 1;
  }
  ~Impl() {
    cholmod_free_factor(&factor, &common);
    cholmod_free_sparse(&matrix, &common);
    cholmod_finish(&common);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  void build_pattern(std::span<const LeastSquaresRow> rows);
  void check_memory() const {
    if (common.status == CHOLMOD_OUT_OF_MEMORY) {
      throw Error(ErrorKind::solver, kStage, "not enough memory for the factorisation", "allow larger tets");
    }
  }
};

void LeastSquaresSolver::Impl::build_pattern(std::span<const LeastSquaresRow> rows) {
  const auto for_pairs = [&](auto&& visit) {
    for (const LeastSquaresRow& row : rows) {
      for (int a = 0; a < row.size; ++a) {
        for (int b = 0; b <= a; ++b) {
          visit(std::min(row.unknown[a], row.unknown[b]), std::max(row.unknown[a], row.unknown[b]));
        }
      }
    }
  };
  // Bucket the pairs by column, then sort and unique inside each column.
  std::vector<std::int64_t> begin(unknowns + 1, 0);
  std::int64_t pairs = 0;
  for_pairs([&](Index column, Index) {
    ++begin[column + 1];
    ++pairs;
  });
  for (Index c = 0; c < unknowns; ++c) begin[c + 1] += begin[c];
  std::vector<Index> entries(pairs);
  std::vector<std::int64_t> next(begin.begin(), begin.end() - 1);
  for_pairs([&](Index column, Index row) { entries[next[column]++] = row; });
  std::vector<int> start(unknowns + 1, 0);
  Index kept = 0;
  for (Index c = 0; c < unknowns; ++c) {
    start[c] = kept;
    std::sort(entries.begin() + begin[c], entries.begin() + begin[c + 1]);
    Index last = kNone;
    for (std::int64_t i = begin[c]; i < begin[c + 1]; ++i) {
      if (entries[i] == last) continue;
      last = entries[i];
      entries[kept++] = last;
    }
  }
  start[unknowns] = kept;
  slot.reserve(pairs);
  for_pairs([&](Index column, Index row) {
    const auto first = entries.begin() + start[column], last = entries.begin() + start[column + 1];
    slot.push_back(static_cast<Index>(std::lower_bound(first, last, row) - entries.begin()));
  });
  matrix = cholmod_allocate_sparse(unknowns, unknowns, kept, 1, 1, -1, CHOLMOD_REAL, &common);
  check_memory();
  std::copy(start.begin(), start.end(), static_cast<int*>(matrix->p));
  std::copy(entries.begin(), entries.begin() + kept, static_cast<int*>(matrix->i));
}

LeastSquaresSolver::LeastSquaresSolver(Index unknowns, std::span<const LeastSquaresRow> rows)
    : impl_(std::make_unique<Impl>(unknowns)) {
  impl_->build_pattern(rows);
  impl_->factor = cholmod_analyze(impl_->matrix, &impl_->common);
  impl_->check_memory();
  if (impl_->factor == nullptr) throw Error(ErrorKind::solver, kStage, "the matrix could not be analysed", "");
}

LeastSquaresSolver::~LeastSquaresSolver() = default;

std::vector<double> LeastSquaresSolver::solve(std::span<const LeastSquaresRow> rows) {
  const SingleThreadedAlgebra single_threaded;
  Impl& m = *impl_;
  auto* value = static_cast<double*>(m.matrix->x);
  std::fill_n(value, static_cast<int*>(m.matrix->p)[m.unknowns], 0.0);
  cholmod_dense* right = cholmod_zeros(m.unknowns, 1, CHOLMOD_REAL, &m.common);
  m.check_memory();
  auto* b = static_cast<double*>(right->x);
  std::size_t pair = 0;
  for (const LeastSquaresRow& row : rows) {
    for (int i = 0; i < row.size; ++i) {
      const double scaled = row.weight * row.coefficient[i];
      for (int j = 0; j <= i; ++j) {
        value[m.slot[pair++]] += scaled * row.coefficient[j];
      }
      b[row.unknown[i]] += scaled * row.target;
    }
  }
  cholmod_factorize(m.matrix, m.factor, &m.common);
  const bool failed = m.common.status != CHOLMOD_OK || m.factor->minor < m.factor->n;
  cholmod_dense* x = failed ? nullptr : cholmod_solve(CHOLMOD_A, m.factor, right, &m.common);
  if (x == nullptr) {
    cholmod_free_dense(&right, &m.common);
    m.check_memory();
    throw Error(ErrorKind::solver, kStage, "the system is not positive definite",
                "check the mesh for needle tets, or change the hull's edge length");
  }
  const auto* solution = static_cast<const double*>(x->x);
  std::vector<double> result(solution, solution + m.unknowns);
  double norm_b = 0.0, norm_r = 0.0;
  for (Index i = 0; i < m.unknowns; ++i) norm_b += b[i] * b[i];
  double minus_one[2] = {-1.0, 0.0}, one[2] = {1.0, 0.0};
  cholmod_sdmult(m.matrix, 0, one, minus_one, x, right, &m.common);
  for (Index i = 0; i < m.unknowns; ++i) norm_r += b[i] * b[i];
  residual_ = norm_b > 0.0 ? std::sqrt(norm_r / norm_b) : 0.0;
  cholmod_free_dense(&x, &m.common);
  cholmod_free_dense(&right, &m.common);
  return result;
}

}  // namespace curvesup
