#include "curvesup/check/toolpath_certificate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <numbers>
#include <set>

#include "helpers/layer_stacks.h"

namespace curvesup {
namespace {

constexpr double kWidth = 0.8, kThickness = 0.8, kSide = 8.0;

using Names = std::set<std::string>;

Names failed(const ToolpathCertificate& certificate) {
  Names names;
  for (const Check& check : certificate.checks) {
    if (!check.ok) names.insert(check.name.substr(std::string("certificate.toolpath_").size()));
  }
  return names;
}

// Square plates [0,8]^2 in layers 0.8 mm thick, each filled with perfect square rings: at (i + 1/2) w from the border.
struct Scene {
  Domain domain;
  ScalarField field;
  LayerStack printed;
  Toolpaths toolpaths;

  explicit Scene(int layers = 2, double lowest = 0.4) {
    printed.count = 10;
    field.gradient = {Vec3::UnitZ() / (printed.count * kThickness)};
    for (int k = 0; k < layers; ++k) {
      Sheet sheet{.layer = k, .first_triangle = static_cast<Index>(printed.triangles.size())};
      printed.sheets.push_back(sheet);
      add_plate(Vec3(0, 0, lowest + k * kThickness), kSide);
      for (int i = 0; i < 5; ++i) add_ring(k, lowest + k * kThickness, (i + 0.5) * kWidth);
    }
  }

  // A square of quads of half a millimetre, in the last sheet.
  void add_plate(const Vec3& corner, double side) {
    const Index quads = static_cast<Index>(2 * side + 0.5), first = static_cast<Index>(printed.vertices.size());
    for (Index y = 0; y <= quads; ++y) {
      for (Index x = 0; x <= quads; ++x) printed.vertices.push_back(corner + Vec3(0.5 * x, 0.5 * y, 0));
    }
    for (Index y = 0; y < quads; ++y) {
      for (Index x = 0; x < quads; ++x) {
        const Index a = first + y * (quads + 1) + x, b = a + 1, c = a + quads + 1, d = c + 1;
        printed.triangles.push_back({a, b, d});
        printed.triangles.push_back({a, d, c});
        printed.triangle_tet.insert(printed.triangle_tet.end(), 2, 0);
        printed.sheets.back().triangle_count += 2;
      }
    }
  }

  void add_ring(Index layer, double z, double inset) {
    const double side = kSide - 2 * inset;
    const Vec3 corners[] = {{inset, inset, z}, {inset + side, inset, z}, {inset + side, inset + side, z},
                            {inset, inset + side, z}};
    Path path{.layer = layer, .closed = true, .first_point = static_cast<Index>(toolpaths.points.size()),
              .group = layer};
    toolpaths.points.push_back({.position = corners[0]});
    const int steps = std::max(1, static_cast<int>(side / 0.7));
    for (int c = 0; c < 4; ++c) {
      for (int s = 1; s <= steps; ++s)
        toolpaths.points.push_back({.position = corners[c] + s * (corners[(c + 1) % 4] - corners[c]) / steps});
    }
    path.point_count = static_cast<Index>(toolpaths.points.size()) - path.first_point;
    toolpaths.paths.push_back(path);
    lay_beads(path, kThickness, kWidth);
  }

  void lay_beads(const Path& path, double height, double width) {
    for (Index k = path.first_point; k < path.first_point + path.point_count; ++k) {
      PathPoint& p = toolpaths.points[k];
      p.height_mm = height;
      p.width_mm = width;
      p.tip_offset_mm = 0.5 * kThickness;
      p.volume_mm3 =
          k == path.first_point ? 0.0 : height * width * (p.position - toolpaths.points[k - 1].position).norm();
    }
  }

  void for_points_of(Index path, const auto& change) {
    const Path& p = toolpaths.paths[path];
    for (Index k = p.first_point; k < p.first_point + p.point_count; ++k) change(toolpaths.points[k]);
  }

  // Takes the triangles whose centre has x in [low, high] out of all sheets.
  void cut_slot(double low, double high) {
    printed = shapes::without_triangles(printed, [&](const Sheet&, const Vec3& centroid) { return centroid.x() > low && centroid.x() < high; });
  }

