#include "trim/drop_floating.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <utility>

#include "curvesup/core/parallel.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/solid/solid.h"
#include "trim/clip_piece.h"
#include "trim/pass_sheet.h"

namespace curvesup {

namespace {

constexpr double kRestingPart = 0.3;  // more than the certificate asks for, which looks at other points
constexpr double kSamplesPerMm2 = 8.0;
constexpr int kFewestSamples = 32, kMostSamples = 128;
// Pieces on top of each other that may go; where more would follow, the branch stands on them and all of them stay.
constexpr int kMostStacked = 6;
constexpr int kMostRounds = 40;
constexpr double kOnPlatform_mm = 1e-6;

using Triangles = std::vector<std::array<Vec3, 3>>;

double squared_distance(const Vec3& p, const Triangles& triangles) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [a, b, c] : triangles) least = std::min(least, (closest_point_on_triangle(p, a, b, c) - p).squaredNorm());
  return least;
}

// What is gone of a piece.
struct Gone {
  std::size_t sheet;
  Index piece;                     // kNone when all of it stays after all
  bool listed;                     // else it was too small
  Triangles triangles, left;       // of the piece
  std::vector<Index> left_pieces;  // what it left
  std::vector<std::size_t> below;  // what was gone before, and lay below it
  int stacked = 1;                 // pieces on top of each other that are gone
  Vec3 low = Vec3::Zero(), high = Vec3::Zero();

  [[nodiscard]] bool has(const Vec3& p, double within) const {
    if (((p - low).array() < -within).any() || ((p - high).array() > within).any()) return false;
    const double away = squared_distance(p, triangles);
    return away <= within * within && away < squared_distance(p, left);
  }
};

// Of the pieces first, ..., last - 1.
Triangles triangles_of(const TrimmedSheet& sheet, Index first, Index last) {
  Triangles triangles;
  for (std::size_t i = 0; i < sheet.triangles.size(); ++i) {
    const auto& t = sheet.triangles[i];
    if (sheet.triangle_piece[i] >= first && sheet.triangle_piece[i] < last) triangles.push_back({sheet.vertices[t[0]], sheet.vertices[t[1]], sheet.vertices[t[2]]});
  }
  return triangles;
}

class Resting {
 public:
  Resting(const Domain& domain, const ScalarField& field, int layer_count, const Solid& solid)
      : domain_(domain), field_(field), count_(layer_count), solid_(solid) {}

  void add_gone(const TrimmedSheet& sheet, Gone gone) {
    gone.low = Vec3::Constant(std::numeric_limits<double>::infinity());
    gone.high = -gone.low;
    for (const auto& t : gone.triangles) {
      for (const Vec3& p : t) {
        gone.low = gone.low.cwiseMin(p);
        gone.high = gone.high.cwiseMax(p);
      }
    }
    for (const std::size_t below : gone.below) gone.stacked = std::max(gone.stacked, gone_[below].stacked + 1);
    at_layer_[static_cast<Index>(std::floor(sheet.head.iso_value * count_))].push_back(gone_.size());
    gone_.push_back(std::move(gone));
  }
  [[nodiscard]] const std::vector<Gone>& gone() const { return gone_; }

  [[nodiscard]] bool is_gone(std::size_t sheet, Index piece) const {
    return std::any_of(gone_.begin(), gone_.end(), [&](const Gone& g) { return g.sheet == sheet && g.piece == piece; });
  }

  // How many pieces on top of each other would be gone with one that lay on these.
  [[nodiscard]] int stacked_on(const std::vector<std::size_t>& below) const {
    int most = 0;
    for (const std::size_t g : below) most = std::max(most, gone_[g].stacked);
    return most + 1;
  }

  // What is gone stays after all, and all that is gone below it; `undo` puts back what was left of a piece.
  void forget(std::size_t gone, const std::function<bool(const Gone&)>& undo) {
    if (!gone_[gone].listed || gone_[gone].piece == kNone || !undo(gone_[gone])) return;
    gone_[gone].piece = kNone;
    gone_[gone].triangles.clear();
    for (const std::size_t below : gone_[gone].below) forget(below, undo);
  }

