#include <algorithm>
#include <cmath>
#include <limits>

#include "check/sheet_pieces.h"
#include "check/toolpath_certificate_parts.h"
#include "curvesup/mesh/triangle_mesh.h"

namespace curvesup::certificate {

namespace {

constexpr double kCellsPerElement = 16.0, kFewestCells = 1000.0;
constexpr double kTouch = 0.01;          // mm; a triangle that near is one that the bead runs on
constexpr double kRingWidth = 0.1;       // a part of a contour is a ring while its bead is w wide but for this part
constexpr double kSegmentStep = 0.3;     // mm between the points where a segment is looked at
constexpr int kClosestLooks = 32;  // at a segment whose height does not fit what few looks find
constexpr double kSparseReach = 0.6;     // spacings, from any place to a line
constexpr double kUnderModel = 0.4;      // of a layer's thickness, between a place and the model's layer that it lies under
constexpr double kSpacingReach = 1.75;   // beads
constexpr double kParallelCosine = 0.9;  // about 25 degrees

// Elements by the cells that their boxes meet, as one flat table. Sheets lie rather than stand: cells are four times as
// high as wide, so that fewer of them are empty.
class ElementGrid {
 public:
  // box_of(i) gives the pair (low, high) of element i.
  ElementGrid(Index count, double cell_mm, const auto& box_of) {
    Vec3 low = Vec3::Constant(std::numeric_limits<double>::max()), high = -low;
    for (Index i = 0; i < count; ++i) {
      const auto [a, b] = box_of(i);
      low = low.cwiseMin(a);
      high = high.cwiseMax(b);
    }
    if (count == 0) low = high = Vec3::Zero();
    grid_ = CellGrid(flat(low), flat(high), cell_mm, std::max(kFewestCells, kCellsPerElement * count));
    first_.assign(grid_.cells() + 1, 0);
    const auto for_each_entry = [&](const auto& use) {
      for (Index i = 0; i < count; ++i) {
        const auto [a, b] = box_of(i);
        grid_.visit(flat(a), flat(b), [&](std::size_t cell) {
          use(cell, i);
          return false;
        });
      }
    };
    for_each_entry([&](std::size_t cell, Index) { ++first_[cell + 1]; });
    for (std::size_t c = 0; c < grid_.cells(); ++c) first_[c + 1] += first_[c];
    entries_.resize(first_.back());
    for_each_entry([&](std::size_t cell, Index i) { entries_[first_[cell]++] = i; });
    // Filling moved each start to its end; the starts are the ends of the cells before.
    for (std::size_t c = grid_.cells(); c > 0; --c) first_[c] = first_[c - 1];
    first_[0] = 0;
  }

  // Calls use(i) for the elements near the cube of half side `reach` around p, some of them twice, until it is true.
  bool visit(const Vec3& p, double reach, const auto& use) const {
    return grid_.visit(flat(p.array() - reach), flat(p.array() + reach), [&](std::size_t cell) {
      for (Index e = first_[cell]; e < first_[cell + 1]; ++e) {
        if (use(entries_[e])) return true;
      }
      return false;
    });
  }

 private:
  static Vec3 flat(const Vec3& p) { return {p.x(), p.y(), 0.25 * p.z()}; }

