#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "check/emitted_sync.h"
#include "curvesup/core/parallel.h"

namespace curvesup::emitted {

namespace {

constexpr double kGrain_mm = 1.0;      // of beads
constexpr double kPose_mm = 2.0;       // of path between poses that are looked at ...
constexpr double kPoseTurn = 0.05;     // ... and turn of the nozzle's axis between them
constexpr double kLinkPose_mm = 10.0;  // the same for forearm and wrist
constexpr double kSlack_mm = 0.15;     // beads are known at grains and as polylines within their tolerance
constexpr double kOwn_mm = 0.3;        // above the tip plane, at least, is the nozzle's own bead
constexpr double kSoftWidths = 3.0;    // behind the nozzle a bead is still soft ...
constexpr double kSoft_mm = 3.0;       // ... and a segment more
constexpr double kFoot_mm = 1.0;       // of the nozzle may dip below a platform that it prints on
constexpr int kTravelPoses = 4;

// A place on top of a bead.
struct Grain {
  float x, y, z;
  int order;     // of its move in the job
  int path;
  float passed;  // length of the path up to it
  [[nodiscard]] Vec3 at() const { return {x, y, z}; }
};

// All grains of the print, halved along the longest side again and again; each half knows when its first grain is laid.
class Heap {
 public:
  // The first halvings leave parts for the threads. A part's root is behind the part before: they need no node above them.
  Heap(std::vector<Grain> grains, const RunContext& run) : grains_(std::move(grains)) {
    if (grains_.empty()) return;
    std::vector<Range> parts = {{0, grains_.size()}};
    for (int halving = 0; halving < kHalvings; ++halving) {
      std::vector<Range> halves;
      for (const Range& part : parts) {
        const std::size_t middle = halve(part, box_of(part).half);
        halves.insert(halves.end(), {{part.begin, middle}, {middle, part.end}});
      }
      parts = std::move(halves);
    }
    std::vector<std::vector<Node>> nodes(parts.size());
    parallel_for(parts.size(), 1, run, [&](std::size_t i, std::size_t, std::size_t) {
      if (parts[i].begin < parts[i].end) split(parts[i], nodes[i]);
    });
    for (const std::vector<Node>& some : nodes) {
      const auto before = static_cast<std::uint32_t>(nodes_.size());
      nodes_.insert(nodes_.end(), some.begin(), some.end());
      for (std::size_t n = before; n < nodes_.size(); ++n) nodes_[n].next += before;
    }
  }

  // A box around grains, and the sphere around it.
  struct Box {
    Eigen::Vector3f middle, half;
    float radius;
  };

  // The first grain laid before `order` for which hit(grain) holds; boxes are left out for which skip(box) holds.
  template <class Skip, class Hit>
  [[nodiscard]] const Grain* find(int order, const Skip& skip, const Hit& hit) const {
    for (std::size_t n = 0; n < nodes_.size();) {
      const Node& node = nodes_[n];
      if (node.earliest >= order || skip(node.box)) {
        n = node.next;
        continue;
      }
      for (std::size_t i = node.begin; i < node.end; ++i) {
        if (grains_[i].order < order && hit(grains_[i])) return &grains_[i];
      }
      ++n;
    }
    return nullptr;
  }

 private:
  struct Node {
    Box box;
    int earliest;
    std::uint32_t next;        // behind all that is inside this one
    std::uint32_t begin, end;  // of its grains; none unless it is a leaf
  };

  struct Range {
    std::size_t begin, end;
  };

  [[nodiscard]] Box box_of(const Range& range) const {
    Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::max()), high = -low;
    for (std::size_t i = range.begin; i < range.end; ++i) {
      const Eigen::Vector3f at(grains_[i].x, grains_[i].y, grains_[i].z);
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
    }
    const Eigen::Vector3f half = 0.5f * (high - low) + Eigen::Vector3f::Constant(1e-3f);
    return {0.5f * (low + high), half, half.norm()};
  }

