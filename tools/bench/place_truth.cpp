// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/place_truth.h"

#include <cmath>
#include <numbers>
#include <utility>

#include "evaluate/files.h"
#include "mono3d/core/error.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/depth_image_file.h"
#include "mono3d/io/trajectory_file.h"

namespace mono3d::tools {

PlaceTruth::PlaceTruth(const CameraModel& camera, std::vector<Pose> T_world_cam,
                       std::map<std::int64_t, cv::Mat> depth)
    : camera_(camera), T_world_cam_(std::move(T_world_cam)) {
  constexpr int kGrid = 6;  // of the pixels kept, from one point of the grid to the next
  for (const auto& [number, full] : depth) {
    DepthImage kept;
    kept.depth = cv::Mat((full.rows + kSpacing - 1) / kSpacing,
                         (full.cols + kSpacing - 1) / kSpacing, CV_32FC1);
    const Pose& T = T_world_cam_.at(Index(number));
    for (int y = 0; y < kept.depth.rows; ++y) {
      for (int x = 0; x < kept.depth.cols; ++x) {
        const float z = full.at<float>(y * kSpacing, x * kSpacing);
        kept.depth.at<float>(y, x) = z;
        if (z <= 0 || x % kGrid != kGrid / 2 || y % kGrid != kGrid / 2) continue;
        kept.points.push_back(
            T * (static_cast<double>(z) * camera.Unproject({x * kSpacing, y * kSpacing})));
        kept.mean_depth += static_cast<double>(z);
      }
    }
    if (kept.points.empty()) continue;
    kept.mean_depth /= static_cast<double>(kept.points.size());
    depth_.emplace(number, std::move(kept));
  }
  if (depth_.empty()) throw Error("no true depth of any image");
}

std::size_t PlaceTruth::Index(std::int64_t image) const {
  if (image >= 0 && image < num_images()) return static_cast<std::size_t>(image);
  throw Error(ErrorParts{.what = "no true pose of this image",
                         .where = "image " + std::to_string(image),
                         .expected = std::to_string(num_images()) + " images",
                         .found = {}});
}

const PlaceTruth::DepthImage& PlaceTruth::NearestDepth(std::int64_t image,
                                                       std::int64_t& number) const {
  auto after = depth_.lower_bound(image);
  if (after == depth_.end() ||
      (after != depth_.begin() && image - std::prev(after)->first < after->first - image)) {
    --after;
  }
  number = after->first;
  return after->second;
}

double PlaceTruth::MeanDepth(std::int64_t image) const {
  std::int64_t number = 0;
  return NearestDepth(image, number).mean_depth;
}

bool PlaceTruth::IsInView(std::int64_t image, const Eigen::Vector3d& p_world) const {
  const Eigen::Vector3d p_cam = T_world_cam(image).Inverse() * p_world;
  return p_cam.z() > 0 && camera_.Contains(camera_.Project(p_cam));
}

bool PlaceTruth::IsSeen(std::int64_t image, const Eigen::Vector3d& p_world) const {
  // Of the depth: what pixels of a slanted surface that are kept differ by.
  constexpr double kTolerance = 0.05;
  if (!IsInView(image, p_world)) return false;
  std::int64_t number = 0;
  const cv::Mat& depth = NearestDepth(image, number).depth;
  const Eigen::Vector3d p_cam = T_world_cam(number).Inverse() * p_world;
  if (p_cam.z() <= 0) return false;
  const Eigen::Vector2d pixel = camera_.Project(p_cam) / kSpacing;
  const auto x = static_cast<int>(std::lround(pixel.x()));
  const auto y = static_cast<int>(std::lround(pixel.y()));
  if (x < 0 || y < 0 || x >= depth.cols || y >= depth.rows) return false;
  const auto z = static_cast<double>(depth.at<float>(y, x));
  return z > 0 && std::abs(p_cam.z() - z) <= kTolerance * z;
}

double PlaceTruth::SharedShare(std::int64_t image, std::int64_t known, double max_angle_deg) const {
  const double min_cosine = std::cos(max_angle_deg * std::numbers::pi / 180);
  const Eigen::Vector3d from = T_world_cam(image).translation();
  const Eigen::Vector3d from_known = T_world_cam(known).translation();
  std::int64_t number = 0;
  int num_points = 0;
  int num_shared = 0;
  for (const Eigen::Vector3d& point : NearestDepth(image, number).points) {
    if (!IsInView(image, point)) continue;
    ++num_points;
    const double cosine = (point - from).normalized().dot((point - from_known).normalized());
    num_shared += cosine >= min_cosine && IsSeen(known, point) ? 1 : 0;
  }
  return num_points > 0 ? static_cast<double>(num_shared) / num_points : 0;
}

PlaceTruth ReadPlaceTruth(const std::string& folder) {
  const SequenceFiles files = FindSequenceFiles(folder);
  const auto refuse = [&](const std::string& what, const std::string& expected,
                          const std::string& found) {
    throw Error(ErrorParts{what, folder, expected, found});
  };
  if (files.camera.empty()) refuse("no camera.yaml in the sequence", "", "");
  if (files.groundtruth.empty()) refuse("no true poses in the sequence", "groundtruth.txt", "");
  if (files.depth.empty()) refuse("no true depth in the sequence", "depth/", "");
  std::vector<Pose> poses;
  for (const StampedPose& pose : ReadTrajectory(files.groundtruth.string())) {
    poses.push_back(pose.T_world_cam);
  }
  if (poses.size() != files.images.size()) {
    refuse("wrong number of true poses",
           std::to_string(files.images.size()) + ", one for each image",
           std::to_string(poses.size()));
  }
  std::map<std::int64_t, cv::Mat> depth;
  for (std::int64_t image = 0; image < static_cast<std::int64_t>(poses.size()); ++image) {
    const auto found = files.depth.find(NumberOfImage(files, image));
    if (found != files.depth.end()) depth.emplace(image, ReadDepthImage(found->second));
  }
  return {ReadCameraFile(files.camera.string()), std::move(poses), std::move(depth)};
}

}  // namespace mono3d::tools