  CellGrid grid_;
  std::vector<Index> first_, entries_;
};

struct Facet {
  Vec3 normal;                 // unit
  std::array<Vec3, 3> inward;  // unit, in the plane, at right angles to the sides from a, b and c; 0 at a side of no length
  Vec3 a, b, c;
  double rise;  // z of the print direction
  double thickness;
  Index piece;
  std::array<Index, 3> beyond;  // the facets beyond the sides from a, b and c: kNone, kSeveral
};

double local_height(const Facet& facet, double z) {
  return std::min(facet.thickness, std::max(0.0, z + 0.5 * facet.thickness * facet.rise));
}

// Mean of the local height over a triangle in a facet: of its corners where it is linear between them; elsewhere, at the rim of
// what reaches down to the platform, over its quarters.
double mean_height(const Facet& facet, const Vec3& a, const Vec3& b, const Vec3& c, int quarterings = 7) {
  const auto regime = [&](const Vec3& p) {
    const double reach = p.z() + 0.5 * facet.thickness * facet.rise;
    return (reach > 0.0) + (reach > facet.thickness);
  };
  if (quarterings == 0 || (regime(a) == regime(b) && regime(b) == regime(c))) {
    return (local_height(facet, a.z()) + local_height(facet, b.z()) + local_height(facet, c.z())) / 3.0;
  }
  const Vec3 ab = 0.5 * (a + b), bc = 0.5 * (b + c), ca = 0.5 * (c + a);
  const int left = quarterings - 1;
  return 0.25 * (mean_height(facet, a, ab, ca, left) + mean_height(facet, ab, b, bc, left) + mean_height(facet, ca, bc, c, left) +
                 mean_height(facet, ab, bc, ca, left));
}

std::vector<Facet> facets_of(const SheetTask& task, Index sheet_index, const std::vector<Piece>& pieces, const Neighbours& beyond) {
  const Sheet& sheet = task.printed.sheets[sheet_index];
  std::vector<Facet> facets(sheet.triangle_count);
  for (std::size_t piece = 0; piece < pieces.size(); ++piece) {
    for (const Index t : pieces[piece].triangles) {
      const auto [a, b, c] = corners_of(task.printed, t);
      const Vec3 gradient = task.field.gradient[task.printed.triangle_tet[t]];
      const double slope = std::max(gradient.norm(), 1e-12);
      const Vec3 n = area_normal(a, b, c);
      const Vec3 normal = n.norm() > 0.0 ? Vec3(n.normalized()) : Vec3(gradient / slope);
      const auto inward = [&](const Vec3& side) { return Vec3(normal.cross(side).normalized()); };
      facets[t - sheet.first_triangle] = {.normal = normal,
                                          .inward = {inward(b - a), inward(c - b), inward(a - c)},
                                          .a = a,
                                          .b = b,
                                          .c = c,
                                          .rise = gradient.z() / slope,
                                          .thickness = 1.0 / (slope * task.printed.count * sheet.passes),
                                          .piece = static_cast<Index>(piece),
                                          .beyond = beyond[t - sheet.first_triangle]};
    }
  }
  return facets;
}

// What a point of a path finds under itself.
struct Footing {
  double distance = kFarMm;
  double lowest = std::numeric_limits<double>::max(), highest = 0.0;  // local heights of the triangles that it touches
};

class SheetSurface {
 public:
  SheetSurface(const SheetTask& task, Index sheet, const std::vector<Piece>& pieces, const Neighbours& beyond)
      : facets_(facets_of(task, sheet, pieces, beyond)),
        limit_(task.options.max_distance_mm),
        grid_(static_cast<Index>(facets_.size()), cell_size(pieces), [&](Index i) {
          const Facet& f = facets_[i];
          return std::pair<Vec3, Vec3>(f.a.cwiseMin(f.b).cwiseMin(f.c), f.a.cwiseMax(f.b).cwiseMax(f.c));
        }),
        touched_(pieces.size(), 0) {}

  // Also marks the pieces that p touches. Fast for points that lie near the one before.
  Footing footing(const Vec3& p) {
    if (!p.allFinite()) return {};
    Footing found;
    if (step_to(p, found)) return found;
    found = look(p, limit_);
    if (found.distance > limit_) found = look(p, kFarMm);
    return found;
  }
  [[nodiscard]] bool touched(std::size_t piece) const { return touched_[piece] != 0; }
  [[nodiscard]] const std::vector<Facet>& facets() const { return facets_; }

 private:
  // Cells about as large as a triangle.
  [[nodiscard]] double cell_size(const std::vector<Piece>& pieces) const {
    double area = 0.0;
    for (const Piece& piece : pieces) area += piece.area;
    return std::max(0.4, 1.2 * std::sqrt(area / std::max<std::size_t>(1, facets_.size())));
  }

