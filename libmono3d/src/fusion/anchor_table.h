// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <memory>
#include <span>
#include <vector>

#include "gpu/buffer.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/gpu/device.h"

namespace mono3d {

// From the frame of an anchor into that of a camera, as UseAnchor of shaders/fusion/view.glsl reads
// it.
struct AnchorTransform {
  std::array<float, 4> rotation;           // unit quaternion, w last
  std::array<float, 4> translation_scale;  // in the unit of the camera's depth map
};

AnchorTransform ToAnchorTransform(const Similarity& S_view_anchor);

// Per anchor, in double precision until the last step: far from the origin of the world nothing is
// lost.
std::vector<AnchorTransform> AnchorTransforms(const Similarity& S_world_view,
                                              std::span<const Similarity> S_world_anchor);

// The same on the device. Not to be set while a recorder still has to work with it.
class AnchorTable {
 public:
  void Set(const std::shared_ptr<Device>& device, std::span<const AnchorTransform> transforms);
  void Set(const std::shared_ptr<Device>& device, const Similarity& S_world_view,
           std::span<const Similarity> S_world_anchor) {
    Set(device, AnchorTransforms(S_world_view, S_world_anchor));
  }
  const Buffer& buffer() const { return buffer_; }
  const std::vector<AnchorTransform>& transforms() const { return transforms_; }

 private:
  Buffer buffer_;
  std::vector<AnchorTransform> transforms_;
};

}  // namespace mono3d
