// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <span>
#include <string>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/core/timing.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/image/frame.h"
#include "mono3d/image/keyframe.h"
#include "mono3d/image/sparse_model.h"
#include "mono3d/tracking/tracker.h"

namespace MONO3D_EXPORT mono3d {

struct ImageBundlePosesOptions {
  int num_features = 2000;  // ORB features per image
  int min_matches = 60;     // between the two images of the start
  int min_points = 40;      // triangulated from them
  double min_parallax_deg = 1;
  int min_inliers = 30;  // scene points that the pose of every further image must rest on
  int max_starts = 6;    // pairs of images that are tried as start
  int seed = 1;          // of RANSAC

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

struct ImageBundlePoses {
  bool is_estimated = false;
  std::string reason;  // why not: "image5.jpg: 12 scene points found again, 30 needed"
  // Of each frame, in their order, with the depths of the scene points in view. The world is the
  // camera of the middle frame, and the median depth there is 1 su, the unit of all keyframes.
  std::vector<Keyframe> keyframes;
  std::vector<Pose> T_world_cam;
  SparseModel model;           // the scene points and where the frames show them
  double reprojection_px = 0;  // root mean square over all observations
};

// The poses of a few photographs of one scene, from nothing but the photographs: ORB features
// matched between all of them, a start from the two that give most points under most parallax,
// every further image by its matches with these (PnP within RANSAC), then more points, found to a
// fraction of a pixel by their patches, and bundle adjustment over all images. Where two motions
// explain the start (over a plane), the images between must tell them apart. Same input, same
// result.
// Throws Error on fewer than 3 frames, an invalid one, or frames of different cameras.
[[nodiscard]] ImageBundlePoses EstimateImageBundlePoses(std::span<const Frame> frames,
                                                        const ImageBundlePosesOptions& options = {},
                                                        StageTimes* times = nullptr);

}  // namespace mono3d
