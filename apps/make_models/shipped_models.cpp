#include "shipped_models.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>

#include "implicit_surface.h"

namespace make_models {

using curvesup::closest_point_on_segment;
using curvesup::Index;
using curvesup::TriangleMesh;
using curvesup::Vec3;

namespace {

// Minimum and maximum with a rounded transition of width k.
double smooth_min(double a, double b, double k) {
  const double h = std::max(k - std::abs(a - b), 0.0) / k;
  return std::min(a, b) - h * h * k / 4.0;
}
double smooth_max(double a, double b, double k) { return -smooth_min(-a, -b, k); }

double rounded_box(const Vec3& p, const Vec3& centre, const Vec3& half, double radius) {
  const Vec3 q = (p - centre).cwiseAbs() - half + Vec3::Constant(radius);
  return q.cwiseMax(0.0).norm() + std::min(q.maxCoeff(), 0.0) - radius;
}

double capsule(const Vec3& p, const Vec3& a, const Vec3& b, double radius) {
  return (p - closest_point_on_segment(p, a, b)).norm() - radius;
}

// A vault: everything within `radius` of the line x = x0 below height z0, along y.
double vault(const Vec3& p, double x0, double z0, double radius) {
  return std::hypot(p.x() - x0, std::max(p.z() - z0, 0.0)) - radius;
}

// ---- dome: a spherical shell, 52 mm wide, with a doorway down to its rim and a round opening beside the top.
double dome(const Vec3& p) {
  const Vec3 centre(0, 0, 4);
  const double shell = std::abs((p - centre).norm() - 24.0) - 2.0;
  const double above_rim = 4.0 - p.z();
  const double doorway = p.x() > 0.0 ? std::hypot(p.y(), std::max(p.z() - 10.0, 0.0)) - 7.5 : 1e3;
  const Vec3 axis = Vec3(-0.45, 0.2, 1.0).normalized();
  const Vec3 from_centre = p - centre;
  const double opening = from_centre.dot(axis) > 0.0 ? (from_centre - from_centre.dot(axis) * axis).norm() - 6.5 : 1e3;
  return smooth_max(smooth_max(smooth_max(shell, above_rim, 1.5), -doorway, 1.5), -opening, 1.5);
}

// Layers bulge upward like the dome itself, a little off its axis: tilt up to 44 degrees at the rim.
double dome_potential(const Vec3& p) {
  return p.z() + (std::pow(p.x() - 2.0, 2) + std::pow(p.y() + 1.5, 2)) / (2.0 * 30.0);
}

// ---- arches: a deck on four piers with three vaults between them and a round window above each inner pier.
double arches(const Vec3& p) {
  double f = rounded_box(p, Vec3(0, 0, 16), Vec3(33, 7, 12), 2.5);
  for (const double x : {-19.0, 0.0, 19.0}) f = smooth_max(f, -vault(p, x, 13.0, 6.8), 2.0);
  for (const double x : {-9.5, 9.5}) f = smooth_max(f, 2.3 - std::hypot(p.x() - x, p.z() - 21.5), 1.0);
  return f;
}

// Layers sag between the ends: tilt up to 41 degrees over the outer vaults.
double arches_potential(const Vec3& p) {
  return p.z() + 9.0 * std::cos(std::numbers::pi * p.x() / 33.0) + p.y() * p.y() / 80.0;
}

// ---- frame: a trunk that branches to a ring of four, which closes again to two points above.
double frame(const Vec3& p) {
  const std::array<Vec3, 8> node = {Vec3(0, 0, 7),      Vec3(1, 0, 16),    Vec3(15, 12, 29), Vec3(-15, 13, 31),
                                    Vec3(-14, -12, 29), Vec3(14, -13, 32), Vec3(9, 1, 46),   Vec3(-9, -1, 45)};
  constexpr std::array<std::array<int, 2>, 14> kBars = {
      {{0, 1}, {1, 2}, {1, 3}, {1, 4}, {1, 5}, {2, 3}, {3, 4}, {4, 5}, {5, 2}, {2, 6}, {5, 6}, {3, 7}, {4, 7}, {6, 7}}};
  double f = 1e3;
  for (const auto& [a, b] : kBars) f = smooth_min(f, capsule(p, node[a], node[b], a == 0 ? 3.6 : 2.6), 1.5);
  return f;
}

// Saddle-shaped layers: tilt up to 45 degrees at the ring.
double frame_potential(const Vec3& p) { return p.z() + (p.x() * p.x() - p.y() * p.y()) / (2.0 * 22.0); }

// ---- block: a slab on two legs that stand on the platform.
bool in_block(const Vec3& p) {
  return std::abs(p.x()) < 12.0 && std::abs(p.y()) < 4.5 && p.z() > 0.0 && p.z() < 15.0 &&
         (p.z() > 9.0 || std::abs(p.x()) > 6.0);
}

double block_potential(const Vec3& p) { return p.z() - p.x() * p.x() / (2.0 * 20.0) + p.y() * p.y() / (2.0 * 30.0); }

// The boundary of the cubes whose centre `keep` accepts, among cells low to high - 1 of the grid through the origin.
TriangleMesh voxel_surface(const std::function<bool(const Vec3&)>& keep, const std::array<int, 3>& low,
                           const std::array<int, 3>& high, double size) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, Index> id;
  const auto vertex = [&](const std::array<int, 3>& c) {
    const auto [slot, fresh] = id.emplace(c, static_cast<Index>(mesh.vertices.size()));
    if (fresh) mesh.vertices.push_back(size * Vec3(c[0], c[1], c[2]));
    return slot->second;
  };
  const auto kept = [&](const std::array<int, 3>& c) { return keep(size * Vec3(c[0] + 0.5, c[1] + 0.5, c[2] + 0.5)); };
  for (int k = low[2]; k < high[2]; ++k) {
    for (int j = low[1]; j < high[1]; ++j) {
      for (int i = low[0]; i < high[0]; ++i) {
        const std::array<int, 3> cell = {i, j, k};
        if (!kept(cell)) continue;
        for (int side = 0; side < 6; ++side) {
          const int axis = side / 2, up = side % 2, u = (axis + 1) % 3, v = (axis + 2) % 3;
          std::array<int, 3> other = cell;
          other[axis] += up ? 1 : -1;
          if (kept(other)) continue;
          std::array<int, 3> corner[4] = {cell, cell, cell, cell};
          for (auto& c : corner) c[axis] += up;
          ++corner[1][u], ++corner[2][u], ++corner[2][v], ++corner[3][v];
          std::array<Index, 4> q = {vertex(corner[0]), vertex(corner[1]), vertex(corner[2]), vertex(corner[3])};
          if (!up) std::swap(q[1], q[3]);
          mesh.triangles.push_back({q[0], q[1], q[2]});
          mesh.triangles.push_back({q[0], q[2], q[3]});
        }
      }
    }
  }
  return mesh;
}

}  // namespace

std::vector<ShippedModel> shipped_models() {
  return {
      {"dome", [] { return mesh_zero_set(dome, Vec3(-30, -30, 0), Vec3(30, 30, 34), 1.7); }, 1.5, dome_potential, 1},
      {"arches", [] { return mesh_zero_set(arches, Vec3(-37, -11, 0), Vec3(37, 11, 32), 1.8); }, 2.5, arches_potential,
       2},
      {"frame", [] { return mesh_zero_set(frame, Vec3(-23, -21, 0), Vec3(23, 21, 53), 1.6); }, 2.0, frame_potential, 7},
      {"block",
       [] {
         return voxel_surface(in_block, {-8, -3, 0}, {8, 3, 10}, 1.5);
       },
       1.5, block_potential, 0},
  };
}

}  // namespace make_models
