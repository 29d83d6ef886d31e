#include "skeleton/tet_walk.h"

#include <gtest/gtest.h>

#include <vector>

#include "curvesup/mesh/tet_mesh.h"
#include "helpers/brick_domain.h"
#include "helpers/shapes.h"

namespace curvesup {
namespace {

// Where a ray leaves its first tet at once, the next one counts, too: an edge of the tree must not lean too far in either.
TEST(TetWalk, EntersTheTetBehindOneThatItOnlyGrazes) {
  const Domain domain = shapes::brick_domain(Vec3(0, 0, 0), Vec3(2, 2, 2), {1, 1, 1}, [](const Vec3&) { return false; });
  const ScalarField field = shapes::sampled_field(domain, [](const Vec3& p) { return p.z(); });
  const TetWalk walk(domain, field);
  int faces = 0;
  for (Index t = 0; t < static_cast<Index>(domain.mesh.tets.size()); ++t) {
    for (int f = 0; f < 4; ++f) {
      const Index next = domain.topology.neighbours[t][f];
      if (next == kNone) continue;
      const auto v = face_vertices(domain.mesh.tets[t], f);
      const Vec3 &a = domain.mesh.vertices[v[0]], &b = domain.mesh.vertices[v[1]], &c = domain.mesh.vertices[v[2]];
      const Vec3 out = (b - a).cross(c - a).normalized(), middle = (a + b + c) / 3.0;
      const WalkResult grazing = walk.walk(middle - 3e-5 * out, t, out, {.length = 0.01, .stop_at_platform = false});
      EXPECT_EQ(std::vector<Index>(grazing.entered().begin(), grazing.entered().end()), (std::vector<Index>{t, next}));
      const WalkResult running = walk.walk(middle - 1e-3 * out, t, out, {.length = 0.01, .stop_at_platform = false});
      EXPECT_EQ(std::vector<Index>(running.entered().begin(), running.entered().end()), (std::vector<Index>{t}));
      ++faces;
    }
  }
  EXPECT_GT(faces, 5);
}

}  // namespace
}  // namespace curvesup