  Footing look(const Vec3& p, double reach) {
    Footing found;
    Index nearest = kNone;
    const bool alone = grid_.visit(p, reach, [&](Index i) {
      const Facet& f = facets_[i];
      const double off = std::abs(f.normal.dot(p - f.a));
      const std::array<double, 3> inside = {f.inward[0].dot(p - f.a), f.inward[1].dot(p - f.b), f.inward[2].dot(p - f.c)};
      const double least = std::min({inside[0], inside[1], inside[2]});
      if (off <= kTouch && least > kTouch) {
        found = {.distance = off};
        add(f, p, found);
        last_ = i;
        return true;
      }
      const double beyond = std::max(found.distance, kTouch);
      if (off > beyond || -least > beyond) return false;
      const double distance = (closest_point_on_triangle(p, f.a, f.b, f.c) - p).norm();
      if (distance < found.distance) {
        found.distance = distance;
        nearest = i;
      }
      if (distance <= kTouch) add(f, p, found);
      return false;
    });
    if (alone) return found;
    if (nearest != kNone) last_ = nearest;
    if (nearest != kNone && found.distance > kTouch && found.distance <= limit_) add(facets_[nearest], p, found);
    return found;
  }

  // Walks from the facet found last to the one that p stands on. True when p touches the inner part of one facet, or of the
  // side between two, and so no other one; then `found` is what look() would say.
  bool step_to(const Vec3& p, Footing& found) {
    constexpr int kMostSteps = 6;
    for (int step = 0; step < kMostSteps && last_ != kNone; ++step) {
      const Facet& f = facets_[last_];
      const double off = std::abs(f.normal.dot(p - f.a));
      if (!(off <= kTouch)) return false;
      const std::array<double, 3> inside = {f.inward[0].dot(p - f.a), f.inward[1].dot(p - f.b), f.inward[2].dot(p - f.c)};
      const auto side = std::min_element(inside.begin(), inside.end()) - inside.begin();
      if (inside[side] > kTouch) {
        found = {.distance = off};
        add(f, p, found);
        return true;
      }
      const Index next = f.beyond[side];
      if (next < 0) return false;
      if (inside[side] >= -kTouch) return stand_between(f, side, facets_[next], p, found);
      last_ = next;
    }
    return false;
  }
  bool stand_between(const Facet& f, std::ptrdiff_t side, const Facet& next, const Vec3& p, Footing& found) {
    if (!along(f, side, p)) return false;
    const auto back = std::find(next.beyond.begin(), next.beyond.end(), last_) - next.beyond.begin();
    if (back == 3 || !along(next, back, p)) return false;
    found = {};
    for (const Facet* each : {&f, &next}) {
      const double distance = (closest_point_on_triangle(p, each->a, each->b, each->c) - p).norm();
      found.distance = std::min(found.distance, distance);
      if (distance <= kTouch) add(*each, p, found);
    }
    return found.distance <= kTouch;
  }
  // Whether p touches the plane of a facet near one of its sides, but neither of the others.
  static bool along(const Facet& f, std::ptrdiff_t side, const Vec3& p) {
    const std::array<double, 3> inside = {f.inward[0].dot(p - f.a), f.inward[1].dot(p - f.b), f.inward[2].dot(p - f.c)};
    return std::abs(f.normal.dot(p - f.a)) <= kTouch && std::abs(inside[side]) <= kTouch && inside[(side + 1) % 3] > kTouch &&
           inside[(side + 2) % 3] > kTouch;
  }
  void add(const Facet& f, const Vec3& p, Footing& found) {
    const double height = local_height(f, p.z());
    found.lowest = std::min(found.lowest, height);
    found.highest = std::max(found.highest, height);
    touched_[f.piece] = 1;
  }

