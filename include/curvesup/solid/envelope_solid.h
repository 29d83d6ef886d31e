#pragma once

#include <memory>
#include <span>

#include "curvesup/core/run_context.h"
#include "curvesup/model/model.h"
#include "curvesup/skeleton/grow_skeleton.h"
#include "curvesup/solid/solid.h"

namespace curvesup {

struct EnvelopeOptions {
  double alpha_mm = 8.0;  // a radius
  double leaf_radius_mm = 0.8;
  double sample_step_mm = 0.4;  // along the rays; half a layer
};

struct EnvelopeReport {
  Index rays = 0, samples = 0;
  Index inner_tets = 0;        // of the alpha-complex
  Index border_simplices = 0;  // its border triangles, and the triangles, edges and points that belong to no tet
};

struct EnvelopeResult {
  std::unique_ptr<Solid> solid;
  EnvelopeReport report;
};

// The previous method as a baseline (Fang et al. 2020): straight rays from the leaves along -d_p (where nearly
// horizontal, turned half way down) to the first model hit or the platform; the alpha-complex of points on them,
// thickened by exactly leaf_radius_mm: value(p) = leaf_radius_mm - distance to the complex. Distances beyond four radii
// are given as that. value() is 1-Lipschitz and safe to call from many threads; bounds() follows from that. O(n log n)
// on ordinary input, about 1 kB a sample. Throws Error{usage} when a length is not above 0.
[[nodiscard]] EnvelopeResult build_envelope(const Model& model, std::span<const LeafSite> leaves,
                                            const EnvelopeOptions& options = {}, const RunContext& run = {});

}  // namespace curvesup
