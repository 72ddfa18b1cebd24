// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <cmath>

#include "mono3d/core/error.h"
#include "mono3d/fusion/surfel_map.h"

namespace mono3d {

SurfelChanges SurfelMap::ChangesSince(std::uint64_t) { return {}; }

std::optional<UpdateResult> SurfelMap::Join(SurfelMap&, const KeyframePoses&) {
  return std::nullopt;
}

namespace {

[[noreturn]] void ThrowNotSaved() {
  throw Error("this kind of surfel model cannot be saved and gone on with",
              ErrorCode::kUnsupported);
}

}  // namespace

void SurfelMap::SaveState(StateFolder&, const std::string&) { ThrowNotSaved(); }

void SurfelMap::RestoreState(const StateFolder&, const std::string&) { ThrowNotSaved(); }

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

void RegistrationOptions::Visit(OptionVisitor& visit) {
  visit("enabled", enabled, "register depth maps with the model before they are fused");
  visit("moves", moves,
        "move them to where the model shows them; 0: judge them in place, as always with "
        "photographs");
  visit("with_scale", with_scale, "and the scale of their depths as well");
  visit("with_grey", with_grey, "point-to-plane and photometric; else point-to-plane alone");
  visit("max_misfit", max_misfit,
        "the tracker's pose stands while it misses the best one by less, in sigmas; in noisy "
        "images times their noise, up to 1");
  visit("prior_px", prior_px, "one sigma of a tracker that is wrong, as motion in the image");
  visit("prior_scale", prior_scale, "one sigma of its scale, of the logarithm");
  visit("grey_noise", grey_noise, "sigma of the difference of two views of one place, grey values");
  visit("grey_shift_px", grey_shift_px, "sigma of the place at which a surfel's colour was taken");
}

void RegistrationGateOptions::Visit(OptionVisitor& visit) {
  visit("min_overlap", min_overlap,
        "surfels in view per pixel below which a depth map starts a submap at the tracker's pose");
  visit("min_agreement", min_agreement, "share of them that must lie on its surface");
  visit("max_contradiction", max_contradiction, "share of them that it may see through");
  visit("max_residual", max_residual, "root mean square distance from the model, in sigmas");
  visit("max_grey_residual", max_grey_residual, "and of grey values");
  visit("max_noise", max_noise, "errors of a depth map, over those that it claims");
  visit("max_deviation_px", max_deviation_px, "from the tracker's pose, as motion in the image");
  visit("max_scale_deviation", max_scale_deviation, "from the tracker's scale, of its logarithm");
  visit("max_join_uncertainty_px", max_join_uncertainty_px,
        "one sigma of a pose that may move a submap of the model to another, in the image");
}

void SurfelExportOptions::Visit(OptionVisitor& visit) {
  visit("min_observations", min_observations,
        "depth maps that must agree on a surfel of the exported model");
  visit("min_confidence", min_confidence, "confidence that it must have, 0 to 1");
  visit("gap_confidence", gap_confidence,
        "confidence that is enough where nothing surer is near; 1: nothing fills such gaps");
  visit("min_share", min_share,
        "share of what was matched that is exported whatever its confidence");
  visit("voxel_radii", voxel_radii,
        "thin the exported model to one surfel in cells of this edge, in radii of the median "
        "surfel; 0: all");
  visit("with_inferred", with_inferred,
        "export as well, marked, what is only inferred from the surface around");
}

void SurfelExportOptions::Validate() const {
  RequireOption(min_observations >= 1, "fusion.export.min_observations", "1 or more",
                min_observations);
  RequireOption(min_confidence >= 0 && min_confidence < 1, "fusion.export.min_confidence",
                "in [0, 1)", min_confidence);
  RequireOption(gap_confidence >= 0 && gap_confidence <= 1, "fusion.export.gap_confidence",
                "in [0, 1]", gap_confidence);
  RequireOption(min_share >= 0 && min_share <= 1, "fusion.export.min_share", "in [0, 1]",
                min_share);
  RequireOption(voxel_radii >= 0 && std::isfinite(voxel_radii), "fusion.export.voxel_radii", ">= 0",
                voxel_radii);
}

void RetryOptions::Visit(OptionVisitor& visit) {
  visit("max_waiting", max_waiting, "depth maps kept that do not fit the model, to be tried again");
  visit("max_attempts", max_attempts, "how often each is tried");
  visit("num_recent", num_recent, "depth maps kept to repair the latest part of the model");
}

void HealthOptions::Visit(OptionVisitor& visit) {
  visit("num_registrations", num_registrations, "latest registrations that tell how the model is");
  visit("min_registrations", min_registrations, "fewer say nothing");
  visit("min_accepted_share", min_accepted_share, "of them; below it the model is broken");
  visit("good_accepted_share", good_accepted_share, "below it the model is degraded");
  visit("max_moved_share", max_moved_share, "of the accepted, not where the tracker has them");
  visit("max_depth_residual", max_depth_residual, "root mean square from the model, in sigmas");
  visit("max_scale_drift", max_scale_drift, "of the logarithm of the tracker's scale");
}

void SurfelStorageOptions::Visit(OptionVisitor& visit) {
  visit(
      "max_device_mb", max_device_mb,
      "surfels on the device, in MB; what no view has seen of late leaves it (0: a quarter of its "
      "memory)");
  visit("max_host_mb", max_host_mb,
        "of those that left it, in the memory of the host, in MB; the others are in a file (0: an "
        "eighth of the memory)");
  visit("folder", folder, "of that file, which has no name (empty: that of temporary files)");
}

void SurfelMapOptions::Visit(OptionVisitor& visit) {
  visit.Group("association", association);
  visit.Group("free_space", free_space);
  visit.Group("registration", registration);
  visit.Group("gate", gate);
  visit.Group("retry", retry);
  visit.Group("health", health);
  visit.Group("storage", storage);
  visit("with_confidence", with_confidence,
        "weigh the estimates of depth maps by their confidence; else all alike");
  visit("num_reviews", num_reviews, "past depth maps that review the surfels which a new one adds");
  visit("max_surfels", max_surfels, "size of the model beyond which it becomes coarser");
}

void SurfelMapOptions::Validate() const {
  const auto& a = association;
  RequireOption(a.matching_error_px > 0, "fusion.association.matching_error_px", "> 0",
                a.matching_error_px);
  RequireOption(a.max_sigmas > 0, "fusion.association.max_sigmas", "> 0", a.max_sigmas);
  RequireOption(a.max_normal_angle_deg > 0 && a.max_normal_angle_deg <= 180,
                "fusion.association.max_normal_angle_deg", "in (0, 180]", a.max_normal_angle_deg);
  RequireOption(free_space.min_sigmas >= a.max_sigmas, "fusion.free_space.min_sigmas",
                ">= association.max_sigmas", free_space.min_sigmas);
  RequireOption(registration.max_misfit >= 0, "fusion.registration.max_misfit", ">= 0",
                registration.max_misfit);
  RequireOption(registration.prior_px > 0, "fusion.registration.prior_px", "> 0",
                registration.prior_px);
  RequireOption(registration.prior_scale > 0, "fusion.registration.prior_scale", "> 0",
                registration.prior_scale);
  RequireOption(registration.grey_noise > 0, "fusion.registration.grey_noise", "> 0",
                registration.grey_noise);
  RequireOption(registration.grey_shift_px >= 0, "fusion.registration.grey_shift_px", ">= 0",
                registration.grey_shift_px);
  RequireOption(gate.min_overlap > 0 && gate.min_overlap <= 1, "fusion.gate.min_overlap",
                "in (0, 1]", gate.min_overlap);
  RequireOption(gate.min_agreement >= 0 && gate.min_agreement <= 1, "fusion.gate.min_agreement",
                "in [0, 1]", gate.min_agreement);
  RequireOption(gate.max_contradiction >= 0 && gate.max_contradiction <= 1,
                "fusion.gate.max_contradiction", "in [0, 1]", gate.max_contradiction);
  RequireOption(gate.max_residual > 0, "fusion.gate.max_residual", "> 0", gate.max_residual);
  RequireOption(gate.max_grey_residual > 0, "fusion.gate.max_grey_residual", "> 0",
                gate.max_grey_residual);
  RequireOption(gate.max_noise >= 1, "fusion.gate.max_noise", ">= 1", gate.max_noise);
  RequireOption(gate.max_deviation_px > 0, "fusion.gate.max_deviation_px", "> 0",
                gate.max_deviation_px);
  RequireOption(gate.max_scale_deviation > 0, "fusion.gate.max_scale_deviation", "> 0",
                gate.max_scale_deviation);
  RequireOption(gate.max_join_uncertainty_px > 0, "fusion.gate.max_join_uncertainty_px", "> 0",
                gate.max_join_uncertainty_px);
  RequireOption(num_reviews >= 0, "fusion.num_reviews", ">= 0", num_reviews);
  RequireOption(retry.max_waiting >= 0, "fusion.retry.max_waiting", ">= 0", retry.max_waiting);
  RequireOption(retry.max_attempts >= 1, "fusion.retry.max_attempts", ">= 1", retry.max_attempts);
  RequireOption(retry.num_recent >= 0, "fusion.retry.num_recent", ">= 0", retry.num_recent);
  RequireOption(health.num_registrations >= health.min_registrations,
                "fusion.health.num_registrations", ">= health.min_registrations",
                health.num_registrations);
  RequireOption(health.min_registrations >= 1, "fusion.health.min_registrations", ">= 1",
                health.min_registrations);
  RequireOption(storage.max_device_mb >= 0, "fusion.storage.max_device_mb", ">= 0",
                storage.max_device_mb);
  RequireOption(storage.max_host_mb >= 0, "fusion.storage.max_host_mb", ">= 0",
                storage.max_host_mb);
  RequireOption(max_surfels > 0, "fusion.max_surfels", "> 0", max_surfels);
}

}  // namespace mono3d
