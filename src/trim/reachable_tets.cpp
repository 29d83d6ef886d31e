#include "trim/reachable_tets.h"

#include <algorithm>
#include <cmath>

#include "curvesup/core/parallel.h"

namespace curvesup {

namespace {

Neighbourhood ball_around(const TetMesh& mesh, Index tet) {
  Neighbourhood ball;
  for (const Index v : mesh.tets[tet]) ball.centre += 0.25 * mesh.vertices[v];
  double radius2 = 0.0;
  for (const Index v : mesh.tets[tet]) radius2 = std::max(radius2, (mesh.vertices[v] - ball.centre).squaredNorm());
  ball.radius = std::sqrt(radius2);
  return ball;
}

// The parts of the solid near a tet, but those beyond one of its faces.
void find_parts(const Solid& solid, const TetMesh& mesh, Index tet, const Neighbourhood& ball, std::vector<Index>& parts) {
  solid.find_parts(ball.centre, ball.radius, parts);
  for (int f = 0; f < 4 && !parts.empty(); ++f) {
    const auto v = face_vertices(mesh.tets[tet], f);
    const Vec3 &a = mesh.vertices[v[0]], &b = mesh.vertices[v[1]], &c = mesh.vertices[v[2]];
    const Vec3 outward = (b - a).cross(c - a).normalized();
    const double face = outward.dot(a);
    std::erase_if(parts, [&](Index part) { return solid.extent(part, outward).low > face; });
  }
}

}  // namespace

ReachableTets::ReachableTets(const Domain& domain, const ScalarField& field, const Solid& solid, const RunContext& run)
    : first_tet_(domain.model_tets) {
  const std::size_t support = domain.mesh.tets.size() - domain.model_tets;
  number_.assign(support, kNone);
  chunks_.resize(chunk_count(support, kChunk));
  parallel_for(support, kChunk, run, [&](std::size_t begin, std::size_t end, std::size_t c) {
    const auto local = solid.local();
    Chunk& chunk = chunks_[c];
    std::vector<Index> parts;
    std::vector<std::size_t> first;
    for (std::size_t t = begin; t < end; ++t) {
      const Index tet = first_tet_ + static_cast<Index>(t);
      Neighbourhood ball = ball_around(domain.mesh, tet);
      find_parts(solid, domain.mesh, tet, ball, parts);
      ball.parts = parts;
      local->focus(ball.centre, ball.radius, ball);
      if (local->surely_outside(ball.centre, ball.radius)) continue;
      ball.up = print_direction(field, tet);
      number_[t] = static_cast<Index>(chunk.around.size());
      chunk.around.push_back(ball);
      first.push_back(chunk.parts.size());
      chunk.parts.insert(chunk.parts.end(), parts.begin(), parts.end());
      for (const Index part : parts) chunk.extents.push_back(solid.extent(part, ball.up));
    }
    for (std::size_t i = 0; i < first.size(); ++i) {
      Neighbourhood& ball = chunk.around[i];
      const std::size_t count = ball.parts.size();
      ball.parts = std::span(chunk.parts).subspan(first[i], count);
      ball.extents = std::span(chunk.extents).subspan(first[i], count);
    }
  });
}

}  // namespace curvesup
