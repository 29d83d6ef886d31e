#pragma once

#include <array>
#include <functional>
#include <string>

#include "curvesup/mesh/tet_mesh.h"
#include "curvesup/model/model.h"

// Small named shapes for tests.
namespace curvesup::shapes {

// The box [low, high] as cells[0] x cells[1] x cells[2] bricks of six positively oriented tets each (Kuhn's division),
// keeping only bricks for which keep(centre) holds. Vertices that no brick uses are dropped.
inline TetMesh brick_mesh(const Vec3& low, const Vec3& high, std::array<int, 3> cells,
                          const std::function<bool(const Vec3&)>& keep = {}) {
  TetMesh mesh;
  const auto [nx, ny, nz] = cells;
  const Vec3 step = (high - low).cwiseQuotient(Vec3(nx, ny, nz));
  std::vector<Index> id((nx + 1) * (ny + 1) * (nz + 1), kNone);
  const auto vertex = [&](int i, int j, int k) {
    Index& slot = id[(k * (ny + 1) + j) * (nx + 1) + i];
    if (slot == kNone) {
      slot = static_cast<Index>(mesh.vertices.size());
      mesh.vertices.push_back(low + step.cwiseProduct(Vec3(i, j, k)));
    }
    return slot;
  };
  constexpr int kOrder[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j) {
      for (int i = 0; i < nx; ++i) {
        if (keep && !keep(low + step.cwiseProduct(Vec3(i + 0.5, j + 0.5, k + 0.5)))) continue;
        for (const auto& order : kOrder) {
          int at[3] = {i, j, k};
          std::array<Index, 4> tet{};
          tet[0] = vertex(at[0], at[1], at[2]);
          for (int s = 0; s < 3; ++s) {
            ++at[order[s]];
            tet[s + 1] = vertex(at[0], at[1], at[2]);
          }
          mesh.tets.push_back(tet);
          if (tet_volume(mesh, static_cast<Index>(mesh.tets.size()) - 1) < 0.0) std::swap(mesh.tets.back()[2], mesh.tets.back()[3]);
        }
      }
    }
  }
  return mesh;
}

inline Model as_model(TetMesh mesh) {
  Model model;
  model.name = "shape";
  model.topology = build_topology(mesh);
  model.boundary = boundary_faces(mesh, model.topology);
  model.mesh = std::move(mesh);
  return model;
}

// The surface of the box [low, high], each side in cells^2 squares of two triangles; no unused vertices.
inline TriangleMesh box_surface(const Vec3& low, const Vec3& high, int cells = 1) {
  const Model box = as_model(brick_mesh(low, high, {cells, cells, cells}));
  TriangleMesh surface;
  std::vector<Index> id(box.mesh.vertices.size(), kNone);
  for (const BoundaryFace& face : box.boundary) {
    auto& triangle = surface.triangles.emplace_back();
    for (int c = 0; c < 3; ++c) {
      Index& slot = id[face.vertices[c]];
      if (slot == kNone) {
        slot = static_cast<Index>(surface.vertices.size());
        surface.vertices.push_back(box.mesh.vertices[face.vertices[c]]);
      }
      triangle[c] = slot;
    }
  }
  return surface;
}

// Text STL with six decimals.
inline std::string stl_text(const TriangleMesh& surface) {
  std::string text = "solid shape\n";
  for (const auto& triangle : surface.triangles) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (const Index v : triangle) {
      const Vec3& p = surface.vertices[v];
      text += "vertex " + std::to_string(p.x()) + " " + std::to_string(p.y()) + " " + std::to_string(p.z()) + "\n";
    }
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid shape\n";
}

// A slab [0,30] x [0,10] x [12,18] on two legs that end at z = 0: the smallest shape with a true overhang.
inline Model block_on_legs(double cell = 2.0) {
  const auto n = [&](double length) { return static_cast<int>(length / cell + 0.5); };
  return as_model(brick_mesh(Vec3(0, 0, 0), Vec3(30, 10, 18), {n(30), n(10), n(18)},
                             [](const Vec3& c) { return c.z() > 12 || c.x() < 6 || c.x() > 24; }));
}

// The same slab without legs, floating 12 mm above the platform.
inline Model floating_slab(double cell = 2.0) {
  const auto n = [&](double length) { return static_cast<int>(length / cell + 0.5); };
  return as_model(brick_mesh(Vec3(0, 0, 12), Vec3(30, 10, 18), {n(30), n(10), n(6)}));
}

}  // namespace curvesup::shapes