  // Puts the lower half along the longest side first.
  std::size_t halve(const Range& range, const Eigen::Vector3f& size) {
    int side = 0;
    size.maxCoeff(&side);
    const auto value = [side](const Grain& grain) { return side == 0 ? grain.x : side == 1 ? grain.y : grain.z; };
    const std::size_t middle = range.begin + (range.end - range.begin) / 2;
    const auto first = grains_.begin();
    std::nth_element(first + static_cast<std::ptrdiff_t>(range.begin), first + static_cast<std::ptrdiff_t>(middle),
                     first + static_cast<std::ptrdiff_t>(range.end), [&](const Grain& a, const Grain& b) { return value(a) < value(b); });
    return middle;
  }

  void split(const Range& range, std::vector<Node>& nodes) {
    const Box box = box_of(range);
    int earliest = std::numeric_limits<int>::max();
    for (std::size_t i = range.begin; i < range.end; ++i) earliest = std::min(earliest, grains_[i].order);
    const bool leaf = range.end - range.begin <= kLeaf;
    const std::size_t node = nodes.size();
    nodes.push_back({box, earliest, 0, static_cast<std::uint32_t>(range.begin), static_cast<std::uint32_t>(leaf ? range.end : range.begin)});
    if (!leaf) {
      const std::size_t middle = halve(range, box.half);
      split({range.begin, middle}, nodes);
      split({middle, range.end}, nodes);
    }
    nodes[node].next = static_cast<std::uint32_t>(nodes.size());
  }

  static constexpr std::size_t kLeaf = 24;
  static constexpr int kHalvings = 4;
  std::vector<Grain> grains_;
  std::vector<Node> nodes_;  // each before those inside it
};

// Cone with a flat tip, then a cylinder.
class Head {
 public:
  explicit Head(const Tool& tool) : tool_(tool), sine_(tool.cone_half_angle.sin()), cosine_(tool.cone_half_angle.cos()) {}

  // Whether a point at that height above the tip plane and at that distance from the axis, squared, is at least `apart`
  // away: exact for points inside the head, where `apart` is negative; no more than true outside.
  [[nodiscard]] bool clears(double height, double squared, double apart) const {
    const auto beyond = [squared](double radius) { return radius <= 0.0 || squared >= radius * radius; };
    const bool cone = height <= -apart || height >= tool_.cone_length_mm + apart || beyond(tool_.tip_radius_mm + (apart + height * sine_) / cosine_);
    return cone && (height <= tool_.cone_length_mm - apart || height >= tool_.head_length_mm + apart || beyond(tool_.head_radius_mm + apart));
  }
  // Lowest z of all but its foot.
  [[nodiscard]] double lowest(const Vec3& tip, const Vec3& axis) const {
    const double level = std::sqrt(std::max(0.0, 1.0 - axis.z() * axis.z())), slope = sine_ / cosine_;
    const auto ring = [&](double height, double radius) { return tip.z() + height * axis.z() - radius * level; };
    return std::min({ring(kFoot_mm, tool_.tip_radius_mm + slope * kFoot_mm),
                     ring(tool_.cone_length_mm, tool_.tip_radius_mm + slope * tool_.cone_length_mm),
                     ring(tool_.cone_length_mm, tool_.head_radius_mm), ring(tool_.head_length_mm, tool_.head_radius_mm)});
  }

 private:
  const Tool& tool_;
  double sine_, cosine_;
};

class ClearanceCheck {
 public:
  ClearanceCheck(const Programs& programs, const std::vector<PathBead>& beads, const Machine& machine, const RunContext& run)
      : programs_(programs), beads_(beads), machine_(machine), platform_(frame_of(machine.platform.pose)), head_(machine.tool), links_(machine.arm), heap_(grains(), run) {}

  void run(const RunContext& run, Findings& findings) {
    constexpr std::size_t kTogether = 64;
    std::vector<Findings> found(chunk_count(programs_.chains.size(), kTogether));
    parallel_for(programs_.chains.size(), kTogether, run, [&](std::size_t begin, std::size_t end, std::size_t chunk) {
      for (std::size_t c = begin; c < end; ++c) {
        check_travels(c, found[chunk]);
        check_chain(c, found[chunk]);
      }
    });
    for (const Findings& some : found) findings.merge(some);
  }