  [[nodiscard]] ToolpathCertificate certify(int threads = 1) const {
    RunContext run;
    run.threads = threads;
    return certify_toolpaths(domain, field, printed, toolpaths, {.bead_width_mm = kWidth}, run);
  }
};

TEST(ToolpathCertificate, PerfectRingsPass) {
  const Scene scene;
  const ToolpathCertificate c = scene.certify();
  EXPECT_EQ(failed(c), Names{});
  EXPECT_EQ(c.checks.size(), 12u);
  EXPECT_NEAR(c.area_mm2, 2 * kSide * kSide, 1e-9);
  EXPECT_NEAR(c.samples, 4 * c.area_mm2, 2);
  EXPECT_GT(c.covered_fraction, 0.985);
  EXPECT_LT(c.covered_fraction, 1.0);  // the corners
  EXPECT_NEAR(c.overlap, 1 / c.covered_fraction - 1, 1e-9);  // square rings tile the plate exactly
  EXPECT_NEAR(c.spacing_median_mm, kWidth, 1e-6);
  EXPECT_NEAR(c.bead_volume_mm3[0], 2 * kSide * kSide * kThickness, 1e-9);
  EXPECT_NEAR(c.layer_volume_mm3[0], 2 * kSide * kSide * kThickness, 1e-9);
  EXPECT_EQ(c.pieces, 2);
  EXPECT_LT(c.max_point_distance_mm, 1e-9);
}

TEST(ToolpathCertificate, TurnedSheetsPassToo) {
  Scene scene;
  const Mat3 turn = Eigen::AngleAxisd(std::numbers::pi / 5, Vec3(1, 2, 0).normalized()).toRotationMatrix();
  const auto move = [&](const Vec3& p) { return Vec3(turn * p + Vec3(0, 0, 20)); };
  for (Vec3& v : scene.printed.vertices) v = move(v);
  for (Vec3& g : scene.field.gradient) g = turn * g;
  for (PathPoint& p : scene.toolpaths.points) {
    p.position = move(p.position);
    p.normal = turn * p.normal;
  }
  for (const Path& path : scene.toolpaths.paths) scene.lay_beads(path, kThickness, kWidth);
  const ToolpathCertificate c = scene.certify();
  EXPECT_EQ(failed(c), Names{});
  EXPECT_NEAR(c.spacing_median_mm, kWidth, 1e-6);
}

TEST(ToolpathCertificate, LayersBelowTheModelCountFromBelowZero) {
  Scene scene(3);
  for (Sheet& sheet : scene.printed.sheets) sheet.layer -= 12;
  for (Path& path : scene.toolpaths.paths) path.layer -= 12;
  EXPECT_EQ(failed(scene.certify()), Names{});
  scene.toolpaths.paths.erase(scene.toolpaths.paths.begin() + 6);
  EXPECT_EQ(scene.certify().worst_layer.layer, -11);
}

TEST(ToolpathCertificate, SeesAMissingRing) {
  Scene scene;
  scene.toolpaths.paths.erase(scene.toolpaths.paths.begin() + 1);
  const ToolpathCertificate c = scene.certify();
  EXPECT_EQ(failed(c), (Names{"coverage", "model_volume", "layer_volume"}));
  EXPECT_FALSE(c.uncovered.empty());
  EXPECT_EQ(c.worst_layer.layer, 0);
}

TEST(ToolpathCertificate, SeesARingLaidTwice) {
  Scene scene;
  scene.toolpaths.paths.insert(scene.toolpaths.paths.begin(), scene.toolpaths.paths.front());
  const Names names = failed(scene.certify());
  EXPECT_TRUE(names.contains("overlap"));
  EXPECT_TRUE(names.contains("layer_volume"));
}

TEST(ToolpathCertificate, SeesRingsTooFarApart) {
  Scene scene(0);
  scene.printed.sheets.push_back({});
  scene.add_plate(Vec3(0, 0, 0.4), kSide);
  for (int i = 0; i < 5; ++i) scene.add_ring(0, 0.4, (1.06 * i + 0.4) * kWidth);
  EXPECT_TRUE(failed(scene.certify()).contains("spacing_median"));
  EXPECT_FALSE(failed(scene.certify()).contains("spacing_spread"));
}

TEST(ToolpathCertificate, SeesUnevenRings) {
  Scene scene(0);
  scene.printed.sheets.push_back({});
  scene.add_plate(Vec3(0, 0, 0.4), kSide);
  for (int i = 0; i < 5; ++i) scene.add_ring(0, 0.4, (i + 0.5 + (i == 2 ? 0.25 : 0.0)) * kWidth);
  EXPECT_TRUE(failed(scene.certify()).contains("spacing_spread"));
}

TEST(ToolpathCertificate, ASingleRingAroundLinesHasNoNeighbour) {
  // What lies beside it is the ring of the piece's other side.
  Scene scene(0);
  scene.printed.sheets.push_back({});
  scene.add_plate(Vec3(0, 0, 0.4), kSide);
  for (const double inset : {0.4, 1.4, 2.4}) scene.add_ring(0, 0.4, inset);
  const auto spacings = [&](int perimeters) {
    return certify_toolpaths(scene.domain, scene.field, scene.printed, scene.toolpaths,
                             {.bead_width_mm = kWidth, .perimeters = {perimeters, 2}})
        .spacing_samples;
  };
  EXPECT_GT(spacings(0), 0);
  EXPECT_GT(spacings(2), 0);
  EXPECT_EQ(spacings(1), 0);
}

TEST(ToolpathCertificate, SeesARingOffItsLayer) {
  Scene scene;
  scene.for_points_of(1, [](PathPoint& p) { p.position.z() += 0.06; });
  const ToolpathCertificate c = scene.certify();
  EXPECT_EQ(failed(c), (Names{"points_on_layer", "segments_on_layer"}));
  EXPECT_NEAR(c.max_point_distance_mm, 0.06, 1e-9);
  EXPECT_EQ(c.segments_off_layer, scene.toolpaths.paths[1].point_count - 1);
  EXPECT_EQ(c.leaving.front().layer, 0);
}

TEST(ToolpathCertificate, SeesAPathOfNoLayer) {
  Scene scene;
  scene.toolpaths.paths.back().passes = 2;
  const Names names = failed(scene.certify());
  EXPECT_TRUE(names.contains("points_on_layer"));
  EXPECT_TRUE(names.contains("segments_on_layer"));
}

TEST(ToolpathCertificate, SeesAPointNowhere) {
  Scene scene;
  scene.toolpaths.points[3].position.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(failed(scene.certify()).contains("points_on_layer"));
}

TEST(ToolpathCertificate, SeesASegmentAcrossAGap) {
  Scene scene;
  scene.cut_slot(4.0, 4.5);
  const ToolpathCertificate c = scene.certify();
  EXPECT_TRUE(failed(c).contains("segments_on_layer"));
  // Each ring but the innermost crosses the slot twice a layer, in one or two segments; the innermost runs along it.
  EXPECT_GE(c.segments_off_layer, 2 * 2 * 4);
}

TEST(ToolpathCertificate, SeesAWrongVolume) {
  Scene scene;
  scene.toolpaths.points[4].volume_mm3 *= 1 + 1e-6;
  const ToolpathCertificate c = scene.certify();
  EXPECT_EQ(failed(c), (Names{"segment_volume"}));
  EXPECT_EQ(c.wrong_volumes, 1);
}

TEST(ToolpathCertificate, SeesAVolumeThatIsNoNumber) {
  Scene scene;
  scene.toolpaths.points[4].volume_mm3 = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(failed(scene.certify()).contains("segment_volume"));
}

TEST(ToolpathCertificate, SeesVolumeOnTheFirstPoint) {
  Scene scene;
  scene.toolpaths.points[0].volume_mm3 = 0.1;
  EXPECT_EQ(failed(scene.certify()), (Names{"segment_volume"}));
}

TEST(ToolpathCertificate, SeesAWrongHeight) {
  Scene scene;
  scene.lay_beads(scene.toolpaths.paths[9], 1.03 * kThickness, kWidth);
  const ToolpathCertificate c = scene.certify();
  EXPECT_EQ(failed(c), (Names{"height"}));
  EXPECT_NEAR(c.max_height_error, 0.03, 1e-9);
  EXPECT_EQ(c.worst_height.layer, 1);
}

// A short segment is as high as the layer where it begins, though its middle lies where the layer is thinner.
TEST(ToolpathCertificate, AShortSegmentMayBeAsHighAsAnyTriangleThatItTouches) {
  for (const double factor : {1.0, 1.03}) {
    Scene scene(2, 5.2);
    const double thick = 1.1 * kThickness;
    scene.field.gradient.push_back(Vec3::UnitZ() / (scene.printed.count * thick));
    for (std::size_t t = 0; t < scene.printed.triangles.size(); ++t) {
      double x = 0.0;
      for (const Index v : scene.printed.triangles[t]) x += scene.printed.vertices[v].x() / 3.0;
      scene.printed.triangle_tet[t] = x < 3.5;
    }
    auto& points = scene.toolpaths.points;
    points[4].position.x() = 3.45;  // of the first ring, on its first side
    points[5].position.x() = 3.70;
    for (std::size_t k = 1; k < points.size(); ++k) {
      const Vec3 &from = points[k - 1].position, &to = points[k].position;
      points[k].height_mm = 0.5 * (from.x() + to.x()) < 3.5 ? thick : kThickness;
      if (k == 5) points[k].height_mm = factor * thick;
      if (points[k].volume_mm3 > 0.0) points[k].volume_mm3 = points[k].height_mm * points[k].width_mm * (to - from).norm();
    }
    EXPECT_EQ(failed(scene.certify()).contains("height"), factor != 1.0);
  }
}

TEST(ToolpathCertificate, SeesBeadsTooThinAllOver) {
  Scene scene;
  for (const Path& path : scene.toolpaths.paths) scene.lay_beads(path, kThickness, 0.98 * kWidth);
  EXPECT_EQ(failed(scene.certify()), (Names{"model_volume"}));
}

TEST(ToolpathCertificate, MeasuresHeightToThePlatform) {
  Scene scene(1, 0.1);  // the tip runs 0.5 mm above the platform
  EXPECT_TRUE(failed(scene.certify()).contains("height"));
  for (const Path& path : scene.toolpaths.paths) scene.lay_beads(path, 0.5, kWidth);
  const ToolpathCertificate c = scene.certify();
  EXPECT_EQ(failed(c), Names{});
  EXPECT_NEAR(c.layer_volume_mm3[0], 0.5 * kSide * kSide, 1e-9);
}

// One large triangle that rises from below the platform: its layer is as thick as it is high there, and nothing below.
TEST(ToolpathCertificate, MeasuresWhatEndsAtThePlatform) {
  Scene scene(0);
  scene.printed.sheets.push_back({.triangle_count = 1});
  scene.printed.vertices = {{0, 0, -2}, {10, 0, 2}, {0, 10, -2}};
  scene.printed.triangles = {{0, 1, 2}};
  scene.printed.triangle_tet = {0};
  // By z the area grows as the square of the way from the rim at z = 2, of 4: over reach r = z + 0.4 from 0 to 0.8 to 2.4.
  const double area = 0.5 * 10 * std::hypot(10, 4), step = 1e-4;
  double volume = 0.0;
  for (double reach = 0.5 * step; reach < 2.4; reach += step) {
    volume += std::min(reach, 0.8) * 2.0 * area * (2.4 - reach) / 16.0 * step;
  }
  EXPECT_NEAR(scene.certify().layer_volume_mm3[0], volume, 2e-3 * volume);
}

// 10 by 1.2 mm and one line in its middle: all of it lies inside of a bead 1.2 mm wide, but a thinner one leaves its sides open.
TEST(ToolpathCertificate, ABeadCoversWhatItIsWideAs) {
  for (const double width : {1.2, 0.8}) {
    Scene scene(0);
    scene.printed.sheets.push_back({.triangle_count = 2});
    scene.printed.vertices = {{0, 0, 2}, {10, 0, 2}, {10, 1.2, 2}, {0, 1.2, 2}};
    scene.printed.triangles = {{0, 1, 2}, {0, 2, 3}};
    scene.printed.triangle_tet = {0, 0};
    scene.toolpaths.points = {{.position = {0, 0.6, 2}}, {.position = {10, 0.6, 2}}};
    scene.toolpaths.paths = {{.kind = PathKind::centre_line, .point_count = 2}};
    scene.lay_beads(scene.toolpaths.paths[0], kThickness, width);
    EXPECT_NEAR(scene.certify().covered_fraction, std::max(1.1 * kWidth, width) / 1.2, 0.03);
    EXPECT_EQ(failed(scene.certify()).contains("coverage"), width < 1.0);
  }
}

// Rings beside each other that are a little wider than usual are as much farther apart.
TEST(ToolpathCertificate, SpacingGoesByTheBeads) {
  for (const double spacing : {1.06, 0.95}) {
    Scene scene(0);
    scene.printed.sheets.push_back({});
    scene.add_plate(Vec3(0, 0, 0.4), kSide);
    for (int i = 0; i < 5; ++i) scene.add_ring(0, 0.4, spacing * (i + 0.4) * kWidth);
    EXPECT_TRUE(failed(scene.certify()).contains("spacing_median")) << spacing;
    for (const Path& path : scene.toolpaths.paths) scene.lay_beads(path, kThickness, spacing * kWidth);
    EXPECT_FALSE(failed(scene.certify()).contains("spacing_median")) << spacing;
  }
}

TEST(ToolpathCertificate, SeesAPieceWithoutAPath) {
  Scene scene;
  scene.add_plate(Vec3(20, 0, 1.2), 1.0);
  const ToolpathCertificate c = scene.certify();
  EXPECT_EQ(failed(c), (Names{"pieces"}));
  ASSERT_EQ(c.pieces_without_path.size(), 1u);
  EXPECT_NEAR(c.pieces_without_path[0].value, 1.0, 1e-9);
  EXPECT_EQ(c.pieces_without_path[0].layer, 1);
}

TEST(ToolpathCertificate, SmallPiecesNeedNoFittedBead) {
  Scene scene;
  const double before = scene.certify().max_layer_volume_error;
  scene.add_plate(Vec3(20, 0, 1.2), 0.5);  // 0.25 mm2, below w^2 / 2
  const ToolpathCertificate c = scene.certify();
  EXPECT_EQ(failed(c), Names{});
  EXPECT_EQ(c.pieces, 2);
  EXPECT_NEAR(c.max_layer_volume_error, before, 1e-9);
}

TEST(ToolpathCertificate, SeesLayersOutOfOrder) {
  Scene scene;
  std::rotate(scene.toolpaths.paths.begin(), scene.toolpaths.paths.begin() + 5, scene.toolpaths.paths.end());
  EXPECT_EQ(failed(scene.certify()), (Names{"order"}));
}

TEST(ToolpathCertificate, SeesTwoChangesOfMaterialInALayer) {
  Scene scene;
  // The second layer's plate once more as support, beside the model.
  scene.printed.sheets.push_back({.layer = 1,
                                  .material = Material::support,
                                  .first_triangle = static_cast<Index>(scene.printed.triangles.size())});
  scene.add_plate(Vec3(0, 0, 1.2), kSide);
  const std::size_t before = scene.toolpaths.paths.size();
  for (int i = 0; i < 5; ++i) scene.add_ring(1, 1.2, (i + 0.5) * kWidth);
  for (std::size_t i = before; i < scene.toolpaths.paths.size(); ++i) {
    scene.toolpaths.paths[i].material = Material::support;
  }
  EXPECT_EQ(failed(scene.certify()), Names{});
  std::swap(scene.toolpaths.paths[before + 2], scene.toolpaths.paths[before - 2]);
  EXPECT_EQ(failed(scene.certify()), (Names{"order"}));
}

TEST(ToolpathCertificate, SparseMaterialIsNotMeasuredForArea) {
  Scene scene;
  scene.toolpaths.paths.erase(scene.toolpaths.paths.begin() + 1);
  const ToolpathCertificate c = certify_toolpaths(scene.domain, scene.field, scene.printed, scene.toolpaths,
                                                  {.bead_width_mm = kWidth, .dense = {false, true}});
  EXPECT_EQ(failed(c), Names{});
  EXPECT_EQ(c.samples, 0);
}

// A plate of support with two rings and lines 2.4 mm apart in them.
struct SparseScene : Scene {
  explicit SparseScene() : Scene(0) {
    printed.sheets.push_back({.layer = 0, .material = Material::support});
    add_plate(Vec3(0, 0, 0.4), kLong);
    for (int i = 0; i < 2; ++i) add_square((i + 0.5) * kWidth);
    for (double x = 1.8 + 1.2; x < kLong - 1.8; x += kSpacing) add_line(Vec3(x, 1.8, 0.4), Vec3(x, kLong - 1.8, 0.4));
  }
  static constexpr double kLong = 24.0, kSpacing = 2.4;