  std::vector<Facet> facets_;
  double limit_;
  ElementGrid grid_;
  std::vector<std::uint8_t> touched_;
  Index last_ = kNone;  // the facet where the last point was: the next one is often on it, or beside it
};

struct Segment {
  Vec3 from = Vec3::Zero(), to = Vec3::Zero(), normal = Vec3::Zero();
  double width = 0.0, height = 0.0, volume = 0.0;
  bool ring = false;
};

double squared_distance(const Vec3& p, const Segment& s) {
  const Vec3 along = s.to - s.from, way = p - s.from;
  const double length = along.squaredNorm();
  const double at = length > 0.0 ? std::clamp(way.dot(along) / length, 0.0, 1.0) : 0.0;
  return (way - at * along).squaredNorm();
}

ElementGrid grid_of(const std::vector<Segment>& segments, double cell_mm) {
  return ElementGrid(static_cast<Index>(segments.size()), cell_mm, [&](Index i) {
    const Segment& s = segments[i];
    return std::pair<Vec3, Vec3>(s.from.cwiseMin(s.to), s.from.cwiseMax(s.to));
  });
}

double relative_error(double value, double truth) {
  if (value == truth) return 0.0;
  const double error = std::abs(value - truth) / std::abs(truth);
  return std::isfinite(error) ? error : 1.0;
}

double outside(double value, double low, double high) {
  if (value >= low && value <= high) return 0.0;
  return value < low ? relative_error(value, low) : relative_error(value, high);
}

void measure_point(const SheetTask& task, const Vec3& position, SheetSurface& surface, SheetFindings& found) {
  const double distance = surface.footing(position).distance;
  found.points_off += distance > task.options.max_distance_mm;
  if (distance > found.max_point_distance) {
    found.max_point_distance = distance;
    found.farthest_point = position;
  }
}

// What a segment finds under itself at places in equal steps.
struct Under {
  double lowest = std::numeric_limits<double>::max(), highest = 0.0, farthest = 0.0;
  Vec3 where = Vec3::Zero();  // it is farthest away

