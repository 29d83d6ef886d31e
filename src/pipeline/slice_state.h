#pragma once

#include <memory>
#include <vector>

#include "curvesup/check/support_certificate.h"
#include "curvesup/check/toolpath_certificate.h"
#include "curvesup/emit/emit.h"
#include "curvesup/extension/extension.h"
#include "curvesup/field/field.h"
#include "curvesup/layers/layers.h"
#include "curvesup/model/place.h"
#include "curvesup/motion/motion.h"
#include "curvesup/pipeline/slice.h"
#include "curvesup/skeleton/grow_skeleton.h"
#include "curvesup/solid/solid.h"
#include "curvesup/toolpath/plan_toolpaths.h"
#include "curvesup/trim/trim.h"

namespace curvesup {

// What the stages hand on: each fills its own result and never edits an earlier one. What only one stage reads is large
// and goes when that stage is done: the hull's surface with `domain`, untrimmed layers and the solid with `trim`. Poses of
// a print that the robot cannot make go before anything is written.
struct SliceState {
  // Resolves the config; throws Error{usage}.
  explicit SliceState(const SliceRequest& asked) : request(asked), config(resolve_config(asked.config)) {}

  const SliceRequest& request;
  Json config;  // resolved
  std::filesystem::path spool_folder;  // for text between `emit` and its files; empty: it stays in memory

  std::string input_sha256;
  ModelResult model;
  FieldResult field;
  int layer_count = 0;
  Overhang overhang;
  bool supported = false;  // there is an overhang, and the config wants support
  HullResult hull;
  DomainResult domain;
  ExtensionResult extension;
  LayersResult layers;
  SkeletonResult skeleton;
  std::shared_ptr<const Solid> solid;
  TrimResult trim;
  ToolpathResult toolpath;
  SupportCertificate certificate;
  ToolpathCertificate toolpath_certificate;
  MotionResult motion;
  EmittedFiles emitted;

  Json report = Json::object();
  std::vector<Check> checks;
  std::size_t stages_done = 0;

  void add_checks(const std::vector<Check>& more) { checks.insert(checks.end(), more.begin(), more.end()); }
  [[nodiscard]] bool robot_ok() const {
    return motion.report.unreachable.empty() && motion.report.collisions.empty();
  }
};

struct Stage {
  const char* name;
  double share;  // of the whole run, for progress
  void (*run)(SliceState&, const RunContext&);
};

}  // namespace curvesup
