#include <algorithm>
#include <cmath>
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
  explicit Heap(std::vector<Grain> grains) : grains_(std::move(grains)) {
    if (!grains_.empty()) split(0, grains_.size());
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
    std::size_t next;        // behind all that is inside this one
    std::size_t begin, end;  // of its grains; none unless it is a leaf
  };

  void split(std::size_t begin, std::size_t end) {
    Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::max()), high = -low;
    int earliest = std::numeric_limits<int>::max();
    for (std::size_t i = begin; i < end; ++i) {
      const Eigen::Vector3f at(grains_[i].x, grains_[i].y, grains_[i].z);
      low = low.cwiseMin(at);
      high = high.cwiseMax(at);
      earliest = std::min(earliest, grains_[i].order);
    }
    const Eigen::Vector3f size = high - low, half_size = 0.5f * size + Eigen::Vector3f::Constant(1e-3f);
    const std::size_t node = nodes_.size();
    const bool leaf = end - begin <= kLeaf;
    nodes_.push_back({{0.5f * (low + high), half_size, half_size.norm()}, earliest, 0, begin, leaf ? end : begin});
    if (!leaf) {
      int side = 0;
      size.maxCoeff(&side);
      const auto value = [side](const Grain& grain) { return side == 0 ? grain.x : side == 1 ? grain.y : grain.z; };
      const std::size_t half = begin + (end - begin) / 2;
      const auto first = grains_.begin();
      std::nth_element(first + static_cast<std::ptrdiff_t>(begin), first + static_cast<std::ptrdiff_t>(half),
                       first + static_cast<std::ptrdiff_t>(end), [&](const Grain& a, const Grain& b) { return value(a) < value(b); });
      split(begin, half);
      split(half, end);
    }
    nodes_[node].next = nodes_.size();
  }

  static constexpr std::size_t kLeaf = 24;
  std::vector<Grain> grains_;
  std::vector<Node> nodes_;  // each before those inside it
};

// Cone with a flat tip, then a cylinder.
class Head {
 public:
  explicit Head(const Tool& tool) : tool_(tool), sine_(tool.cone_half_angle.sin()), cosine_(tool.cone_half_angle.cos()) {}

  // Of a point at that height above the tip plane and that far from the axis: exact inside, no more than the distance
  // outside.
  [[nodiscard]] double distance(double height, double radius) const {
    const double flank = (radius - tool_.tip_radius_mm) * cosine_ - height * sine_;
    const double cone = std::max({-height, height - tool_.cone_length_mm, flank});
    const double cylinder = std::max({tool_.cone_length_mm - height, height - tool_.head_length_mm, radius - tool_.head_radius_mm});
    return std::min(cone, cylinder);
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
  ClearanceCheck(const Programs& programs, const std::vector<PathBead>& beads, const Machine& machine)
      : programs_(programs), beads_(beads), machine_(machine), platform_(frame_of(machine.platform.pose)), head_(machine.tool), heap_(grains()) {}

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
    double passed = 0.0;
    int path = -1;
    for (const Chain& chain : programs_.chains) {
      if (chain.path != path) passed = 0.0;
      path = chain.path;
      passed_.push_back(passed);
      for (std::size_t k = 0; k < chain.moves; ++k) {
        const JobMove& move = programs_.job.moves[chain.job_first + k];
        const double length = move.length_mm();
        const int pieces = move.e_mm > 0.0 ? 1 + static_cast<int>(length / kGrain_mm) : 0;
        for (int i = 1; i <= pieces; ++i) {
          const double share = static_cast<double>(i) / pieces;
          const Eigen::Vector3f at = (move.from_mm + share * (move.tip_mm - move.from_mm)).cast<float>();
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
      const double length = programs_.job.moves[chain.job_first + k].length_mm();
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
        const ArmFrame tool = tool_frame_at(machine_.arm, part.tcp, joints);
        Look look = look_of(tool);
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
  [[nodiscard]] Look look_of(const Pose& pose) const { return look_of(frame_of(pose)); }
  [[nodiscard]] Vec3 in_platform(const Vec3& metres) const { return 1000.0 * (platform_.rotation.transpose() * (metres - platform_.position)); }

  void check_head(const Look& look, const Place& place, Findings& findings) const {
    const double table = machine_.platform.table_clearance_mm - kSlack_mm;
    findings.expect(head_.lowest(look.tip, look.axis) >= table, Rule::clearance, place, "the head touches the platform");
    const auto height_of = [&](const Vec3& at) { return (at - look.tip).dot(look.axis); };
    const auto distance_of = [&](const Vec3& at, double height) {
      return head_.distance(height, std::sqrt(std::max(0.0, (at - look.tip).squaredNorm() - height * height)));
    };
    const Grain* touched = heap_.find(
        look.order,
        [&](const Heap::Box& box) {
          const Vec3 middle = box.middle.cast<double>();
          const double height = height_of(middle), reach = look.axis.cwiseAbs().dot(box.half.cast<double>());
          return height + reach <= look.own_mm || distance_of(middle, height) - box.radius >= -kSlack_mm;
        },
        [&](const Grain& grain) {
          if (grain.path == look.path && grain.passed > look.hard_mm) return false;
          const double height = height_of(grain.at());
          return height > look.own_mm && distance_of(grain.at(), height) < -kSlack_mm;
        });
    if (touched) findings.fail(Rule::clearance, place, "the head touches what path " + std::to_string(touched->path) + " has laid");
  }

  void check_links(const Joints& joints, int order, const Place& place, Findings& findings) const {
    const std::array<Vec3, 5> points = link_points_at(machine_.arm, joints);
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
  std::vector<double> passed_;  // of its path, before each chain
  Heap heap_;
};

}  // namespace

void check_clearance(const Programs& programs, const std::vector<PathBead>& beads, const Machine& machine, const RunContext& run, Findings& findings) {
  ClearanceCheck(programs, beads, machine).run(run, findings);
}

}  // namespace curvesup::emitted
