// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <vector>

#include "mono3d/image/keyframe.h"

namespace mono3d {

// The images from which one depth map is made, in the order of flight: an odd number, the middle
// one is the reference (paper, section 3.1: five).
struct ImageBundle {
  std::vector<Keyframe> keyframes;

  std::size_t reference_index() const { return keyframes.size() / 2; }
  const Keyframe& reference() const { return keyframes[reference_index()]; }
};

inline constexpr std::size_t kBundleSize = 5;  // by default
inline constexpr std::size_t kMinBundleSize = 3;
inline constexpr std::size_t kMaxBundleSize = 9;
inline constexpr const char* kBundleSizesText = "3, 5, 7 or 9";  // for messages

// Is it odd, so that half the images lie before the reference and half after it, and from 3 to 9?
constexpr bool IsBundleSize(std::size_t num_images) {
  return num_images % 2 == 1 && num_images >= kMinBundleSize && num_images <= kMaxBundleSize;
}

// Throws Error unless IsBundleSize() keyframes of one map are there, with valid frames of one size
// and finite poses.
void Validate(const ImageBundle& bundle);

}  // namespace mono3d
