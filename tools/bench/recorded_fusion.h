// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/fusion/surfel_map.h"
#include "mono3d/geometry/stamped_pose.h"
#include "mono3d/gpu/device.h"
#include "mono3d/image/depth_map.h"
#include "mono3d/image/keyframe_poses.h"
#include "mono3d/pipeline/pipeline.h"

namespace mono3d::tools {

// What the chain asks of a model: to follow the tracker's poses of this moment, and to fuse a depth
// map, where there is one.
struct FusionEvent {
  KeyframePoses poses;
  std::optional<DepthMap> map;
};

// One run of the chain over the sequence in `folder` (images/, camera.yaml): all that its model was
// asked, in order. Where the tracker made several maps, of the one with most depth maps. Throws
// Error when there is not a single depth map.
std::vector<FusionEvent> RecordFusion(const std::string& folder, const PipelineOptions& options,
                                      const std::shared_ptr<Device>& device);

// Each keyframe off by an error of its own, normally distributed in each axis: `share` of the
// median depth of all maps is the root mean square distance. Its orientation stays. The same error
// every time.
std::vector<FusionEvent> WithPoseErrors(std::vector<FusionEvent> events, double share);

// What became of it.
struct FusedRun {
  std::vector<StampedPose> poses;  // of the fused depth maps, in order of time
  PointCloud model;
  int num_maps = 0;
  int num_fused = 0;
  int num_moved = 0;  // of them: by the registration, away from the tracker's pose
  double cpu_ms = 0;  // of the process, per depth map
};
FusedRun FuseAgain(const std::vector<FusionEvent>& events, SurfelMap& model,
                   const SurfelExportOptions& surfel_export);

}  // namespace mono3d::tools
