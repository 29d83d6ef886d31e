#include "motion/travel.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "core/angle_between.h"

namespace curvesup {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kNearHop_mm = 3.0;  // neighbouring rings: a low hop is enough
constexpr double kSampleStep_mm = 4.0;
constexpr double kSampleStep_rad = 0.06;

// Plans one travel.
class Planner {
 public:
  Planner(const Cell& cell, const Deposit& deposit, Index before) : cell_(cell), deposit_(deposit), before_(before) {}

  TravelPlan plan(const TravelEnd& from, const TravelEnd& to, const TravelEnd* via) {
    std::optional<TravelPlan> last;
    // As the head stands at the ends; where no way is clear, turned about the nozzle high above, which takes the arm elsewhere.
    for (const double turn : {0.0, 0.6, -0.6, 1.2, -1.2}) {
      turn_ = turn;
      if (std::optional<TravelPlan> plan = first_clear(from, to, via, last)) return *plan;
    }
    if (last) return *last;
    return direct(from, to);
  }

 private:
  // The first way that is clear; `last` gets another one, where there is any.
  std::optional<TravelPlan> first_clear(const TravelEnd& from, const TravelEnd& to, const TravelEnd* via, std::optional<TravelPlan>& last) {
    // With all the clearance; where no way has it (deep between walls), with that of printing.
    for (const double share : {0.5, 0.0}) {
      for (const Over over : {Over::turning, Over::rising, Over::home}) {
        for (const auto& [up, down] : lift_pairs(lifts(from, to, via))) {
          clearance_ = std::max(share * std::min(up, cell_.machine().tolerances.travel_clearance_mm),
                                cell_.machine().tolerances.clearance_mm);
          for (const double over_top : {-1.0, 2.0, 8.0, 20.0}) {
            if (over_top > 0.0 && up < cell_.machine().tolerances.travel_clearance_mm) continue;
            if (over_top < 0.0 && (over != Over::turning || turn_ != 0.0)) continue;
            std::optional<TravelPlan> plan = attempt(from, to, via, up, down, over_top, over);
            if (!plan) continue;
            if (plan->clear) return plan;
            last = std::move(plan);
          }
        }
      }
    }
    return std::nullopt;
  }

  // A way over the top turns the head upright while it rises, rises as it stands and turns then, or goes by the home
  // station, also when the arm has to fold over.
  enum class Over { turning, rising, home };

  std::vector<double> lifts(const TravelEnd& from, const TravelEnd& to, const TravelEnd* via) const {
    const double clearance = cell_.machine().tolerances.travel_clearance_mm;
    std::vector<double> result;
    const bool near = !from.station && !to.station && !via && from.layer == to.layer &&
                      (from.tip - to.tip).norm() < kNearHop_mm && angle_between(from.axis, to.axis) < 0.35;
    if (near) result.push_back(std::min(1.0, clearance));
    for (const double factor : {1.0, 3.0, 8.0, 16.0}) result.push_back(factor * clearance);
    return result;
  }

  // The same lift at both ends, lowest first; then each with each other.
  static std::vector<std::pair<double, double>> lift_pairs(const std::vector<double>& lifts) {
    std::vector<std::pair<double, double>> pairs;
    for (const double lift : lifts) pairs.emplace_back(lift, lift);
    for (const double up : lifts) {
      for (const double down : lifts) {
        if (up != down) pairs.emplace_back(up, down);
      }
    }
    return pairs;
  }

  // The end's pose moved back along its axis, or up and upright; nullopt when the arm cannot take it.
  std::optional<TravelEnd> at(const Vec3& tip, const Vec3& axis, const TravelEnd& like) const {
    TravelEnd end = like;
    end.tip = tip;
    end.axis = axis;
    Joints joints;
    if (cell_.solve(tip, axis, like.yaw, like.branch, joints) != ArmFault::none) return std::nullopt;
    end.joints = unwrapped_near(joints, like.joints);
    for (int j = 0; j < 6; ++j) {
      if (end.joints[j] < cell_.limit_low(j) || end.joints[j] > cell_.limit_high(j)) return std::nullopt;
    }
    end.pose = pose_of(tip, axis, like.yaw, like.pose.rotation_vector);
    return end;
  }

