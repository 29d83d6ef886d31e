#pragma once

#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "curvesup/layers/layer_stack.h"

// Small named sheets for tests of the toolpath: one layer, with the gradient of G on each triangle.
namespace curvesup::sheets {

struct NamedSheet {
  LayerStack stack;
  std::vector<Vec3> gradient;
};

// The triangles of a sheet that has its vertices: one layer, the gradient along each triangle's normal.
inline void finish(NamedSheet& sheet, double thickness) {
  sheet.stack.count = 10;
  for (const auto& [a, b, c] : sheet.stack.triangles) {
    const auto& v = sheet.stack.vertices;
    const Vec3 normal = (v[b] - v[a]).cross(v[c] - v[a]);
    const double length = normal.norm();
    sheet.gradient.push_back((length > 0.0 ? Vec3(normal / length) : Vec3::UnitZ()) / (sheet.stack.count * thickness));
  }
  sheet.stack.triangle_tet.resize(sheet.stack.triangles.size());
  for (std::size_t t = 0; t < sheet.stack.triangles.size(); ++t) sheet.stack.triangle_tet[t] = static_cast<Index>(t);
  sheet.stack.sheets.push_back({.triangle_count = static_cast<Index>(sheet.stack.triangles.size())});
}

// As few triangles as plain parts have: between places in the plane z = 10, turned about the z axis.
inline NamedSheet coarse(const std::vector<Vec3>& places, const std::vector<std::array<Index, 3>>& triangles, double turn = 0.0) {
  NamedSheet sheet;
  const double c = std::cos(turn), s = std::sin(turn);
  for (const Vec3& p : places) sheet.stack.vertices.push_back({p.x() * c - p.y() * s, p.x() * s + p.y() * c, 10.0});
  sheet.stack.triangles = triangles;
  finish(sheet, 0.8);
  return sheet;
}

// A rectangle of two triangles, its corner at the origin.
inline NamedSheet plate(double length, double width, double turn = 0.0) {
  return coarse({{0, 0, 0}, {length, 0, 0}, {length, width, 0}, {0, width, 0}}, {{0, 1, 2}, {0, 2, 3}}, turn);
}

// Two arms of one width at a right angle, in four triangles.
inline NamedSheet angle_plate(double arm, double width, double turn = 0.0) {
  return coarse({{0, 0, 0}, {arm, 0, 0}, {arm, width, 0}, {width, width, 0}, {width, arm, 0}, {0, arm, 0}},
                {{0, 1, 3}, {1, 2, 3}, {0, 3, 5}, {3, 4, 5}}, turn);
}

// A grid of cells over [0, 1]^2 mapped to space by `place`; cells whose middle fails `keep` are left out. The layer is
// `thickness` thick; the gradient is along the triangle's normal.
inline NamedSheet mapped_grid(int nu, int nv, const std::function<Vec3(double, double)>& place, double thickness = 0.8,
                              bool wrap_u = false, const std::function<bool(double, double)>& keep = {}) {
  NamedSheet sheet;
  std::vector<Index> id((nu + 1) * (nv + 1), kNone);
  const auto vertex = [&](int i, int j) {
    if (wrap_u) i %= nu;
    Index& slot = id[j * (nu + 1) + i];
    if (slot == kNone) {
      slot = static_cast<Index>(sheet.stack.vertices.size());
      sheet.stack.vertices.push_back(place(static_cast<double>(i) / nu, static_cast<double>(j) / nv));
    }
    return slot;
  };
  for (int j = 0; j < nv; ++j) {
    for (int i = 0; i < nu; ++i) {
      if (keep && !keep((i + 0.5) / nu, (j + 0.5) / nv)) continue;
      const Index a = vertex(i, j), b = vertex(i + 1, j), c = vertex(i + 1, j + 1), d = vertex(i, j + 1);
      if ((i + j) % 2 == 0) {
        sheet.stack.triangles.push_back({a, b, c});
        sheet.stack.triangles.push_back({a, c, d});
      } else {
        sheet.stack.triangles.push_back({a, b, d});
        sheet.stack.triangles.push_back({b, c, d});
      }
    }
  }
  finish(sheet, thickness);
  return sheet;
}

// length x width, its corner at the origin, at z = 10.
inline NamedSheet strip(double length, double width, int nu, int nv) {
  return mapped_grid(nu, nv, [=](double u, double v) { return Vec3(u * length, v * width, 10.0); });
}

// A strip along x whose width swings between `narrow` and `wide` three times.
inline NamedSheet waisted_strip(double length, double narrow, double wide) {
  return mapped_grid(static_cast<int>(length / 0.4), 6, [=](double u, double v) {
    const double s = std::sin(3.0 * std::numbers::pi * u);
    return Vec3(u * length, (v - 0.5) * (narrow + (wide - narrow) * s * s), 10.0);
  });
}

// Between two circles about the z axis, at z = 10.
inline NamedSheet annulus(double inner, double outer, int around, int across) {
  return mapped_grid(
      around, across,
      [=](double u, double v) {
        const double r = outer + v * (inner - outer), a = 2.0 * std::numbers::pi * u;
        return Vec3(r * std::cos(a), r * std::sin(a), 10.0);
      },
      0.8, true);
}

// `angle` radians of a cylinder about the y axis.
inline NamedSheet cylinder(double radius, double angle, double length, int around, int along) {
  return mapped_grid(around, along, [=](double u, double v) {
    const double a = (u - 0.5) * angle;
    return Vec3(radius * std::sin(a), v * length, 10.0 + radius * std::cos(a));
  });
}

// The part of a sphere within `polar` radians of its top; the last row has no length: degenerate triangles.
inline NamedSheet sphere_cap(double radius, double polar, int around, int across) {
  return mapped_grid(
      around, across,
      [=](double u, double v) {
        const double p = polar * (1.0 - v), a = 2.0 * std::numbers::pi * u;
        return Vec3(radius * std::sin(p) * std::cos(a), radius * std::sin(p) * std::sin(a), 10.0 + radius * std::cos(p));
      },
      0.8, true);
}

}  // namespace curvesup::sheets
