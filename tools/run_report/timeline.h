// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <vector>

#include "mono3d/pipeline/reconstruction.h"
#include "run_report/lost_frames.h"
#include "run_report/overlap.h"

namespace mono3d::tools {

// Drawings as SVG, 960 wide, that take the colours of the page.

// Over the frames: which have a pose, keyframes, depth maps taken or refused, and how the model
// fared.
std::string TimelineSvg(const std::vector<FrameOutcome>& outcomes,
                        const Reconstruction& reconstruction, bool are_photos = false);

// Over the frames: the share of points that a keyframe has in common with the one before.
std::string OverlapSvg(const std::vector<KeyframeOverlap>& overlaps, bool are_photos = false);

}  // namespace mono3d::tools
