#include "emit/schedule.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "curvesup/core/parallel.h"
#include "core/angle_between.h"

namespace curvesup::emit {

namespace {

constexpr double kFrame_s = 0.002;  // of the robot's controller: it stands for whole ones

// Time that a circular blend of zone radius r saves at a corner of turn phi: the way is 2 r - R phi shorter.
double time_saved(double blend_mm, double turn, double feed_mm_s) {
  if (blend_mm == 0.0 || turn < 1e-6) return 0.0;
  const double radius = blend_mm / std::tan(turn / 2.0);
  return std::max(0.0, 2.0 * blend_mm - radius * turn) / feed_mm_s;
}

Pose between(const Pose& from, const Pose& to, double fraction) {
  return {from.position_m + fraction * (to.position_m - from.position_m),
          from.rotation_vector + fraction * (to.rotation_vector - from.rotation_vector)};
}

// The move from `from` to `to`, in as many equal pieces as keep each below `longest_s`.
void append_moves(const Waypoint& from, const Waypoint& to, double blend_mm, double longest_s, double blend_fraction,
                  std::vector<Move>& moves) {
  const int pieces = std::max(1, static_cast<int>(std::ceil(to.duration_s / longest_s)));
  const double length = (to.tip_mm - from.tip_mm).norm() / pieces;
  for (int i = 1; i <= pieces; ++i) {
    const double fraction = static_cast<double>(i) / pieces;
    Move move;
    move.tip_mm = i == pieces ? to.tip_mm : from.tip_mm + fraction * (to.tip_mm - from.tip_mm);
    move.pose = i == pieces ? to.pose : between(from.pose, to.pose, fraction);
    move.length_mm = length;
    move.speed_mm_s = to.speed_mm_s;
    move.duration_s = to.duration_s / pieces;
    move.feed_mm_s = to.rotation_limited && to.duration_s > 0.0 ? length / move.duration_s : to.speed_mm_s;
    move.blend_mm = i == pieces ? blend_mm : blend_fraction * length;
    move.volume_mm3 = to.volume_mm3 / pieces;
    move.rotation_limited = to.rotation_limited;
    moves.push_back(move);
  }
}

// Corners save the robot time that the Duet needs. It stands still for what it has saved wherever both machines stop, and
// where no stop comes soon enough a corner becomes one: it is never ahead by more than `most_s`.
std::vector<double> blends_with_stops(std::span<const Waypoint> points, double most_s) {
  std::vector<double> blends(points.size(), 0.0);
  double ahead = 0.0;
  for (std::size_t i = 1; i + 1 < points.size(); ++i) {
    const double turn = angle_between(points[i].tip_mm - points[i - 1].tip_mm, points[i + 1].tip_mm - points[i].tip_mm);
    const double feed = (points[i].tip_mm - points[i - 1].tip_mm).norm() / std::max(points[i].duration_s, 1e-9);
    const double saved = time_saved(points[i].blend_mm, turn, feed);
    const bool stops = points[i].blend_mm == 0.0 || ahead + saved > most_s;
    blends[i] = stops ? 0.0 : points[i].blend_mm;
    ahead = stops ? 0.0 : ahead + saved;
  }
  return blends;
}

// Blend zones of neighbouring waypoints must not meet, also after a move was divided.
void limit_blends(double blend_fraction, std::vector<Move>& moves) {
  for (std::size_t i = 0; i + 1 < moves.size(); ++i) {
    const double room = blend_fraction * std::min(moves[i].length_mm, moves[i + 1].length_mm);
    moves[i].blend_mm = std::min(moves[i].blend_mm, room);
  }
  if (!moves.empty()) moves.back().blend_mm = 0.0;
}

// v / a in all: half when a stretch begins, half when it ends.
double ramp_seconds(const Chain& chain, int move, double acceleration_mm_s2) {
  const Move& m = chain.moves[static_cast<std::size_t>(move)];
  const double half = m.feed_mm_s / (2.0 * acceleration_mm_s2);
  const bool begins = move == 0 || chain.stop_before(move);
  const bool ends = m.blend_mm == 0.0;
  return half * (begins + ends);
}

// A gate's level must still be up when the Duet, coming from its last stop, arrives at it: so a chunk ends a while after
// its last stop, or, where stops are too dense for that, as long after it as possible.
class Chunker {
 public:
  Chunker(Chain& chain, const Machine& machine, const EmitOptions& options)
      : chain_(chain), link_(machine.link), options_(options),
        acceleration_(1000.0 * machine.speeds.print_acceleration_m_s2) {}

