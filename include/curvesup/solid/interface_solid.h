#pragma once

#include <memory>
#include <span>
#include <vector>

#include "curvesup/model/model.h"
#include "curvesup/overhang/overhang.h"
#include "curvesup/solid/convolution_solid.h"
#include "curvesup/solid/solid.h"

namespace curvesup {

struct InterfaceOptions {
  int interface_layers = 0;   // full layers under the overhang; 0: none
  double top_gap_mm = 0.0;    // between support and overhang, along d_p
  double side_gap_mm = 0.0;   // between support and the model's walls
};

// Where a trunk comes out of the model that it stands on.
struct Contact {
  Vec3 centre = Vec3::Zero();
  double radius_mm = 0.0;  // of the ball that holds the trunk's cone up to where it is as wide as the trunk
};
[[nodiscard]] std::vector<Contact> contacts_of(const Skeleton& skeleton, std::span<const ModelStand> stands);

// A solid with what touches the model changed. Added: all points from which a line along d_p meets the overhang within
// interface_layers layers; so the added part lies under the overhang's own projection. Taken away: all points from which such
// a line meets the overhang within top_gap_mm, and those nearer than side_gap_mm to a wall, a face that leans less than 45
// degrees off d_p. In the contacts no wall is kept off: a trunk on a slope would hang in the air; around them the distance grows
// to side_gap_mm. d_p and the layers' thickness are those of the overhang face nearest to the point. Values are in mm near
// the model and those of `base` elsewhere; only their signs mean something where both meet. Gives `base` itself when nothing
// is asked for. `field` is the one on the model. Throws Error{usage} on negative options.
[[nodiscard]] std::shared_ptr<const Solid> with_interface(std::shared_ptr<const Solid> base, const Model& model, const ScalarField& field,
                                                          const Overhang& overhang, int layer_count, const InterfaceOptions& options,
                                                          std::span<const Contact> contacts = {});

}  // namespace curvesup
