#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "curvesup/core/angle.h"
#include "curvesup/core/report.h"
#include "curvesup/domain/domain.h"
#include "curvesup/overhang/overhang.h"

namespace curvesup {

enum class NodeKind : std::uint8_t { node = 0, leaf = 1, platform_end = 2, model_end = 3 };

struct SkeletonNode {
  Vec3 position = Vec3::Zero();
  Index tet = kNone;    // of the domain
  Index layer = kNone;  // k of the layer it lies on; for leaves and ends the layer below which the edge started or ended
  NodeKind kind = NodeKind::node;
};

// From the upper node (nearer the overhang) to the lower one.
struct SkeletonEdge {
  Index upper = kNone, lower = kNone;
  Index branch_count = 1;
  double radius_mm = 0.0;
  Index layer = 0;
};

struct Skeleton {
  std::vector<SkeletonNode> nodes;
  std::vector<SkeletonEdge> edges;
};

}  // namespace curvesup