  void add_square(double inset) {
    const double far = kLong - inset;
    const std::vector<Vec3> corners{{inset, inset, 0.4}, {far, inset, 0.4}, {far, far, 0.4}, {inset, far, 0.4}, {inset, inset, 0.4}};
    add(corners, PathKind::contour);
  }
  void add_line(const Vec3& from, const Vec3& to) { add({from, to}, PathKind::infill); }
  void add(const std::vector<Vec3>& places, PathKind kind) {
    Path path{.layer = 0, .material = Material::support, .kind = kind, .first_point = static_cast<Index>(toolpaths.points.size())};
    path.point_count = static_cast<Index>(places.size());
    for (const Vec3& p : places) toolpaths.points.push_back({.position = p});
    toolpaths.paths.push_back(path);
    lay_beads(path, kThickness, kWidth);
  }
  void add_model_above() {
    printed.sheets.push_back({.layer = 1, .first_triangle = static_cast<Index>(printed.triangles.size())});
    add_plate(Vec3(4, 4, 1.2), 12.0);
    for (int i = 0; i < 15; ++i) {
      Path path{.layer = 1, .first_point = static_cast<Index>(toolpaths.points.size()), .point_count = 2, .group = 1};
      for (const double x : {4.0, 16.0}) toolpaths.points.push_back({.position = Vec3(x, 4.4 + 0.8 * i, 1.2)});
      toolpaths.paths.push_back(path);
      lay_beads(path, kThickness, kWidth);
    }
  }
  [[nodiscard]] ToolpathCertificate certify_sparse() const {
    ToolpathCertificateOptions options{.bead_width_mm = kWidth, .dense = {true, false}};
    options.line_spacing_mm[1] = kSpacing;
    options.perimeters[1] = 2;
    return certify_toolpaths(domain, field, printed, toolpaths, options);
  }
};

TEST(ToolpathCertificate, RoomBetweenSparseLinesIsNoGap) {
  const ToolpathCertificate c = SparseScene().certify_sparse();
  EXPECT_EQ(failed(c), Names{});
  EXPECT_EQ(c.checks.size(), 12u);  // sparse coverage instead of the volume
  EXPECT_GT(c.sparse_samples, 2000);
  EXPECT_GT(c.sparse_covered_fraction, 0.99);
}

TEST(ToolpathCertificate, SeesAMissingSparseLine) {
  SparseScene scene;
  scene.toolpaths.paths.erase(scene.toolpaths.paths.begin() + 5);
  const ToolpathCertificate c = scene.certify_sparse();
  EXPECT_EQ(failed(c), (Names{"sparse_coverage"}));
  EXPECT_FALSE(c.uncovered.empty());
}

TEST(ToolpathCertificate, SeesAMissingRingAroundSparseLines) {
  SparseScene scene;
  scene.toolpaths.paths.erase(scene.toolpaths.paths.begin());
  EXPECT_EQ(failed(scene.certify_sparse()), (Names{"sparse_coverage"}));
}

TEST(ToolpathCertificate, SeesSparseLinesRightUnderTheModel) {
  SparseScene scene;
  scene.add_model_above();
  const ToolpathCertificate c = scene.certify_sparse();
  EXPECT_EQ(failed(c), (Names{"sparse_coverage"}));
  for (const auto& place : c.uncovered) EXPECT_GT(place.position.x(), 3.5);
  // ... and that they are full there.
  for (double x = 1.8 + 1.2; x < 24.0 - 1.8; x += 0.8) scene.add_line(Vec3(x, 1.8, 0.4), Vec3(x, 24.0 - 1.8, 0.4));
  EXPECT_GT(scene.certify_sparse().sparse_covered_fraction, 0.98);
}

TEST(ToolpathCertificate, SeesBeadsOfTheSupportTooThin) {
  Scene scene;
  for (Sheet& sheet : scene.printed.sheets) sheet.material = Material::support;
  for (Path& path : scene.toolpaths.paths) path.material = Material::support;
  EXPECT_EQ(failed(scene.certify()), Names{});
  for (const Path& path : scene.toolpaths.paths) scene.lay_beads(path, kThickness, 0.98 * kWidth);
  EXPECT_EQ(failed(scene.certify()), (Names{"support_volume"}));
}

TEST(ToolpathCertificate, EmptyInputHoldsTrivially) {
  EXPECT_EQ(failed(certify_toolpaths({}, {}, {}, {})), Names{});
}

TEST(ToolpathCertificate, SameForAnyNumberOfThreads) {
  Scene scene(7);
  scene.for_points_of(12, [](PathPoint& p) { p.position.z() += 0.06; });
  const ToolpathCertificate one = scene.certify(1), three = scene.certify(3);
  ASSERT_EQ(one.checks.size(), three.checks.size());
  for (std::size_t i = 0; i < one.checks.size(); ++i) {
    EXPECT_EQ(one.checks[i].value, three.checks[i].value);
    EXPECT_EQ(one.checks[i].detail, three.checks[i].detail);
  }
}

}  // namespace
}  // namespace curvesup
