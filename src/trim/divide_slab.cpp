#include "trim/divide_slab.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "core/disjoint_sets.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "trim/pass_sheet.h"

namespace curvesup {

namespace {

constexpr double kOnTriangle_mm = 1e-9;
constexpr double kOnSpot_mm = 0.05;
constexpr int kSampleEvery = 8;  // triangles; besides the first of each piece in each tet

int wanted_passes(const Piece& piece, const SlabOptions& options) {
  const auto for_height = [&](double thickness, double height) {
    return static_cast<int>(std::clamp(std::ceil(thickness / height - 1e-9), 1.0, static_cast<double>(options.max_passes)));
  };
  const int usual = for_height(piece.thickness_p95, options.max_height_mm), most = for_height(piece.thickness_max, options.limit_mm);
  return most <= 2 * usual ? std::max(usual, most) : usual;
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

// How a region is laid: in how many passes, for what thickness.
struct Laid {
  int passes;
  double thickness;
  auto operator<=>(const Laid&) const = default;
};

// A sheet of passes, and how each of its pieces is laid.
struct LaidSheet {
  TrimmedSheet sheet;
  std::vector<Laid> laid;
};

// The same sheet of two kinds of regions.
void append(TrimmedSheet& to, const TrimmedSheet& from) {
  const Index vertices = static_cast<Index>(to.vertices.size()), pieces = static_cast<Index>(to.pieces.size());
  to.vertices.insert(to.vertices.end(), from.vertices.begin(), from.vertices.end());
  to.source.insert(to.source.end(), from.source.begin(), from.source.end());
  to.pieces.insert(to.pieces.end(), from.pieces.begin(), from.pieces.end());
  to.triangle_tet.insert(to.triangle_tet.end(), from.triangle_tet.begin(), from.triangle_tet.end());
  for (const auto& [a, b, c] : from.triangles) to.triangles.push_back({a + vertices, b + vertices, c + vertices});
  for (const Index piece : from.triangle_piece) to.triangle_piece.push_back(piece + pieces);
}

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
    for (const Piece& piece : middle.pieces) laid_.push_back(wanted(piece));
  }

  DividedSlab run() {
    samples_ = sample_triangles(middle_);
    while (grow()) join();
    std::vector<LaidSheet> sheets;
    sheets.push_back(layer_in(1));
    for (auto& [m, division] : divisions_) {
      for (std::size_t j = 0; j < division.found.size(); ++j) {
        LaidSheet found{std::move(division.found[j]), {}};
        for (std::size_t p = 0; p < found.sheet.pieces.size(); ++p) found.laid.push_back(laid(found.sheet.pieces[p], division.owner[j][p]));
        keep_laid_in(m, found);
        if (!found.sheet.triangles.empty()) sheets.push_back(std::move(found));
      }
      if (m % 2 == 1) sheets.push_back(layer_in(m));
    }
    for (LaidSheet& sheet : sheets) {
      seed_spots(sheet);
      take_out_spots(sheet);
    }
    lay_spots(sheets);
    DividedSlab result;
    result.in_one_pass = std::move(sheets.front().sheet);
    for (std::size_t s = 1; s < sheets.size(); ++s) {
      if (!sheets[s].sheet.triangles.empty()) result.passes.push_back(std::move(sheets[s].sheet));
    }
    return result;
  }

 private:
  [[nodiscard]] Laid wanted(const Piece& piece) const { return {wanted_passes(piece, options_), piece.thickness_p95}; }
  int passes_of(Index piece) { return laid_[regions_.root(piece)].passes; }

  // What is laid of the layer itself, as the middle one of m passes.
  [[nodiscard]] LaidSheet layer_in(int m) {
    LaidSheet layer{middle_, {}};
    if (m > 1) {
      const Level level = make_level(middle_.head.layer, m / 2, m, layer_count_);
      layer.sheet.head = {level.layer, level.pass, level.passes, Material::support, level.iso_value, 0, 0};
      layer.sheet.cut_away_area = 0.0;
    }
    for (std::size_t p = 0; p < middle_.pieces.size(); ++p) layer.laid.push_back(laid_[regions_.root(static_cast<Index>(p))]);
    keep_laid_in(m, layer);
    return layer;
  }

  static void keep_laid_in(int m, LaidSheet& sheet) {
    std::vector<char> keep(sheet.laid.size());
    for (std::size_t p = 0; p < keep.size(); ++p) keep[p] = sheet.laid[p].passes == m;
    keep_pieces(sheet.sheet, keep);
  }

  [[nodiscard]] bool is_spot(Index tet, const Laid& region) const {
    return region.passes < options_.max_passes && thickness(tet) > region.passes * options_.limit_mm * (1.0 + 1e-9);
  }
  [[nodiscard]] double thickness(Index tet) const { return 1.0 / (layer_count_ * field_.gradient[tet].norm()); }
  [[nodiscard]] int doubled(int passes) const { return std::min(2 * passes, options_.max_passes); }
  // In how many passes a tet is laid in a region.
  [[nodiscard]] int passes_in(Index tet, const Laid& region) const {
    int m = region.passes;
    if (!is_spot(tet, region)) return m;
    while (m < options_.max_passes && thickness(tet) * region.passes > m * region.thickness * (1.0 + 1e-9)) m = doubled(m);
    return m;
  }

