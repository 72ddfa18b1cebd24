// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/image/frame.h"

namespace MONO3D_EXPORT mono3d {

// An image that a depth map was matched in, and where it was then.
struct MatchedView {
  std::int64_t keyframe_id = 0;
  Pose T_ref_cam;  // into the camera frame of the reference, in its own unit
};

// Of DepthMap::inferred.
inline constexpr std::uint8_t kInferred = 255;
inline constexpr std::uint8_t kCoarselyMatched = 128;

// Depth of one reference image. All images have the camera's size. No estimate: depth 0, normal 0,
// confidence 0. `normal` and `confidence` may be empty when the estimator does not make them.
// Lengths are in the own unit of the reference keyframe, whose place in the world is in
// KeyframePoses, by the poses that the images had when it was made.
struct DepthMap {
  cv::Mat depth;       // CV_32FC1, z-depth along the optical axis, su
  cv::Mat normal;      // CV_32FC3, unit length, camera frame, towards the camera (n_z < 0)
  cv::Mat confidence;  // CV_32FC1, 0 to 1
  cv::Mat bgr;         // CV_8UC3, the reference image
  // CV_8UC1, kInferred where the depth was not matched but inferred from the surface around, and
  // kCoarselyMatched where it was matched on a coarser level of the pyramid alone; 0 elsewhere. It
  // then has little confidence, and is fused apart from what is matched. May be empty.
  cv::Mat inferred = {};
  CameraModel camera;
  std::int64_t keyframe_id = 0;
  std::int64_t frame_index = 0;
  double timestamp_s = 0;
  // Depth error of one pixel of matching error, as a share of depth^2: sigma(z) = z^2 * this.
  // 1 / (f * baseline); 0 when not known.
  double depth_sigma_per_square_depth = 0;
  // The other images of the bundle: where their poses change later, so do the depths. Empty where
  // these are not to change.
  std::vector<MatchedView> views = {};
  // Mean of Keyframe::patch_noise over the bundle: the errors of its poses, which bend the depth
  // map, are larger by that. 1 or more.
  double patch_noise = 1;
  // Estimates nearer to the image's border than this rest on windows that it cuts, and their
  // confidence does not tell: no surface is made of them. 0 where the estimator knows no such
  // border.
  int uncertain_border_px = 0;
};

// Number of pixels with an estimate.
std::int64_t CountEstimates(const DepthMap& map);

// The map without the estimates that are inferred. Shares its images where there are none, and its
// normals in any case, so that there are normals where no estimate is left.
DepthMap WithoutInferred(const DepthMap& map);

// The map at the size of its reference image `frame`: each pixel has the estimate of the nearest
// one.
DepthMap AtSizeOf(const Frame& frame, const DepthMap& map);

// The points of the map in the world, with colour, and normal where the map has normals. The
// default is the frame of the reference image's camera.
PointCloud ToPointCloud(const DepthMap& map, const Similarity& S_world_kf = Similarity());

// Throws Error unless the images have the camera's size and the types stated above.
void Validate(const DepthMap& map);

}  // namespace mono3d