  // Points at equal steps of area through each piece decide; they stop as soon as enough of them rest.
  struct Candidate {
    Index piece;
    std::vector<std::size_t> below;  // what it lay on and is gone
  };
  [[nodiscard]] std::vector<Candidate> floating(const TrimmedSheet& sheet) const {
    struct State {
      std::vector<std::size_t> below;
      double step = 0.0, done = 0.0;
      int count = 0, sample = 0, resting = 0;
    };
    std::vector<State> states(sheet.pieces.size());
    for (std::size_t p = 0; p < states.size(); ++p) {
      const double area = sheet.pieces[p].area;
      states[p].count = static_cast<int>(std::clamp(std::ceil(kSamplesPerMm2 * area), double{kFewestSamples}, double{kMostSamples}));
      states[p].step = area / states[p].count;
    }
    for (std::size_t i = 0; i < sheet.triangles.size(); ++i) {
      if (sheet.pieces[sheet.triangle_piece[i]].too_small) continue;
      State& s = states[sheet.triangle_piece[i]];
      if (s.resting >= kRestingPart * s.count) continue;
      const auto& t = sheet.triangles[i];
      const double area = sheet.area(i);
      for (; s.sample < s.count && (s.sample + 0.5) * s.step < s.done + area; ++s.sample) {
        double u = std::clamp(((s.sample + 0.5) * s.step - s.done) / area, 0.0, 1.0);
        double v = std::fmod(0.5 + s.sample * 0.6180339887498949, 1.0);
        if (u + v > 1.0) u = 1.0 - u, v = 1.0 - v;
        const Vec3& a = sheet.vertices[t[0]];
        s.resting += rests(sheet.head, sheet.triangle_tet[i], a + u * (sheet.vertices[t[1]] - a) + v * (sheet.vertices[t[2]] - a), s.below);
      }
      s.done += area;
    }
    std::vector<char> present(sheet.pieces.size(), 0);
    for (const Index p : sheet.triangle_piece) present[p] = !sheet.pieces[p].too_small;
    std::vector<Candidate> result;
    for (std::size_t p = 0; p < states.size(); ++p) {
      if (present[p] && states[p].resting < kRestingPart * states[p].count) result.push_back({static_cast<Index>(p), std::move(states[p].below)});
    }
    return result;
  }

  [[nodiscard]] bool rests(const Sheet& sheet, Index tet, const Vec3& p, std::vector<std::size_t>& gone_below) const {
    const double deeper = sheet.iso_value - 1.0 / (static_cast<double>(count_) * sheet.passes);
    const auto below = follow_gradient(domain_, field_, tet, p, deeper, Through::everything);
    if (!below) return false;
    if (below->position.z() <= kOnPlatform_mm) return true;
    if (below->tet == kNone) return false;
    if (domain_.region(below->tet) == Material::model) return true;
    if (!solid_.inside(below->position)) return false;
    // Where the field bends, straight down may lie something else than along its gradient: neither may be gone.
    const double thickness = 1.0 / (count_ * sheet.passes * field_.gradient[tet].norm());
    for (const Vec3& place : {below->position, Vec3(p - thickness * print_direction(field_, tet))}) {
      const std::size_t g = gone_at(place, static_cast<Index>(std::floor(deeper * count_)), 0.75 * thickness);
      if (g == kNothing) continue;
      if (std::find(gone_below.begin(), gone_below.end(), g) == gone_below.end()) gone_below.push_back(g);
      return false;
    }
    return true;
  }

 private:
  static constexpr std::size_t kNothing = std::numeric_limits<std::size_t>::max();

