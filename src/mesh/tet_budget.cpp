#include "mesh/tet_budget.h"

#include "curvesup/core/format.h"

namespace curvesup {

std::string scale_that_helps(double size_mm) {
  constexpr double kPart_mm = 500.0;
  double divisor = 1.0;
  while (size_mm / divisor > kPart_mm && divisor < 1e6) divisor *= 10.0;
  return shortest(1.0 / divisor);
}

}  // namespace curvesup
