// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"

namespace mono3d::tools {

// What the images of a sequence show in truth, and thus which of them show the same place.
class PlaceTruth {
 public:
  // `T_world_cam` of every image; `depth` (CV_32FC1, the poses' unit, 0: none) of some, by the
  // number of the image.
  PlaceTruth(const CameraModel& camera, std::vector<Pose> T_world_cam,
             std::map<std::int64_t, cv::Mat> depth);

  std::int64_t num_images() const { return static_cast<std::int64_t>(T_world_cam_.size()); }
  const Pose& T_world_cam(std::int64_t image) const { return T_world_cam_.at(Index(image)); }
  // Mean over a grid of the nearest depth image.
  double MeanDepth(std::int64_t image) const;
  // Share of the surface points in `image` (a grid of them, in the nearest image that has depths)
  // that `known` shows too: inside its picture, not behind anything there, and seen from a
  // direction that differs by at most `max_angle_deg`.
  double SharedShare(std::int64_t image, std::int64_t known, double max_angle_deg) const;

 private:
  struct DepthImage {
    cv::Mat depth;                        // of every kSpacing-th pixel each way
    std::vector<Eigen::Vector3d> points;  // a grid of them in the world
    double mean_depth = 0;
  };
  static constexpr int kSpacing = 4;  // px
  std::size_t Index(std::int64_t image) const;
  const DepthImage& NearestDepth(std::int64_t image, std::int64_t& number) const;
  bool IsInView(std::int64_t image, const Eigen::Vector3d& p_world) const;
  bool IsSeen(std::int64_t image, const Eigen::Vector3d& p_world) const;

  CameraModel camera_;
  std::vector<Pose> T_world_cam_;
  std::map<std::int64_t, DepthImage> depth_;
};

// Of a sequence's folder: images/, camera.yaml, groundtruth.txt, depth/. Throws Error where one of
// these is missing or there is not one pose for each image.
PlaceTruth ReadPlaceTruth(const std::string& folder);

}  // namespace mono3d::tools
