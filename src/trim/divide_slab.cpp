#include "trim/divide_slab.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "core/disjoint_sets.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "trim/pass_sheet.h"

namespace curvesup {

namespace {

constexpr double kOnTriangle_mm = 1e-9;
constexpr int kSampleEvery = 8;  // triangles; besides the first of each piece in each tet

int wanted_passes(double thickness, const SlabOptions& options) {
  const double passes = std::ceil(thickness / options.max_height_mm - 1e-9);
  return static_cast<int>(std::clamp(passes, 1.0, static_cast<double>(options.max_passes)));
}

Vec3 centroid(const TrimmedSheet& sheet, std::size_t triangle) {
  const auto& t = sheet.triangles[triangle];
  return (sheet.vertices[t[0]] + sheet.vertices[t[1]] + sheet.vertices[t[2]]) / 3.0;
}

// Triangles that stand for the pieces of a sheet, dense enough to meet each piece in each tet.
std::vector<Index> sample_triangles(const TrimmedSheet& sheet) {
  std::vector<Index> samples;
  int since = 0;
  for (std::size_t i = 0; i < sheet.triangles.size(); ++i) {
    const bool first = i == 0 || sheet.triangle_piece[i] != sheet.triangle_piece[i - 1] ||
                       sheet.triangle_tet[i] != sheet.triangle_tet[i - 1];
    if (!first && ++since < kSampleEvery) continue;
    since = 0;
    samples.push_back(static_cast<Index>(i));
  }
  return samples;
}

// Finds the piece of a sheet at a point; the sheet's triangles are grouped by ascending tet.
class PieceAt {
 public:
  PieceAt(const TrimmedSheet& sheet, double tolerance_mm) : sheet_(sheet), tolerance_(tolerance_mm) {}
  [[nodiscard]] Index operator()(const ColumnPoint& point) const {
    const auto [first, last] = std::equal_range(sheet_.triangle_tet.begin(), sheet_.triangle_tet.end(), point.tet);
    Index piece = kNone;
    double nearest = tolerance_;
    for (auto tet = first; tet != last; ++tet) {
      const std::size_t i = tet - sheet_.triangle_tet.begin();
      const auto& t = sheet_.triangles[i];
      const Vec3 q = closest_point_on_triangle(point.position, sheet_.vertices[t[0]], sheet_.vertices[t[1]],
                                               sheet_.vertices[t[2]]);
      const double distance = (q - point.position).norm();
      if (distance >= nearest) continue;
      nearest = distance;
      piece = sheet_.triangle_piece[i];
      if (nearest < kOnTriangle_mm) break;
    }
    return piece;
  }

 private:
  const TrimmedSheet& sheet_;
  double tolerance_;
};

// The passes of one number m but the one in the middle, and which pieces of the layer they have been followed from.
struct Division {
  std::vector<PassSheet> sheets;
  std::vector<char> seeded;
  std::vector<TrimmedSheet> found;
  std::vector<std::vector<Index>> owner;  // per sheet and piece: one of the layer's pieces it lies over or under
};

class SlabDivider {
 public:
  SlabDivider(const Domain& domain, const ScalarField& field, int layer_count, const ReachableTets& reachable,
              const Solid& solid, const TrimmedSheet& middle, const SlabOptions& options)
      : domain_(domain),
        field_(field),
        layer_count_(layer_count),
        reachable_(reachable),
        solid_(solid),
        middle_(middle),
        options_(options),
        regions_(middle.pieces.size()) {
    for (const Piece& piece : middle.pieces) passes_.push_back(wanted_passes(piece.thickness_p95, options));
  }

  DividedSlab run() {
    DividedSlab result;
    result.in_one_pass.assign(passes_.size(), 1);
    if (std::all_of(passes_.begin(), passes_.end(), [](int m) { return m == 1; })) return result;
    samples_ = sample_triangles(middle_);
    while (grow()) join();
    for (std::size_t p = 0; p < passes_.size(); ++p) result.in_one_pass[p] = passes_of(static_cast<Index>(p)) == 1;
    for (auto& [m, division] : divisions_) {
      for (std::size_t j = 0; j < division.found.size(); ++j) {
        std::vector<char> keep(division.found[j].pieces.size());
        for (std::size_t p = 0; p < keep.size(); ++p) {
          keep[p] = passes_of_found(division.found[j].pieces[p], division.owner[j][p]) == m;
        }
        keep_pieces(division.found[j], keep);
        if (!division.found[j].triangles.empty()) result.passes.push_back(std::move(division.found[j]));
      }
      if (m % 2 == 1) result.passes.push_back(middle_pass(m));
    }
    return result;
  }

 private:
  int passes_of(Index piece) { return passes_[regions_.root(piece)]; }

