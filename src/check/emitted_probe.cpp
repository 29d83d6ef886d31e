#include "check/emitted_script.h"

namespace curvesup::emitted {
void probe_waits(RobotPart&, const Machine&) {}
}  // namespace curvesup::emitted