 private:
  // What is laid: the tops of beads lie where the nozzle's tip passes.
  std::vector<Grain> grains() {
    std::vector<Grain> grains;
    // About as many as millimetres and moves; what is not used costs no memory.
    double length_mm = 0.0;
    for (std::size_t i = 0; i < programs_.job.moves.size(); ++i) length_mm += programs_.job.length_mm(i);
    grains.reserve(programs_.job.moves.size() + static_cast<std::size_t>(length_mm / kGrain_mm));
    double passed = 0.0;
    int path = -1;
    for (const Chain& chain : programs_.chains) {
      if (chain.path != path) passed = 0.0;
      path = chain.path;
      passed_.push_back(passed);
      for (std::size_t k = 0; k < chain.moves; ++k) {
        const JobMove& move = programs_.job.moves[chain.job_first + k];
        const Vec3 from = programs_.job.from_mm(chain.job_first + k), way = move.tip_mm.vec() - from;
        const double length = way.norm();
        const int pieces = move.e_mm > 0.0f ? 1 + static_cast<int>(length / kGrain_mm) : 0;
        for (int i = 1; i <= pieces; ++i) {
          const double share = static_cast<double>(i) / pieces;
          const Eigen::Vector3f at = (from + share * way).cast<float>();
          grains.push_back({at.x(), at.y(), at.z(), static_cast<int>(chain.job_first + k), path, static_cast<float>(passed + share * length)});
        }
        passed += length;
      }
    }
    return grains;
  }

  // A pose of the head, and what counts as laid then.
  struct Look {
    Vec3 tip, axis;
    int order = 0;
    double own_mm = 0.0;
    int path = -1;
    double hard_mm = 0.0;  // of that path, what was laid farther back
  };

  void check_chain(std::size_t c, Findings& findings) const {
    const Chain& chain = programs_.chains[c];
    const RobotPart& part = programs_.parts[chain.part];
    const bool known = chain.path >= 0 && chain.path < static_cast<int>(beads_.size());
    const PathBead bead = known ? beads_[static_cast<std::size_t>(chain.path)] : PathBead{};
    double passed = passed_[c], since = kPose_mm, since_links = kLinkPose_mm;
    Vec3 axis = Vec3::Zero();  // of the last pose that was looked at
    for (std::size_t k = 0; k < chain.moves; ++k) {
      const double length = programs_.job.length_mm(chain.job_first + k);
      passed += length;
      since += length;
      since_links += length;
      const RobotMove& move = part.moves[chain.robot_first + k];
      Look look = look_of(move.pose);
      const bool turned = (look.axis - axis).squaredNorm() > kPoseTurn * kPoseTurn;
      if (since < kPose_mm && !turned && k + 1 < chain.moves) continue;
      since = 0.0;
      axis = look.axis;
      look.order = static_cast<int>(chain.job_first + k);
      look.own_mm = std::max(kOwn_mm, bead.height_mm);
      look.path = chain.path;
      look.hard_mm = passed - kSoftWidths * bead.width_mm - kSoft_mm;
      const Place place{part.file, move.line};
      check_head(look, place, findings);
      if (since_links < kLinkPose_mm && k + 1 < chain.moves) continue;
      since_links = 0.0;
      if (move.solved) check_links(move.reached, look.order, place, findings);
    }
  }

  // Joint moves before a chain; straight ones follow the nozzle, which rule 20 looks at.
  void check_travels(std::size_t c, Findings& findings) const {
    const Chain& chain = programs_.chains[c];
    const RobotPart& part = programs_.parts[chain.part];
    const bool same_part = c > 0 && programs_.chains[c - 1].part == chain.part;
    const std::size_t first = same_part ? programs_.chains[c - 1].robot_first + programs_.chains[c - 1].moves : 1;
    for (std::size_t i = std::max<std::size_t>(1, first); i < chain.robot_first; ++i) {
      const RobotMove &from = part.moves[i - 1], &to = part.moves[i];
      if (to.kind != RobotMove::Kind::joint || !from.solved || !to.solved) continue;
      for (int s = 1; s <= kTravelPoses; ++s) {
        const double share = static_cast<double>(s) / kTravelPoses;
        Joints joints;
        for (std::size_t j = 0; j < 6; ++j) joints[j] = (1.0 - share) * from.reached[j] + share * to.reached[j];
        Look look = look_of(links_.tool(joints, part.tcp));
        look.order = static_cast<int>(chain.job_first);
        const Place place{part.file, to.line};
        check_head(look, place, findings);
        check_links(joints, look.order, place, findings);
      }
    }
  }

