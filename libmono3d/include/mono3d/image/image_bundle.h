// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/image/keyframe.h"
#include "mono3d/image/keyframe_poses.h"

namespace MONO3D_EXPORT mono3d {

// The images from which one depth map is made: those of one side, the reference, those of the other
// side (paper, section 3.1: five, in the order of flight). A point that is hidden from the images
// of one side should be in view of the other's: the sides are before and after the reference in a
// flight, left and right of it among photographs. Where all images lie on one side of the
// reference, the nearer ones, from which less is hidden, are to be one side and the farther ones
// the other.
struct ImageBundle {
  std::vector<Keyframe> keyframes;
  // Of each keyframe: from its camera frame into that of the reference, whose own unit of length
  // is that of the translations. Identity for the reference.
  std::vector<Pose> T_ref_cam;

  // Images on the first side. Empty: half of them, the reference is the one in the middle.
  std::optional<std::size_t> num_first_side = {};

  std::size_t reference_index() const { return num_first_side.value_or(keyframes.size() / 2); }
  const Keyframe& reference() const { return keyframes[reference_index()]; }
};

inline constexpr std::size_t kBundleSize = 5;  // by default
inline constexpr std::size_t kMinBundleSize = 3;
inline constexpr std::size_t kMaxBundleSize = 9;
inline constexpr std::size_t kMaxSideSize = 4;
inline constexpr const char* kBundleSizesText = "3, 5, 7 or 9";  // for messages

// Is it odd, so that there can be as many images on both sides of the reference, and from 3 to 9?
constexpr bool IsBundleSize(std::size_t num_images) {
  return num_images % 2 == 1 && num_images >= kMinBundleSize && num_images <= kMaxBundleSize;
}

// Throws Error unless there are 3 to 9 keyframes, 1 to 4 of them on each side of the reference,
// with valid frames of one size and a finite pose each.
void Validate(const ImageBundle& bundle);

// Sets T_ref_cam from these poses. False, with the bundle as it was, where a keyframe is not known
// or the keyframes are not of one map.
[[nodiscard]] bool SetPoses(const KeyframePoses& poses, ImageBundle& bundle);

// The same from poses in one world, one for each keyframe in their order. The unit of that world is
// the own unit of the reference. Throws Error unless there are as many as keyframes.
void SetPoses(std::span<const Pose> T_world_cam, ImageBundle& bundle);

// The same with images of half the width and height; of odd ones the last pixel is shared out.
ImageBundle HalfSize(const ImageBundle& bundle);

}  // namespace mono3d
