// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "mono3d/image/keyframe.h"

namespace mono3d {

// The images from which one depth map is made, in the order of flight: five of them, the middle one
// is the reference (paper, section 3.1).
struct ImageBundle {
  std::vector<Keyframe> keyframes;

  std::size_t reference_index() const { return keyframes.size() / 2; }
  const Keyframe& reference() const { return keyframes[reference_index()]; }
};

inline constexpr std::size_t kBundleSize = 5;

// Throws Error unless there are kBundleSize keyframes of one map with valid frames of one size.
void Validate(const ImageBundle& bundle);

}  // namespace mono3d
