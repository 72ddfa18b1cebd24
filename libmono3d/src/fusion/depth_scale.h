// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "mono3d/geometry/pose.h"
#include "mono3d/image/depth_map.h"
#include "mono3d/image/keyframe_poses.h"

namespace mono3d {

// How deep a depth map is by the poses of now. Its depths were found with the poses that its images
// had then; while a map is young, each adjustment changes the distances between its keyframes by
// percents, and with them how deep the same pixels are.
class DepthScale {
 public:
  DepthScale() = default;
  // `median_depth_su`: of the depth map.
  DepthScale(const DepthMap& map, double median_depth_su);

  // Depths by the latest poses over those of the depth map; 1 where nothing has changed.
  double value() const { return value_; }
  // `reference`: of the depth map's keyframe. Views whose keyframes `poses` does not know, or has
  // in another map, say nothing; where none is left, the value stays. Returns it.
  double Update(const KeyframePoses& poses, const KeyframePose& reference);

  // For a saved state; see state_archive.h.
  template <typename Archive>
  void Exchange(Archive& archive);

 private:
  // One of the images in which the depth map was matched.
  struct View {
    std::int64_t keyframe_id = 0;
    Pose T_cam_ref_then;            // when the depth map was made
    std::optional<Pose> T_ref_cam;  // by the latest poses
  };

  void Fit();

  std::vector<View> views_;
  std::vector<Eigen::Vector3d> places_;  // that the depth map shows, in its camera's frame
  double value_ = 1;
};

}  // namespace mono3d