  [[nodiscard]] bool holds(double height, double tolerance) const { return lowest > highest || outside(height, lowest, highest) <= tolerance; }
};

Under look_under(const Segment& s, int looks, SheetSurface& surface) {
  Under under{.where = s.to};
  for (int i = 0; i < looks; ++i) {
    const Vec3 p = s.from + (i + 0.5) / looks * (s.to - s.from);
    const Footing footing = surface.footing(p);
    under.lowest = std::min(under.lowest, footing.lowest);
    under.highest = std::max(under.highest, footing.highest);
    if (footing.distance > under.farthest) {
      under.farthest = footing.distance;
      under.where = p;
    }
  }
  return under;
}

void measure_segment(const SheetTask& task, const Segment& s, SheetSurface& surface, SheetFindings& found) {
  const ToolpathCertificateOptions& options = task.options;
  const double length = (s.to - s.from).norm();
  ++found.segments;
  found.length += length;
  found.bead_area += s.width * length;
  found.bead_volume += s.volume;
  const double volume_error = relative_error(s.volume, s.height * s.width * length);
  found.max_volume_error = std::max(found.max_volume_error, volume_error);
  found.wrong_volumes += volume_error > options.max_volume_error;

  const int looks = static_cast<int>(std::clamp(std::ceil(length / kSegmentStep), 1.0, 1e4));
  Under under = look_under(s, looks, surface);
  // Few looks at a short segment may miss the triangle that most of it lies on.
  if (looks < kClosestLooks && !under.holds(s.height, options.max_height_error)) under = look_under(s, kClosestLooks, surface);
  const auto [lowest, highest, farthest, where] = under;
  if (farthest > options.max_distance_mm) {
    ++found.segments_off;
    if (found.leaving.size() < kPlacesKept) found.leaving.push_back({where, farthest});
  }
  if (lowest > highest) return;  // nothing under the segment: counted above
  const double height_error = outside(s.height, lowest, highest);
  if (height_error > options.max_height_error) {
    ++found.wrong_heights;
    found.wrong_height_length += length;
  }
  if (height_error > found.max_height_error) {
    found.max_height_error = height_error;
    found.worst_height = s.to;
  }
}

// Points and segments of the paths in their order. Gives back the segments but those that have an end nowhere: their points
// are off the layer.
std::vector<Segment> measure_paths(const SheetTask& task, const std::vector<Index>& paths, SheetSurface& surface,
                                   SheetFindings& found) {
  const double bead_width = task.options.bead_width_mm;
  std::vector<Segment> segments;
  for (const Index i : paths) {
    const Path& path = task.toolpaths.paths[i];
    for (Index k = path.first_point; k < path.first_point + path.point_count; ++k) {
      const PathPoint& end = task.toolpaths.points[k];
      if (k == path.first_point && end.volume_mm3 != 0.0) {
        ++found.wrong_volumes;
        found.max_volume_error = std::max(found.max_volume_error, 1.0);
      }
      if (k > path.first_point && end.position.allFinite() && task.toolpaths.points[k - 1].position.allFinite()) {
        const bool ring = path.kind == PathKind::contour && std::abs(end.width_mm / bead_width - 1.0) <= kRingWidth;
        segments.push_back({task.toolpaths.points[k - 1].position, end.position, end.normal, end.width_mm, end.height_mm,
                            end.volume_mm3, ring});
        measure_segment(task, segments.back(), surface, found);
      }
      measure_point(task, end.position, surface, found);
    }
  }
  return segments;
}

// Points at equal steps of area through the sheet, in the order of its triangles.
void for_each_sample(const std::vector<Facet>& facets, double per_mm2, const auto& use) {
  const double step = 1.0 / per_mm2;
  double done = 0.0;
  Index sample = 0;
  for (const Facet& f : facets) {
    const double area = triangle_area(f.a, f.b, f.c);
    for (; (sample + 0.5) * step < done + area; ++sample) {
      // Uniform in the triangle: one coordinate from the place in the walk, one from the golden ratio.
      double u = std::clamp(((sample + 0.5) * step - done) / area, 0.0, 1.0);
      double v = std::fmod(0.5 + sample * 0.6180339887498949, 1.0);
      if (u + v > 1.0) {
        u = 1.0 - u;
        v = 1.0 - v;
      }
      use(Vec3(f.a + u * (f.b - f.a) + v * (f.c - f.a)), f);
    }
    done += area;
  }
}

void measure_coverage(const SheetTask& task, const std::vector<Facet>& facets, const std::vector<Segment>& segments,
                      const ElementGrid& grid, SheetFindings& found) {
  const double nominal = task.options.bead_width_mm, near = 0.55 * nominal;
  double widest = nominal;
  for (const Segment& s : segments) widest = std::max(widest, s.width);
  widest = std::min(widest, 4.0 * nominal);  // a wrong width must not make the search endless
  for_each_sample(facets, task.samples_per_mm2, [&](const Vec3& p, const Facet&) {
    bool covered = false, bead_covered = false;
    // Few places need a bead that is wider than usual.
    for (const double reach : {near, 0.55 * widest}) {
      if (grid.visit(p, reach, [&](Index i) {
            const double distance = squared_distance(p, segments[i]);
            const double inside = 0.5 * segments[i].width;
            covered = covered || distance <= near * near || distance <= inside * inside;
            bead_covered = bead_covered || distance <= 0.55 * 0.55 * segments[i].width * segments[i].width;
            return covered && bead_covered;
          })) {
        break;
      }
    }
    ++found.samples;
    found.covered += covered;
    found.bead_covered += bead_covered;
    if (!covered && found.uncovered.size() < kPlacesKept) found.uncovered.push_back(p);
  });
}

// The edges of a sheet that one triangle has.
class Rim {
 public:
  Rim(const LayerStack& printed, const Sheet& sheet, double reach) : edges_(edges_of(printed, sheet)), reach_(reach), grid_(grid_of(edges_, reach)) {}
  [[nodiscard]] bool near(const Vec3& p) const {
    return grid_.visit(p, reach_, [&](Index i) {
      return squared_distance(p, edges_[i]) <= reach_ * reach_;
    });
  }