  // What is gone next to a place, in slabs around that of a layer.
  [[nodiscard]] std::size_t gone_at(const Vec3& place, Index layer, double within) const {
    for (auto at = at_layer_.lower_bound(layer - 1); at != at_layer_.end() && at->first <= layer + 1; ++at) {
      for (const std::size_t g : at->second) {
        if (gone_[g].has(place, within)) return g;
      }
    }
    return kNothing;
  }

  const Domain& domain_;
  const ScalarField& field_;
  int count_;
  const Solid& solid_;
  std::vector<Gone> gone_;
  std::map<Index, std::vector<std::size_t>> at_layer_;  // those of the slab k / N <= G < (k + 1) / N
};

// Rounds of looking at all sheets over which something went in the round before.
class FloatingDropper {
 public:
  FloatingDropper(Resting& resting, int layer_count, double min_area, const std::vector<TrimmedSheet*>& sheets, const RunContext& run)
      : resting_(resting), count_(layer_count), min_area_(min_area), sheets_(sheets), run_(run), open_(sheets.size(), 1), found_(sheets.size()) {}

  std::vector<Floating> drop() {
    for (std::size_t s = 0; s < sheets_.size(); ++s) count_small_as_gone(s);
    for (int round = 0; round < kMostRounds && std::find(open_.begin(), open_.end(), 1) != open_.end(); ++round) {
      parallel_for(sheets_.size(), 2, run_, [&](std::size_t begin, std::size_t end, std::size_t) {
        for (std::size_t s = begin; s < end; ++s) {
          if (open_[s]) found_[s] = resting_.floating(*sheets_[s]);
        }
      });
      std::vector<double> fresh;
      for (std::size_t s = 0; s < sheets_.size(); ++s) {
        if (!std::exchange(open_[s], 0)) continue;
        for (Resting::Candidate& piece : found_[s]) {
          if (take_away(s, piece)) fresh.push_back(sheets_[s]->head.iso_value);
        }
      }
      for (std::size_t s = 0; s < sheets_.size(); ++s) {
        const double value = sheets_[s]->head.iso_value;
        open_[s] = std::any_of(fresh.begin(), fresh.end(), [&](double v) { return value > v && value < v + 2.0 / count_; });
      }
    }
    drop_whole_pieces();
    std::stable_sort(dropped_.begin(), dropped_.end(), [](const Floating& a, const Floating& b) { return a.sheet < b.sheet; });
    return std::move(dropped_);
  }

 private:
  // Pieces that are too small carry nothing, and go in the end.
  void count_small_as_gone(std::size_t s) {
    std::vector<char> small(sheets_[s]->pieces.size(), 0);
    for (const Index p : sheets_[s]->triangle_piece) small[p] = sheets_[s]->pieces[p].too_small;
    for (Index p = 0; p < static_cast<Index>(small.size()); ++p) {
      if (small[p]) resting_.add_gone(*sheets_[s], {.sheet = s, .piece = p, .listed = false, .triangles = triangles_of(*sheets_[s], p, p + 1), .left = {}, .left_pieces = {}, .below = {}});
    }
  }

  // Takes a piece away, or as much of it as floats; false where it stays as it is.
  bool take_away(std::size_t s, Resting::Candidate& candidate) {
    TrimmedSheet& sheet = *sheets_[s];
    if (resting_.is_gone(s, candidate.piece)) return false;
    const RestsThere rests = [&](Index tet, const Vec3& p) {
      std::vector<std::size_t> below;
      return resting_.rests(sheet.head, tet, p, below);
    };
    Gone gone{.sheet = s, .piece = candidate.piece, .listed = true, .triangles = {}, .left = {}, .left_pieces = {}, .below = std::move(candidate.below)};
    const Index pieces = static_cast<Index>(sheet.pieces.size());
    std::vector<Part> whole = parts_of(sheet, candidate.piece);
    if (clip_piece(sheet, candidate.piece, rests, min_area_, gone.triangles)) {
      gone.left = triangles_of(sheet, pieces, static_cast<Index>(sheet.pieces.size()));
      for (Index p = pieces; p < static_cast<Index>(sheet.pieces.size()); ++p) gone.left_pieces.push_back(p);
      clipped_[{s, candidate.piece}] = std::move(whole);
    } else if (resting_.stacked_on(gone.below) > kMostStacked) {
      for (const std::size_t below : gone.below) resting_.forget(below, [&](const Gone& g) { return undo(g); });
      return false;
    } else {
      gone.triangles = triangles_of(sheet, candidate.piece, candidate.piece + 1);
    }
    resting_.add_gone(sheet, std::move(gone));
    return true;
  }