  // The home station, its joints by whole turns near those of `like`.
  TravelEnd home(const TravelEnd& like) const {
    TravelEnd end;
    end.station = true;
    end.joints = radians(cell_.machine().stations.home_deg);
    const Joints near = unwrapped_near(end.joints, like.joints);
    bool within = true;
    for (int j = 0; j < 6; ++j) within = within && near[j] >= cell_.limit_low(j) && near[j] <= cell_.limit_high(j);
    if (within) end.joints = near;
    cell_.tip_of(end.joints, end.tip, end.axis);
    end.pose = to_pose(forward_kinematics(cell_.machine().arm, end.joints) * to_frame(cell_.machine().tool.tcp));
    return end;
  }

  Pose pose_of(const Vec3& tip, const Vec3& axis, double yaw, const Vec3& near) const {
    const Frame frame = cell_.tcp_frame(tip, axis, yaw);
    return {frame.translation(), rotation_vector_near(frame.linear(), near)};
  }

  // The tip of a lifted pose, raised above everything printed.
  Vec3 raised_tip(const TravelEnd& lifted, double clearances) const {
    const double top = deposit_.top_before(before_) + clearances * cell_.machine().tolerances.travel_clearance_mm;
    return {lifted.tip.x(), lifted.tip.y(), std::max(lifted.tip.z(), top)};
  }

  std::optional<TravelEnd> above(const TravelEnd& lifted, double clearances) const {
    // Upright where the arm can, else half way up.
    const Vec3 tip = raised_tip(lifted, clearances);
    for (const double share : {1.0, 0.6, 0.3}) {
      const Vec3 axis = ((1.0 - share) * lifted.axis + share * Vec3::UnitZ()).normalized();
      TravelEnd turned = lifted;
      turned.yaw += turn_;
      if (auto end = at(tip, axis, turned)) return end;
    }
    return std::nullopt;
  }

  // over_top: by how many clearances the way passes above everything printed; negative: no higher than the lift.
  std::optional<TravelPlan> attempt(const TravelEnd& from, const TravelEnd& to, const TravelEnd* via, double lift_from,
                                    double lift_to, double over_top, Over over) {
    std::vector<TravelEnd> stops;
    std::vector<TravelStep> steps;
    const auto add = [&](const TravelEnd& end, TravelStep step) {
      stops.push_back(end);
      steps.push_back(step);
    };
    const TravelStep onward = via ? TravelStep::from_purge : to.station ? TravelStep::to_home : TravelStep::cross;
    add(from, TravelStep::lift);
    if (!from.station) {
      const auto lifted = at(from.tip + lift_from * from.axis, from.axis, from);
      if (!lifted) return std::nullopt;
      add(*lifted, TravelStep::lift);
      if (over_top > 0.0) {
        const auto raised = at(raised_tip(*lifted, over_top), lifted->axis, *lifted);
        const auto high = above(*lifted, over_top);
        if (!high || (over != Over::turning && !raised)) return std::nullopt;
        if (over != Over::turning) add(*raised, TravelStep::lift);
        add(*high, via ? TravelStep::to_purge : TravelStep::lift);
      }
    }
    if (via) add(*via, TravelStep::purge);
    if (over == Over::home && !from.station && !to.station) add(home(from), onward);
    if (to.station) {
      add(to, onward);
    } else {
      const auto lifted = at(to.tip + lift_to * to.axis, to.axis, to);
      if (!lifted) return std::nullopt;
      if (over_top > 0.0) {
        const auto raised = at(raised_tip(*lifted, over_top), lifted->axis, *lifted);
        const auto high = above(*lifted, over_top);
        if (!high || (over != Over::turning && !raised)) return std::nullopt;
        add(*high, onward);
        if (over != Over::turning) add(*raised, TravelStep::lower);
        add(*lifted, TravelStep::lower);
      } else {
        add(*lifted, onward);
      }
      add(to, TravelStep::lower);
    }
    return prove(stops, steps);
  }

  // The moves between stops, and whether head and arm stay clear on them.
  TravelPlan prove(const std::vector<TravelEnd>& stops, const std::vector<TravelStep>& steps) {
    TravelPlan plan;
    for (std::size_t i = 1; i < stops.size(); ++i) {
      const TravelEnd &a = stops[i - 1], &b = stops[i];
      // Along the nozzle's own axis the head only uncovers space that it filled, or will fill, while printing.
      const bool own_axis = !a.station && !b.station && a.branch == b.branch && a.yaw == b.yaw && a.axis == b.axis &&
                            (i == 1 || i + 1 == stops.size());
      const bool last_down = i + 1 == stops.size() && steps[i] == TravelStep::lower;
      plan.moves.push_back(own_axis || last_down ? linear(a, b, steps[i]) : joint(a, b, steps[i]));
      if (plan.clear && !own_axis) check(a, b, clearance_, plan);
      if (plan.clear && own_axis) check_pose(b.joints, 0.0, plan, false);
    }
    return plan;
  }

