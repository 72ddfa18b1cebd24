// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/render_options.h"

namespace mono3d::synthetic {

void RenderOptions::Visit(OptionVisitor& visit) {
  visit("samples_per_side", samples_per_side, "samples a pixel, squared");
  visit("with_depth", with_depth, "render the depth image as well");
  visit.Group("sensor", sensor);
}

void RenderOptions::Validate() const {
  RequireOption(samples_per_side >= 1 && samples_per_side <= 16, "samples_per_side", "1 to 16",
                samples_per_side);
  sensor.Validate();
}

}  // namespace mono3d::synthetic