  [[nodiscard]] Look look_of(const ArmFrame& tool) const {
    Look look;
    look.tip = in_platform(tool.position);
    look.axis = platform_.rotation.transpose() * tool.rotation.col(2);
    return look;
  }
  [[nodiscard]] Look look_of(const Pose& pose) const {
    Look look;
    look.tip = in_platform(pose.position_m);
    look.axis = platform_.rotation.transpose() * tool_axis(pose.rotation_vector);
    return look;
  }
  [[nodiscard]] Vec3 in_platform(const Vec3& metres) const { return 1000.0 * (platform_.rotation.transpose() * (metres - platform_.position)); }

  void check_head(const Look& look, const Place& place, Findings& findings) const {
    const double table = machine_.platform.table_clearance_mm - kSlack_mm;
    findings.expect(head_.lowest(look.tip, look.axis) >= table, Rule::clearance, place, "the head touches the platform");
    const Vec3 lean = look.axis.cwiseAbs();
    const auto clears = [&](const Vec3& way, double height, double apart) { return head_.clears(height, way.squaredNorm() - height * height, apart); };
    const Grain* touched = heap_.find(
        look.order,
        [&](const Heap::Box& box) {
          const Vec3 way = box.middle.cast<double>() - look.tip;
          const double height = way.dot(look.axis);
          return height + lean.dot(box.half.cast<double>()) <= look.own_mm || clears(way, height, static_cast<double>(box.radius) - kSlack_mm);
        },
        [&](const Grain& grain) {
          const Vec3 way = grain.at() - look.tip;
          const double height = way.dot(look.axis);
          if (height <= look.own_mm || (grain.path == look.path && grain.passed > look.hard_mm)) return false;
          return !clears(way, height, -kSlack_mm);
        });
    if (touched) findings.fail(Rule::clearance, place, "the head touches what path " + std::to_string(touched->path) + " has laid");
  }

  void check_links(const Joints& joints, int order, const Place& place, Findings& findings) const {
    const std::array<Vec3, 5> points = links_.points(joints);
    const ArmBody& body = machine_.arm.body;
    for (std::size_t i = 0; i + 1 < points.size(); ++i) {
      const Vec3 a = in_platform(points[i]), along = in_platform(points[i + 1]) - a;
      const double radius = (i == 0 ? body.forearm_radius_mm : body.wrist_radius_mm) - kSlack_mm;
      const double table = machine_.platform.table_clearance_mm;
      findings.expect(std::min(a.z(), a.z() + along.z()) >= table + radius, Rule::clearance, place, "a link of the arm touches the platform");
      const auto distance_of = [&](const Vec3& at) {
        const double share = std::clamp((at - a).dot(along) / std::max(1e-9, along.squaredNorm()), 0.0, 1.0);
        return (at - a - share * along).norm() - radius;
      };
      const Grain* touched = heap_.find(
          order, [&](const Heap::Box& box) { return distance_of(box.middle.cast<double>()) >= box.radius; },
          [&](const Grain& grain) { return distance_of(grain.at()) < 0.0; });
      if (touched) findings.fail(Rule::clearance, place, "a link of the arm touches what path " + std::to_string(touched->path) + " has laid");
    }
  }

  const Programs& programs_;
  const std::vector<PathBead>& beads_;
  const Machine& machine_;
  ArmFrame platform_;
  Head head_;
  ArmLinks links_;
  std::vector<double> passed_;  // of its path, before each chain
  Heap heap_;
};

}  // namespace

void check_clearance(const Programs& programs, const std::vector<PathBead>& beads, const Machine& machine, const RunContext& run, Findings& findings) {
  ClearanceCheck(programs, beads, machine, run).run(run, findings);
}

}  // namespace curvesup::emitted