 private:
  static std::vector<Segment> edges_of(const LayerStack& printed, const Sheet& sheet) {
    std::vector<std::pair<Index, Index>> pairs;
    for (Index t = sheet.first_triangle; t < sheet.first_triangle + sheet.triangle_count; ++t) {
      const auto& v = printed.triangles[t];
      for (const auto& [a, b] : {std::pair(v[0], v[1]), std::pair(v[1], v[2]), std::pair(v[2], v[0])}) pairs.emplace_back(std::min(a, b), std::max(a, b));
    }
    std::sort(pairs.begin(), pairs.end());
    std::vector<Segment> edges;
    for (std::size_t i = 0; i < pairs.size();) {
      std::size_t end = i;
      while (end < pairs.size() && pairs[end] == pairs[i]) ++end;
      if (end == i + 1) {
        Segment edge;
        edge.from = printed.vertices[pairs[i].first];
        edge.to = printed.vertices[pairs[i].second];
        edges.push_back(edge);
      }
      i = end;
    }
    return edges;
  }

  std::vector<Segment> edges_;
  double reach_;
  ElementGrid grid_;
};

// The layers of the model right above a sheet of support.
class ModelOver {
 public:
  ModelOver(const SheetTask& task, const Sheet& sheet) : sheet_(sheet) {
    if (sheet.material != Material::support) return;
    const int last = task.options.interface_layers + (task.options.interface_gap_mm > 0.0 ? kMostGapLayers : 0);
    gap_ = task.options.interface_gap_mm;
    layers_ = task.options.interface_layers;
    for (Index s = 0; s < static_cast<Index>(task.printed.sheets.size()); ++s) {
      const Sheet& other = task.printed.sheets[s];
      if (other.material != Material::model || other.layer <= sheet.layer || other.layer > sheet.layer + last) continue;
      Neighbours beyond;
      const std::vector<Piece> pieces = pieces_of(task.printed, s, &beyond);
      above_.emplace_back(other.layer - sheet.layer, SheetSurface(task, s, pieces, beyond));
    }
  }
  bool covers(const Vec3& p, const Facet& f) {
    const double thickness = f.thickness * sheet_.passes, below_middle = 0.5 - (sheet_.pass + 0.5) / sheet_.passes;
    for (auto& [layers, surface] : above_) {
      if (layers > layers_ + std::ceil(gap_ / thickness - 1e-9)) continue;
      const double distance = surface.footing(p + (layers + below_middle) * thickness * f.normal).distance;
      if (distance <= kUnderModel * thickness && distance < kFarMm) return true;
    }
    return false;
  }