  void check(const TravelEnd& a, const TravelEnd& b, double clearance, TravelPlan& plan) {
    double turn = 0.0;
    for (int j = 0; j < 6; ++j) turn = std::max(turn, std::abs(b.joints[j] - a.joints[j]));
    const int samples = 1 + static_cast<int>(std::max(turn / kSampleStep_rad, (b.tip - a.tip).norm() / kSampleStep_mm));
    for (int s = 0; s <= samples && plan.clear; ++s) {
      const double t = static_cast<double>(s) / samples;
      Joints joints;
      for (int j = 0; j < 6; ++j) joints[j] = (1.0 - t) * a.joints[j] + t * b.joints[j];
      check_pose(joints, clearance, plan, true);
    }
  }

  void check_pose(const Joints& joints, double clearance, TravelPlan& plan, bool with_head) {
    Vec3 tip, axis;
    cell_.tip_of(joints, tip, axis);
    const auto touch = [&](const char* body, const Contact& contact) {
      plan.clear = false;
      plan.contact = contact;
      plan.body = body;
    };
    Contact contact;
    if (with_head) {
      if (!cell_.head_above_table(tip, axis)) return touch("head and platform", {kNone, tip, 0.0});
      if (deposit_.touches_head(cell_.head(), tip, axis, -1.0, clearance, before_, &contact))
        return touch("head", contact);
    }
    const double table = cell_.machine().platform.table_clearance_mm;
    for (const Cell::Capsule& link : cell_.links(joints)) {
      if (std::min(link.a.z(), link.b.z()) < table + link.radius) return touch(link.name, {kNone, link.b, 0.0});
      if (deposit_.touches_capsule(link.a, link.b, link.radius, clearance, before_, &contact))
        return touch(link.name, contact);
    }
  }

  Travel base(const TravelEnd& to, TravelStep step, TravelKind kind) const {
    Travel move;
    move.kind = kind;
    move.step = step;
    move.tip_mm = to.tip;
    move.axis = to.axis;
    move.pose = to.pose;
    move.joints = to.joints;
    return move;
  }

  Travel linear(const TravelEnd& from, const TravelEnd& to, TravelStep step) const {
    Travel move = base(to, step, TravelKind::linear);
    const Speeds& speeds = cell_.machine().speeds;
    move.speed_mm_s = speeds.approach_mm_s;
    move.duration_s =
        (to.tip - from.tip).norm() / move.speed_mm_s + 1e-3 * move.speed_mm_s / speeds.travel_acceleration_m_s2;
    return move;
  }

  Travel joint(const TravelEnd& from, const TravelEnd& to, TravelStep step) const {
    Travel move = base(to, step, TravelKind::joint);
    const Speeds& speeds = cell_.machine().speeds;
    double turn = 0.0;
    for (int j = 0; j < 6; ++j) turn = std::max(turn, std::abs(to.joints[j] - from.joints[j]));
    const double speed = speeds.joint_speed_deg_s * kPi / 180.0,
                 acceleration = speeds.joint_acceleration_deg_s2 * kPi / 180.0;
    const bool reaches_speed = turn > speed * speed / acceleration;
    move.duration_s = reaches_speed ? turn / speed + speed / acceleration : 2.0 * std::sqrt(turn / acceleration);
    move.speed_mm_s = speeds.travel_mm_s;
    return move;
  }

  TravelPlan direct(const TravelEnd& from, const TravelEnd& to) {
    TravelPlan plan;
    plan.moves.push_back(joint(from, to, to.station ? TravelStep::to_home : TravelStep::cross));
    plan.clear = false;
    plan.contact = {kNone, to.tip, 0.0};
    plan.body = nullptr;
    return plan;
  }

  const Cell& cell_;
  const Deposit& deposit_;
  Index before_;
  double clearance_ = 0.0, turn_ = 0.0;  // of the ways that are tried now
};

}  // namespace

TravelPlan plan_travel(const Cell& cell, const Deposit& deposit, const TravelEnd& from, const TravelEnd& to,
                       const TravelEnd* via, Index before) {
  return Planner(cell, deposit, before).plan(from, to, via);
}

}  // namespace curvesup
