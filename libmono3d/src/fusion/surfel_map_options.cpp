// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/fusion/surfel_map.h"

namespace mono3d {

void AssociationOptions::Visit(OptionVisitor& visit) {
  visit("matching_error_px", matching_error_px, "one sigma of the matching behind the depth maps");
  visit("max_sigmas", max_sigmas,
        "a pixel and a surfel are one surface up to this depth difference, in sigmas");
  visit("max_normal_angle_deg", max_normal_angle_deg, "and up to this angle between the normals");
}

void FreeSpaceOptions::Visit(OptionVisitor& visit) {
  visit("min_sigmas", min_sigmas,
        "a surfel is seen through when it stands this far in front, in sigmas of depth");
}

void SurfelMapOptions::Visit(OptionVisitor& visit) {
  visit.Group("association", association);
  visit.Group("free_space", free_space);
  visit("max_surfels", max_surfels, "size of the model beyond which depth maps are rejected");
}

void SurfelMapOptions::Validate() const {
  const auto& a = association;
  RequireOption(a.matching_error_px > 0, "association.matching_error_px", "> 0",
                a.matching_error_px);
  RequireOption(a.max_sigmas > 0, "association.max_sigmas", "> 0", a.max_sigmas);
  RequireOption(a.max_normal_angle_deg > 0 && a.max_normal_angle_deg <= 180,
                "association.max_normal_angle_deg", "in (0, 180]", a.max_normal_angle_deg);
  RequireOption(free_space.min_sigmas >= a.max_sigmas, "free_space.min_sigmas",
                ">= association.max_sigmas", free_space.min_sigmas);
  RequireOption(max_surfels > 0, "max_surfels", "> 0", max_surfels);
}

}  // namespace mono3d
