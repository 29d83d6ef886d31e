#include "trim/drop_floating.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

#include "curvesup/core/parallel.h"
#include "curvesup/mesh/triangle_mesh.h"
#include "curvesup/solid/solid.h"
#include "trim/pass_sheet.h"

namespace curvesup {

namespace {

constexpr double kRestingPart = 0.3;  // more than the certificate asks for, which looks at other points
constexpr double kSamplesPerMm2 = 8.0;
constexpr int kFewestSamples = 32, kMostSamples = 128;
// Pieces on top of each other that may go; where more would follow, the branch stands on them and all of them stay.
constexpr int kMostStacked = 6;

// The triangles of pieces that are gone.
struct Gone {
  std::size_t sheet_id;
  const TrimmedSheet* sheet;
  Index piece;
  std::vector<std::size_t> below;  // that were gone before, and below it
  Vec3 low, high;

  [[nodiscard]] bool has(const Vec3& p, double within) const {
    if (((p - low).array() < -within).any() || ((p - high).array() > within).any()) return false;
    for (std::size_t i = 0; i < sheet->triangles.size(); ++i) {
      if (sheet->triangle_piece[i] != piece) continue;
      const auto& t = sheet->triangles[i];
      if ((closest_point_on_triangle(p, sheet->vertices[t[0]], sheet->vertices[t[1]], sheet->vertices[t[2]]) - p).norm() <= within) return true;
    }
    return false;
  }
};

class Resting {
 public:
  Resting(const Domain& domain, const ScalarField& field, int layer_count, const Solid& solid)
      : domain_(domain), field_(field), count_(layer_count), solid_(solid) {}

  void add_gone(std::size_t sheet_id, const TrimmedSheet& sheet, Index piece, std::vector<std::size_t> below) {
    Gone gone{sheet_id, &sheet, piece, std::move(below), Vec3::Constant(std::numeric_limits<double>::infinity()), {}};
    gone.high = -gone.low;
    for (std::size_t i = 0; i < sheet.triangles.size(); ++i) {
      if (sheet.triangle_piece[i] != piece) continue;
      for (const Index v : sheet.triangles[i]) {
        gone.low = gone.low.cwiseMin(sheet.vertices[v]);
        gone.high = gone.high.cwiseMax(sheet.vertices[v]);
      }
    }
    const double value = sheet.head.iso_value * count_;
    at_layer_[static_cast<Index>(std::floor(value))].push_back(gone_.size());
    gone_.push_back(std::move(gone));
  }
  [[nodiscard]] const std::vector<Gone>& gone() const { return gone_; }

  // Forgets pieces, and all that are below them.
  void forget(std::size_t gone) {
    if (gone_[gone].piece == kNone || gone_[gone].sheet->pieces[gone_[gone].piece].too_small) return;
    gone_[gone].piece = kNone;
    for (const std::size_t below : gone_[gone].below) forget(below);
  }

  // Points at equal steps of area through each piece decide; they stop as soon as enough of them rest.
  struct Floating {
    Index piece;
    std::vector<std::size_t> below;  // gone pieces that it lay on
  };
  [[nodiscard]] std::vector<Floating> floating(const TrimmedSheet& sheet) const {
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
    std::vector<Floating> result;
    for (std::size_t p = 0; p < states.size(); ++p) {
      if (present[p] && states[p].resting < kRestingPart * states[p].count) result.push_back({static_cast<Index>(p), std::move(states[p].below)});
    }
    return result;
  }

 private:
  [[nodiscard]] bool rests(const Sheet& sheet, Index tet, const Vec3& p, std::vector<std::size_t>& gone_below) const {
    const double deeper = sheet.iso_value - 1.0 / (static_cast<double>(count_) * sheet.passes);
    const auto below = follow_gradient(domain_, field_, tet, p, deeper, Through::everything);
    if (!below) return false;
    if (below->position.z() <= 0.0) return true;
    if (below->tet == kNone) return false;
    if (domain_.region(below->tet) == Material::model) return true;
    if (!solid_.inside(below->position)) return false;
    const double within = 0.75 / (count_ * sheet.passes * field_.gradient[tet].norm());
    const Index layer = static_cast<Index>(std::floor(deeper * count_));
    for (auto at = at_layer_.lower_bound(layer - 1); at != at_layer_.end() && at->first <= layer + 1; ++at) {
      for (const std::size_t g : at->second) {
        if (gone_[g].piece == kNone || !gone_[g].has(below->position, within)) continue;
        if (std::find(gone_below.begin(), gone_below.end(), g) == gone_below.end()) gone_below.push_back(g);
        return false;
      }
    }
    return true;
  }

  const Domain& domain_;
  const ScalarField& field_;
  int count_;
  const Solid& solid_;
  std::vector<Gone> gone_;
  std::map<Index, std::vector<std::size_t>> at_layer_;  // those of the slab k / N <= G < (k + 1) / N
};

}  // namespace

std::vector<FloatingPiece> find_floating(const Domain& domain, const ScalarField& field, int layer_count, const Solid& solid,
                                         const std::vector<TrimmedSheet*>& sheets, const RunContext& run) {
  Resting resting(domain, field, layer_count, solid);
  for (std::size_t s = 0; s < sheets.size(); ++s) {
    std::vector<char> small(sheets[s]->pieces.size(), 0);
    for (const Index p : sheets[s]->triangle_piece) small[p] = sheets[s]->pieces[p].too_small;
    for (std::size_t p = 0; p < small.size(); ++p) {
      if (small[p]) resting.add_gone(s, *sheets[s], static_cast<Index>(p), {});
    }
  }
  std::vector<char> open(sheets.size(), 1);
  std::vector<std::vector<Resting::Floating>> found(sheets.size());
  for (int round = 0; round <= kMostStacked; ++round) {
    parallel_for(sheets.size(), 2, run, [&](std::size_t begin, std::size_t end, std::size_t) {
      for (std::size_t s = begin; s < end; ++s) {
        if (open[s]) found[s] = resting.floating(*sheets[s]);
      }
    });
    std::vector<double> fresh;
    for (std::size_t s = 0; s < sheets.size(); ++s) {
      if (!std::exchange(open[s], 0)) continue;
      for (Resting::Floating& piece : found[s]) {
        const auto known = [&](const Gone& g) { return g.sheet_id == s && g.piece == piece.piece; };
        if (std::any_of(resting.gone().begin(), resting.gone().end(), known)) continue;
        if (round == kMostStacked) {
          for (const std::size_t below : piece.below) resting.forget(below);
        } else {
          resting.add_gone(s, *sheets[s], piece.piece, std::move(piece.below));
          fresh.push_back(sheets[s]->head.iso_value);
        }
      }
    }
    for (std::size_t s = 0; s < sheets.size(); ++s) {
      const double value = sheets[s]->head.iso_value;
      open[s] = std::any_of(fresh.begin(), fresh.end(), [&](double v) { return value > v && value < v + 2.0 / layer_count; });
    }
  }
  std::vector<FloatingPiece> all;
  for (const Gone& gone : resting.gone()) {
    if (gone.piece != kNone && !gone.sheet->pieces[gone.piece].too_small) all.push_back({gone.sheet_id, gone.piece});
  }
  std::sort(all.begin(), all.end(), [](const FloatingPiece& a, const FloatingPiece& b) {
    return a.sheet != b.sheet ? a.sheet < b.sheet : a.piece < b.piece;
  });
  return all;
}

}  // namespace curvesup
