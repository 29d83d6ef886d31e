#pragma once

#include "curvesup/solid/convolution_solid.h"
#include "curvesup/solid/interface_solid.h"
#include "slice_state.h"

namespace curvesup {

enum class SupportMethod { tree, envelope, none };

// Which solid cuts the support's layers.
struct SolidOptions {
  SupportMethod method = SupportMethod::tree;
  double envelope_alpha_mm = 8.0;
  ConvolutionOptions convolution;
  InterfaceOptions interface;
};

// The options of each stage, read from a resolved config. This is the only place where config keys meet option structs.
[[nodiscard]] PlaceOptions place_options(const Json& config);
[[nodiscard]] FieldOptions field_options(const Json& config);
[[nodiscard]] OverhangOptions overhang_options(const Json& config, const ConfigSource& source);
[[nodiscard]] HullOptions hull_options(const Json& config);
[[nodiscard]] DomainOptions domain_options(const Json& config);
[[nodiscard]] ExtensionOptions extension_options(const Json& config);
[[nodiscard]] SkeletonOptions skeleton_options(const Json& config);
[[nodiscard]] SolidOptions solid_options(const Json& config);
[[nodiscard]] TrimOptions trim_options(const Json& config);
[[nodiscard]] SupportCertificateOptions certificate_options(const Json& config);
[[nodiscard]] ToolpathCertificateOptions toolpath_certificate_options(const Json& config);
[[nodiscard]] ToolpathOptions toolpath_options(const Json& config);

}  // namespace curvesup