 private:
  static constexpr int kMostGapLayers = 20;
  const Sheet& sheet_;
  int layers_ = 0;
  double gap_ = 0.0;
  std::vector<std::pair<int, SheetSurface>> above_;
};

void measure_sparse_coverage(const SheetTask& task, const Sheet& sheet, const std::vector<Facet>& facets,
                             const std::vector<Segment>& segments, const ElementGrid& grid, SheetFindings& found) {
  const int m = static_cast<int>(sheet.material);
  const double near = 0.55 * task.options.bead_width_mm, far = std::max(near, kSparseReach * task.options.line_spacing_mm[m]);
  const Rim rim(task.printed, sheet, task.options.perimeters[m] * task.options.bead_width_mm);
  ModelOver model(task, sheet);
  for_each_sample(facets, task.samples_per_mm2, [&](const Vec3& p, const Facet& f) {
    const double reach = rim.near(p) || model.covers(p, f) ? near : far;
    const bool covered = grid.visit(p, reach, [&](Index i) {
      return squared_distance(p, segments[i]) <= reach * reach;
    });
    ++found.sparse_samples;
    found.sparse_covered += covered;
    if (!covered && found.uncovered.size() < kPlacesKept) found.uncovered.push_back(p);
  });
}

// Distance from p, at right angles to `along`, to the first path on either side, where that is a ring that runs
// alongside.
void measure_spacing_at(const Vec3& p, Index own, const std::vector<Segment>& segments, const ElementGrid& grid,
                        double reach, SheetFindings& found) {
  const Vec3 along = (segments[own].to - segments[own].from).normalized();
  const Vec3 side = segments[own].normal.cross(along);
  struct Hit {
    double distance;
    Index segment = kNone;
  } hit[2] = {{reach}, {reach}};
  grid.visit(p, reach, [&](Index i) {
    const double before = (segments[i].from - p).dot(along), after = (segments[i].to - p).dot(along);
    if (i == own || (before <= 0.0) == (after <= 0.0)) return false;
    const Vec3 offset = segments[i].from + before / (before - after) * (segments[i].to - segments[i].from) - p;
    Hit& best = hit[offset.dot(side) > 0.0];
    const double distance = offset.norm();
    // Equal distances cannot be told apart by the order of the cells: the lower segment wins.
    if (distance < best.distance || (distance == best.distance && i < best.segment)) best = {distance, i};
    return false;
  });
  for (const Hit& h : hit) {
    if (h.segment == kNone || !segments[h.segment].ring) continue;
    const Vec3 other = (segments[h.segment].to - segments[h.segment].from).normalized();
    if (std::abs(other.dot(along)) < kParallelCosine) continue;
    found.spacing.push_back(static_cast<float>(h.distance));
    found.spacing_over_width.push_back(static_cast<float>(h.distance / (0.5 * (segments[own].width + segments[h.segment].width))));
  }
}

void measure_spacing(const SheetTask& task, const std::vector<Segment>& segments, const ElementGrid& grid,
                     SheetFindings& found) {
  const double step = 1.0 / task.samples_per_mm;
  double next = 0.5 * step;
  for (Index i = 0; i < static_cast<Index>(segments.size()); ++i) {
    const Segment& s = segments[i];
    const double length = (s.to - s.from).norm();
    found.spacing_sides += 2.0 * length / step;
    if (!s.ring) continue;
    for (; next < length; next += step) {
      measure_spacing_at(s.from + next / length * (s.to - s.from), i, segments, grid,
                         kSpacingReach * task.options.bead_width_mm, found);
    }
    next -= length;
  }
}

// Area and volume of the sheet.
void measure_layer(const SheetTask& task, const std::vector<Facet>& facets, const std::vector<Piece>& pieces,
                   SheetFindings& found) {
  const double small = task.options.bead_width_mm * task.options.bead_width_mm;
  for (const Facet& f : facets) {
    const double area = triangle_area(f.a, f.b, f.c);
    const double height = mean_height(f, f.a, f.b, f.c);
    found.area += area;
    found.volume += area * height;
    if (pieces[f.piece].area < small) found.small_piece_volume += area * height;
  }
}

}  // namespace

SheetFindings measure_sheet(const SheetTask& task, Index sheet, const std::vector<Index>& paths) {
  SheetFindings found;
  Neighbours beyond;
  const std::vector<Piece> pieces = pieces_of(task.printed, sheet, &beyond);
  SheetSurface surface(task, sheet, pieces, beyond);
  measure_layer(task, surface.facets(), pieces, found);
  const std::vector<Segment> segments = measure_paths(task, paths, surface, found);

  const double smallest = 0.5 * task.options.bead_width_mm * task.options.bead_width_mm;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    if (pieces[i].area < smallest) continue;
    ++found.pieces;
    if (!surface.touched(i)) found.missing.push_back({pieces[i].centroid, pieces[i].area});
  }
  const ElementGrid grid = grid_of(segments, task.options.bead_width_mm);
  const int m = static_cast<int>(task.printed.sheets[sheet].material);
  if (task.options.dense[m]) {
    measure_coverage(task, surface.facets(), segments, grid, found);
  } else if (task.options.line_spacing_mm[m] > 0.0) {
    measure_sparse_coverage(task, task.printed.sheets[sheet], surface.facets(), segments, grid, found);
  }
  if (task.options.perimeters[m] != 1) measure_spacing(task, segments, grid, found);
  return found;
}

}  // namespace curvesup::certificate