  // Of an odd number of passes the one in the middle is the layer itself.
  [[nodiscard]] TrimmedSheet middle_pass(int m) {
    TrimmedSheet sheet = middle_;
    const Level level = make_level(middle_.head.layer, m / 2, m, layer_count_);
    sheet.head = {level.layer, level.pass, level.passes, Material::support, level.iso_value, 0, 0};
    sheet.cut_away_area = 0.0;
    std::vector<char> keep(passes_.size());
    for (std::size_t p = 0; p < keep.size(); ++p) keep[p] = passes_of(static_cast<Index>(p)) == m;
    keep_pieces(sheet, keep);
    return sheet;
  }

  // Follows the passes from every piece that now wants a number it has not been followed at; false when there is none.
  bool grow() {
    std::vector<int> wanted;
    for (std::size_t p = 0; p < passes_.size(); ++p) {
      const int m = passes_of(static_cast<Index>(p));
      if (m == 1) continue;
      Division& division = division_into(m);
      if (!division.seeded[p]) wanted.push_back(m);
    }
    std::sort(wanted.begin(), wanted.end());
    wanted.erase(std::unique(wanted.begin(), wanted.end()), wanted.end());
    for (const int m : wanted) {
      Division& division = divisions_.at(m);
      for (const Index i : samples_) {
        const Index piece = middle_.triangle_piece[i];
        if (passes_of(piece) != m || division.seeded[piece]) continue;
        for (PassSheet& sheet : division.sheets) {
          const auto at = follow_gradient(domain_, field_, middle_.triangle_tet[i], centroid(middle_, i), sheet.level().iso_value);
          if (at) sheet.want(*at);
        }
      }
      for (std::size_t p = 0; p < passes_.size(); ++p) division.seeded[p] |= passes_of(static_cast<Index>(p)) == m;
      identify(division);
    }
    return !wanted.empty();
  }

  Division& division_into(int m) {
    Division& division = divisions_[m];
    if (division.sheets.empty()) {
      division.seeded.assign(passes_.size(), 0);
      for (int j = 0; j < m; ++j) {
        if (2 * j + 1 == m) continue;
        division.sheets.emplace_back(domain_, field_, reachable_, solid_, options_.edge_length_mm,
                                     make_level(middle_.head.layer, j, m, layer_count_));
      }
      division.found.resize(division.sheets.size());
      division.owner.resize(division.sheets.size());
    }
    return division;
  }

  // Follows what is wanted of the passes, and what lies over or under it; finds the pieces of the layer that each piece of
  // the passes lies over or under. What one piece joins becomes one region.
  void identify(Division& division) {
    const PieceAt piece_at(middle_, options_.edge_length_mm);
    for (std::size_t j = 0; j < division.sheets.size(); ++j) {
      PassSheet& sheet = division.sheets[j];
      TrimmedSheet& found = division.found[j];
      std::vector<Index>& owner = division.owner[j];
      do {
        sheet.grow();
        if (sheet.triangle_count() != found.triangles.size()) {
          found = sheet.snapshot(layer_count_);
          find_owners(found, piece_at, owner);
        }
        for (std::size_t i = 0; i < found.triangles.size(); ++i) {
          const Index in = found.triangle_piece[i];
          if (passes_of_found(found.pieces[in], owner[in]) == sheet.level().passes) sheet.want(found.triangles[i][0]);
        }
      } while (sheet.grow());
    }
  }

  // Those of the pieces of a pass; joins what one of them lies over or under.
  void find_owners(const TrimmedSheet& pass, const PieceAt& piece_at, std::vector<Index>& owner) {
    owner.assign(pass.pieces.size(), kNone);
    for (const Index i : sample_triangles(pass)) {
      const Index in = pass.triangle_piece[i];
      const auto at = follow_gradient(domain_, field_, pass.triangle_tet[i], centroid(pass, i), middle_.head.iso_value);
      const Index piece = at ? piece_at(*at) : kNone;
      if (piece == kNone) continue;
      if (owner[in] == kNone) owner[in] = piece;
      joins_.emplace_back(owner[in], piece);
    }
  }

  int passes_of_found(const Piece& piece, Index owner) {
    return owner != kNone ? passes_of(owner) : wanted_passes(piece.thickness_p95, options_);
  }

  void join() {
    for (const auto& [a, b] : joins_) {
      const int m = std::max(passes_of(a), passes_of(b));
      regions_.join(a, b);
      passes_[regions_.root(a)] = m;
    }
    joins_.clear();
  }

  const Domain& domain_;
  const ScalarField& field_;
  int layer_count_;
  const ReachableTets& reachable_;
  const Solid& solid_;
  const TrimmedSheet& middle_;
  SlabOptions options_;
  DisjointSets regions_;      // of the layer's pieces
  std::vector<int> passes_;   // per piece; that of a region stands at its root
  std::vector<Index> samples_;
  std::map<int, Division> divisions_;
  std::vector<std::pair<Index, Index>> joins_;
};

}  // namespace

DividedSlab divide_slab(const Domain& domain, const ScalarField& field, int layer_count, const ReachableTets& reachable,
                        const Solid& solid, const TrimmedSheet& middle, const SlabOptions& options) {
  return SlabDivider(domain, field, layer_count, reachable, solid, middle, options).run();
}

}  // namespace curvesup
