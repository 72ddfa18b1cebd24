// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <map>
#include <span>

#include "mono3d/image/image_bundle.h"
#include "mono3d/image/keyframe_correction.h"

namespace mono3d {

// Corrections give scales over those of the time at which a keyframe was handed out. Here is what
// they are by now, so that what was made of keyframes in between can be scaled by the rest.
class KeyframeScales {
 public:
  void Take(std::span<const KeyframeCorrection> corrections);
  double Of(std::int64_t keyframe_id) const;  // 1 where none was corrected

 private:
  std::map<std::int64_t, double> scales_;
};

// The keyframes of a bundle that was made when scales were `scales` go where they are now.
void MoveBundle(std::span<const KeyframeCorrection> corrections, const KeyframeScales& scales,
                ImageBundle& bundle);

}  // namespace mono3d