  // A triangle of a sheet.
  struct Part {
    std::array<Index, 3> triangle;
    Index tet;
  };
  static std::vector<Part> parts_of(const TrimmedSheet& sheet, Index piece) {
    std::vector<Part> parts;
    for (std::size_t i = 0; i < sheet.triangles.size(); ++i) {
      if (sheet.triangle_piece[i] == piece) parts.push_back({sheet.triangles[i], sheet.triangle_tet[i]});
    }
    return parts;
  }

  // Makes a clipped piece whole again, unless more is gone of what was left of it.
  bool undo(const Gone& gone) {
    const auto clipped = clipped_.find({gone.sheet, gone.piece});
    if (clipped == clipped_.end()) return true;
    for (const Index p : gone.left_pieces) {
      if (resting_.is_gone(gone.sheet, p)) return false;
    }
    TrimmedSheet& sheet = *sheets_[gone.sheet];
    std::vector<char> keep(sheet.pieces.size(), 1);
    for (const Index p : gone.left_pieces) keep[p] = 0;
    keep_pieces(sheet, keep);
    for (const auto& [triangle, tet] : clipped->second) {
      sheet.triangles.push_back(triangle);
      sheet.triangle_tet.push_back(tet);
      sheet.triangle_piece.push_back(gone.piece);
    }
    clipped_.erase(clipped);
    return true;
  }

  void list(std::size_t s, const Triangles& triangles, Index pieces_less) {
    Floating floating{.sheet = s, .pieces_less = pieces_less};
    for (const auto& [a, b, c] : triangles) {
      const double area = triangle_area(a, b, c);
      floating.area += area;
      floating.centroid += area / 3.0 * (a + b + c);
    }
    if (floating.area > 0.0) floating.centroid /= floating.area;
    dropped_.push_back(floating);
  }

  void drop_whole_pieces() {
    std::vector<std::vector<char>> keep(sheets_.size());
    for (std::size_t s = 0; s < sheets_.size(); ++s) keep[s].assign(sheets_[s]->pieces.size(), 1);
    for (const Gone& gone : resting_.gone()) {
      if (gone.piece == kNone) continue;
      keep[gone.sheet][gone.piece] = 0;
      if (gone.listed) list(gone.sheet, gone.triangles, 1 - static_cast<Index>(gone.left_pieces.size()));
    }
    for (std::size_t s = 0; s < sheets_.size(); ++s) keep_pieces(*sheets_[s], keep[s]);
  }

  Resting& resting_;
  int count_;
  double min_area_;
  const std::vector<TrimmedSheet*>& sheets_;
  const RunContext& run_;
  std::vector<char> open_;
  std::vector<std::vector<Resting::Candidate>> found_;
  std::map<std::pair<std::size_t, Index>, std::vector<Part>> clipped_;  // pieces of which part stays, as they were
  std::vector<Floating> dropped_;
};

}  // namespace

std::vector<Floating> drop_floating(const Domain& domain, const ScalarField& field, int layer_count, const Solid& solid,
                                    double min_piece_area_mm2, const std::vector<TrimmedSheet*>& sheets, const RunContext& run) {
  Resting resting(domain, field, layer_count, solid);
  return FloatingDropper(resting, layer_count, min_piece_area_mm2, sheets, run).drop();
}

}  // namespace curvesup