  // Wants the passes of spots where a sheet passes through them, from its lower to its upper side.
  void seed_spots(const LaidSheet& laid) {
    const TrimmedSheet& sheet = laid.sheet;
    for (std::size_t i = 0; i < sheet.triangles.size(); ++i) {
      const Laid& region = laid.laid[sheet.triangle_piece[i]];
      if (!is_spot(sheet.triangle_tet[i], region)) continue;
      for (int m = region.passes; m < options_.max_passes;) {
        m = doubled(m);
        for (int j = 0; j < m; ++j) {
          if ((2 * j + 1) * region.passes / (2 * m) != sheet.head.pass) continue;
          const auto at = follow_gradient(domain_, field_, sheet.triangle_tet[i], centroid(sheet, i),
                                          make_level(middle_.head.layer, j, m, layer_count_).iso_value);
          if (at && passes_in(at->tet, region) == m) spot(region, j, m).want(*at, kOnSpot_mm);
        }
      }
    }
  }

  PassSheet& spot(const Laid& region, int pass, int passes) {
    const auto at = spots_.find({passes, pass, region});
    if (at != spots_.end()) return at->second;
    const auto only = [this, region, passes](Index tet) { return passes_in(tet, region) == passes; };
    return spots_.try_emplace({passes, pass, region}, domain_, field_, reachable_, solid_, options_.edge_length_mm,
                              make_level(middle_.head.layer, pass, passes, layer_count_), only).first->second;
  }

  // Its pieces are others afterwards.
  void take_out_spots(LaidSheet& laid) const {
    TrimmedSheet& sheet = laid.sheet;
    std::size_t kept = 0;
    for (std::size_t i = 0; i < sheet.triangles.size(); ++i) {
      if (is_spot(sheet.triangle_tet[i], laid.laid[sheet.triangle_piece[i]])) continue;
      sheet.triangles[kept] = sheet.triangles[i];
      sheet.triangle_tet[kept] = sheet.triangle_tet[i];
      sheet.triangle_piece[kept++] = sheet.triangle_piece[i];
    }
    if (kept == sheet.triangles.size()) return;
    sheet.triangles.resize(kept);
    sheet.triangle_tet.resize(kept);
    sheet.triangle_piece.resize(kept);
    find_pieces(sheet, field_, layer_count_);
  }

  // Puts the passes of spots to the others; what lies over or under another kind of region has come along.
  void lay_spots(std::vector<LaidSheet>& sheets) {
    const PieceAt piece_at(middle_, options_.edge_length_mm);
    std::vector<Index> owner;
    for (auto& [key, pass] : spots_) {
      const Laid& region = std::get<Laid>(key);
      pass.grow();
      TrimmedSheet found = pass.snapshot(layer_count_);
      find_owners(found, piece_at, owner);
      std::vector<char> keep(owner.size());
      for (std::size_t p = 0; p < keep.size(); ++p) keep[p] = owner[p] == kNone || laid_[regions_.root(owner[p])] == region;
      keep_pieces(found, keep);
      if (found.triangles.empty()) continue;
      const auto same = std::find_if(sheets.begin(), sheets.end(), [&](const LaidSheet& other) {
        return other.sheet.head.passes == found.head.passes && other.sheet.head.pass == found.head.pass;
      });
      if (same != sheets.end()) {
        append(same->sheet, found);
      } else {
        sheets.push_back({std::move(found), {}});
      }
    }
  }

  // Follows the passes from every piece that now wants a number it has not been followed at; false when there is none.
  bool grow() {
    std::vector<int> wanted;
    for (std::size_t p = 0; p < laid_.size(); ++p) {
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
      for (std::size_t p = 0; p < laid_.size(); ++p) division.seeded[p] |= passes_of(static_cast<Index>(p)) == m;
      identify(division);
    }
    return !wanted.empty();
  }

  Division& division_into(int m) {
    Division& division = divisions_[m];
    if (division.sheets.empty()) {
      division.seeded.assign(laid_.size(), 0);
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
          if (laid(found.pieces[in], owner[in]).passes == sheet.level().passes) sheet.want(found.triangles[i][0]);
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

  // How a piece of some pass is laid.
  Laid laid(const Piece& piece, Index owner) { return owner != kNone ? laid_[regions_.root(owner)] : wanted(piece); }

  void join() {
    for (const auto& [a, b] : joins_) {
      const Laid most = std::max(laid_[regions_.root(a)], laid_[regions_.root(b)]);
      regions_.join(a, b);
      laid_[regions_.root(a)] = most;
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
  std::vector<Laid> laid_;    // per piece; that of a region stands at its root
  std::vector<Index> samples_;
  std::map<int, Division> divisions_;
  std::vector<std::pair<Index, Index>> joins_;
  std::map<std::tuple<int, int, Laid>, PassSheet> spots_;  // by number of passes, pass and region
};

}  // namespace

DividedSlab divide_slab(const Domain& domain, const ScalarField& field, int layer_count, const ReachableTets& reachable,
                        const Solid& solid, TrimmedSheet middle, const SlabOptions& options) {
  const auto thickness = [&](Index tet) { return 1.0 / (layer_count * field.gradient[tet].norm()); };
  const auto in_one_pass = [&](const Piece& piece) { return wanted_passes(piece, options) == 1; };
  const auto is_low = [&](Index tet) { return thickness(tet) <= options.limit_mm * (1.0 + 1e-9); };
  DividedSlab slab;
  if (std::all_of(middle.pieces.begin(), middle.pieces.end(), in_one_pass) &&
      std::all_of(middle.triangle_tet.begin(), middle.triangle_tet.end(), is_low)) {
    slab.in_one_pass = std::move(middle);
    return slab;
  }
  slab = SlabDivider(domain, field, layer_count, reachable, solid, middle, options).run();
  for (std::size_t i = 0; i < middle.triangles.size(); ++i) slab.in_passes_mm2 += middle.area(i);
  for (std::size_t i = 0; i < slab.in_one_pass.triangles.size(); ++i) slab.in_passes_mm2 -= slab.in_one_pass.area(i);
  return slab;
}

}  // namespace curvesup