  void divide() {
    const int count = static_cast<int>(chain_.moves.size());
    for (int start = 0; start < count;) {
      chain_.chunks.push_back(start);
      const int end = chunk_end(start, count);
      record(start, end);
      start = end;
    }
  }

 private:
  int chunk_end(int start, int count) {
    double time = 0.0;
    double since_stop = chain_.stop_before(start) ? 0.0 : kNever;
    int best = start + 1;
    double best_tail = -1.0;
    int k = start;
    for (; k < count && k - start < link_.gate_moves; ++k) {
      const Move& move = chain_.moves[static_cast<std::size_t>(k)];
      if (k > start && chain_.stop_before(k)) since_stop = 0.0;
      const double seconds = move.duration_s + ramp_seconds(chain_, k, acceleration_);
      if (k > start && time + seconds > link_.gate_interval_s) break;
      time += seconds;
      since_stop += seconds;
      const double tail = std::min(since_stop, options_.stop_margin_s);
      if (tail >= best_tail) {
        best_tail = tail;
        best = k + 1;
      }
    }
    if (k == count) return count;
    if (best_tail < options_.stop_margin_s) ++chain_.tight_gates;
    return best;
  }

  void record(int start, int end) {
    double ahead = 0.0;
    for (int k = start; k < end; ++k) {
      const Move& move = chain_.moves[static_cast<std::size_t>(k)];
      ahead += move.saved_s - move.rest_s;
      chain_.duet_s += move.duration_s + ramp_seconds(chain_, k, acceleration_);
    }
    chain_.max_mismatch_s = std::max(chain_.max_mismatch_s, std::abs(ahead));
  }

  static constexpr double kNever = 1e9;
  Chain& chain_;
  const Link& link_;
  const EmitOptions& options_;
  double acceleration_;
};

Chain schedule_chain(const Motion& motion, const PathMotion& path, const Machine& machine, const EmitOptions& options) {
  Chain chain;
  chain.motion = &path;
  if (path.waypoint_count == 0) return chain;
  std::vector<Waypoint> points;
  points.reserve(static_cast<std::size_t>(path.waypoint_count));
  for (Index i = 0; i < path.waypoint_count; ++i) points.push_back(motion.waypoints[path.first_waypoint + i]);
  chain.start_tip_mm = points[0].tip_mm;
  chain.moves.reserve(static_cast<std::size_t>(path.waypoint_count));
  const double fraction = machine.tolerances.blend_fraction;
  const std::vector<double> blends =
      blends_with_stops(points, options.max_ahead_s);
  double since_stop = options.stop_margin_s;
  for (Index i = 1; i < path.waypoint_count; ++i) {
    const double ramp = points[i].speed_mm_s / (1000.0 * machine.speeds.print_acceleration_m_s2);
    double longest = std::max(0.5 * machine.link.gate_interval_s, 0.98 * machine.link.gate_interval_s - ramp);
    // After a stop there must be a place for a gate that is far enough from it.
    if (i > 1 && blends[i - 1] == 0.0) since_stop = 0.0;
    if (since_stop < options.stop_margin_s) longest = std::min(longest, 2.0 * options.stop_margin_s);
    since_stop += points[i].duration_s;
    append_moves(points[i - 1], points[i], blends[i], longest, fraction, chain.moves);
  }
  limit_blends(fraction, chain.moves);
  double ahead = 0.0;
  for (std::size_t i = 0; i + 1 < chain.moves.size(); ++i) {
    Move& move = chain.moves[i];
    if (move.blend_mm == 0.0) {
      ++chain.stops;
      move.rest_s = std::floor(ahead / kFrame_s) * kFrame_s;
      ahead -= move.rest_s;
      continue;
    }
    const Vec3& before = i == 0 ? chain.start_tip_mm : chain.moves[i - 1].tip_mm;
    const double turn = angle_between(move.tip_mm - before, chain.moves[i + 1].tip_mm - move.tip_mm);
    move.saved_s = time_saved(move.blend_mm, turn, move.feed_mm_s);
    ahead += move.saved_s;
  }
  Chunker(chain, machine, options).divide();
  return chain;
}

}  // namespace

std::vector<Chain> schedule_chains(const Motion& motion, std::size_t first, std::size_t count, const Machine& machine,
                                   const EmitOptions& options, const RunContext& run) {
  std::vector<Chain> chains(count);
  parallel_for(count, 16, run, [&](std::size_t begin, std::size_t end, std::size_t) {
    for (std::size_t i = begin; i < end; ++i) chains[i] = schedule_chain(motion, motion.paths[first + i], machine, options);
  });
  return chains;
}

}  // namespace curvesup::emit
