#include "extension/least_squares.h"

#include <cholmod.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "curvesup/core/error.h"
#include "curvesup/core/parallel.h"

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
constexpr std::size_t kColumnGrain = 2048;

// An unknown is number `place` of row `row`.
struct Use {
  Index row = kNone;
  int place = 0;
};

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

// The upper triangle of the normal equations by columns, its factor, and the rows that each column comes from.
struct LeastSquaresSolver::Impl {
  cholmod_common common{};
  cholmod_sparse* matrix = nullptr;
  cholmod_factor* factor = nullptr;
  Index unknowns = 0;
  std::vector<std::size_t> first_use;  // of every unknown, in `uses`; one more than unknowns
  std::vector<Use> uses;               // rows in ascending order

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

  void find_uses(std::span<const LeastSquaresRow> rows);
  void build_pattern(std::span<const LeastSquaresRow> rows, const RunContext& run);
  void sum_values(std::span<const LeastSquaresRow> rows, double* right, const RunContext& run);
  void check_memory() const {
    if (common.status == CHOLMOD_OUT_OF_MEMORY) {
      throw Error(ErrorKind::solver, kStage, "not enough memory for the factorisation", "allow larger tets");
    }
  }
};

void LeastSquaresSolver::Impl::find_uses(std::span<const LeastSquaresRow> rows) {
  first_use.assign(unknowns + 1, 0);
  for (const LeastSquaresRow& row : rows) {
    for (int i = 0; i < row.size; ++i) ++first_use[row.unknown[i] + 1];
  }
  std::partial_sum(first_use.begin(), first_use.end(), first_use.begin());
  uses.resize(first_use.back());
  std::vector<std::size_t> next(first_use.begin(), first_use.end() - 1);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (int i = 0; i < rows[r].size; ++i) uses[next[rows[r].unknown[i]]++] = {static_cast<Index>(r), i};
  }
}

void LeastSquaresSolver::Impl::build_pattern(std::span<const LeastSquaresRow> rows, const RunContext& run) {
  find_uses(rows);
  std::vector<std::vector<int>> entries(chunk_count(unknowns, kColumnGrain));
  std::vector<int> start(unknowns + 1, 0);  // first the size of a column, then where it starts
  parallel_for(unknowns, kColumnGrain, run, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
    std::vector<Index> last_column(unknowns, kNone);  // in which an unknown was found
    for (std::size_t c = begin; c < end; ++c) {
      const Index column = static_cast<Index>(c);
      const auto first = static_cast<std::ptrdiff_t>(entries[chunk].size());
      for (std::size_t u = first_use[c]; u < first_use[c + 1]; ++u) {
        const LeastSquaresRow& row = rows[uses[u].row];
        for (int i = 0; i < row.size; ++i) {
          const Index other = row.unknown[i];
          if (other > column || last_column[other] == column) continue;
          last_column[other] = column;
          entries[chunk].push_back(other);
        }
      }
      std::sort(entries[chunk].begin() + first, entries[chunk].end());
      start[c + 1] = static_cast<int>(entries[chunk].size() - first);
    }
  });
  std::partial_sum(start.begin(), start.end(), start.begin());
  matrix = cholmod_allocate_sparse(unknowns, unknowns, start.back(), 1, 1, 1, CHOLMOD_REAL, &common);
  check_memory();
  std::copy(start.begin(), start.end(), static_cast<int*>(matrix->p));
  int* to = static_cast<int*>(matrix->i);
  for (const auto& part : entries) to = std::copy(part.begin(), part.end(), to);
}

// Every entry and every right side is one sum, over the rows in ascending order.
void LeastSquaresSolver::Impl::sum_values(std::span<const LeastSquaresRow> rows, double* right, const RunContext& run) {
  const int* start = static_cast<int*>(matrix->p);
  const int* entry = static_cast<int*>(matrix->i);
  auto* value = static_cast<double*>(matrix->x);
  parallel_for(unknowns, kColumnGrain, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    std::vector<double> sum(unknowns, 0.0);
    for (std::size_t c = begin; c < end; ++c) {
      right[c] = 0.0;
      for (std::size_t u = first_use[c]; u < first_use[c + 1]; ++u) {
        const LeastSquaresRow& row = rows[uses[u].row];
        const double scaled = row.weight * row.coefficient[uses[u].place];
        for (int i = 0; i < row.size; ++i) sum[row.unknown[i]] += scaled * row.coefficient[i];
        right[c] += scaled * row.target;
      }
      for (int e = start[c]; e < start[c + 1]; ++e) value[e] = sum[entry[e]];
      for (std::size_t u = first_use[c]; u < first_use[c + 1]; ++u) {
        const LeastSquaresRow& row = rows[uses[u].row];
        for (int i = 0; i < row.size; ++i) sum[row.unknown[i]] = 0.0;
      }
    }
  });
}

LeastSquaresSolver::LeastSquaresSolver(Index unknowns, std::span<const LeastSquaresRow> rows, const RunContext& run)
    : impl_(std::make_unique<Impl>(unknowns)) {
  impl_->build_pattern(rows, run);
  impl_->factor = cholmod_analyze(impl_->matrix, &impl_->common);
  impl_->check_memory();
  if (impl_->factor == nullptr) throw Error(ErrorKind::solver, kStage, "the matrix could not be analysed", "");
}

LeastSquaresSolver::~LeastSquaresSolver() = default;

std::vector<double> LeastSquaresSolver::solve(std::span<const LeastSquaresRow> rows, const RunContext& run) {
  const SingleThreadedAlgebra single_threaded;
  Impl& m = *impl_;
  cholmod_dense* right = cholmod_zeros(m.unknowns, 1, CHOLMOD_REAL, &m.common);
  m.check_memory();
  auto* b = static_cast<double*>(right->x);
  m.sum_values(rows, b, run);
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
