// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "fusion/anchor.h"
#include "fusion/registration/problem.h"
#include "mono3d/image/keyframe_constraint.h"

namespace mono3d {

// What a registration knows of the pose that it has found, without the prior, in the order of
// RegistrationSystem: the residuals of pixels whose windows overlap count as one, and up to
// `max_misfit` of a sigma may be common to all of them; where they are larger than expected, so
// are the errors.
Matrix7d InformationOf(const RegistrationSystem& system, std::uint32_t stride,
                       const RegistrationOptions& options);

// The anchor with which to compare a keyframe that shows these blocks of surfels: the oldest of
// those that have a tenth of them, else that of most. What the tracker has drifted since then shows
// against the oldest one; anchors of late have drifted with it. `anchors`: per block of the model.
std::optional<std::uint32_t> AnchorToTellOf(std::span<const std::uint32_t> blocks,
                                            std::span<const std::uint32_t> anchors);

// What a depth map says of its keyframe that was registered where `placed` is, with `information`,
// in the own units of the keyframes.
KeyframeConstraint MakeConstraint(const PlacedAnchor& placed, const Matrix7d& information,
                                  const PlacedAnchor& anchor);

}  // namespace mono3d
