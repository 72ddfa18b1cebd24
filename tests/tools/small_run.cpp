// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tools/small_run.h"

#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <vector>

#include "mono3d/io/camera_file.h"
#include "mono3d/io/pfm_file.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"

namespace mono3d {
namespace {

constexpr int kRunWidth = 40;
constexpr int kRunHeight = 20;

std::vector<StampedPose> Poses(double scale) {
  std::vector<StampedPose> poses;
  for (int i = 0; i < 5; ++i) {
    StampedPose pose;
    pose.timestamp_s = i / 30.0;
    pose.T_world_cam =
        Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(i, 0.3 * i * i, 0.1 * i) * scale);
    poses.push_back(pose);
  }
  return poses;
}

PointCloud Cloud(double scale) {
  PointCloud cloud;
  for (double x = -4; x <= 4; x += 0.2) {
    for (double y = -4; y <= 4; y += 0.2) {
      const Eigen::Vector3d point(x, y, 10 + std::sin(x) + std::cos(1.3 * y));
      cloud.points.emplace_back((scale * point).cast<float>());
    }
  }
  return cloud;
}

void WriteDepthMapOfRun(const std::filesystem::path& folder) {
  constexpr double kAngle_rad = 10 * std::numbers::pi / 180;
  cv::Mat depth(kRunHeight, kRunWidth, CV_32FC1, cv::Scalar(10 * kSmallRunScale));
  cv::Mat confidence(kRunHeight, kRunWidth, CV_32FC1, cv::Scalar(0.9));
  cv::Mat normal(kRunHeight, kRunWidth, CV_32FC3,
                 cv::Scalar(0, std::sin(kAngle_rad), -std::cos(kAngle_rad)));
  depth.colRange(0, kRunWidth / 10) = cv::Scalar(0);
  confidence.colRange(0, kRunWidth / 10) = cv::Scalar(0);
  const cv::Range far(kRunWidth / 10, kRunWidth / 10 + kRunWidth * 9 / 40);
  depth.colRange(far) = cv::Scalar(10.4 * kSmallRunScale);
  confidence.colRange(far) = cv::Scalar(0.2);
  WritePfm(folder / "000002.depth.pfm", depth);
  WritePfm(folder / "000002.confidence.pfm", confidence);
  WritePfm(folder / "000002.normal.pfm", normal);
}

}  // namespace

SmallRun WriteSmallRun(const std::filesystem::path& folder) {
  const SmallRun paths = {folder / "sequence", folder / "run"};
  std::filesystem::create_directories(paths.sequence / "depth");
  std::filesystem::create_directories(paths.run / "depth");
  CameraModel camera;
  camera.width = kRunWidth;
  camera.height = kRunHeight;
  camera.fx = camera.fy = 40;
  camera.cx = 0.5 * (kRunWidth - 1);
  camera.cy = 0.5 * (kRunHeight - 1);
  WriteCameraFile(paths.sequence / "camera.yaml", camera);
  WriteTrajectory(paths.sequence / "groundtruth.txt", Poses(1));
  for (const char* name : {"000000.pfm", "000002.pfm", "000004.pfm"}) {
    WritePfm(paths.sequence / "depth" / name,
             cv::Mat(kRunHeight, kRunWidth, CV_32FC1, cv::Scalar(10)));
  }
  WritePly(paths.sequence / "cloud.ply", Cloud(1));
  for (const char* name : {"trajectory.txt", "trajectory_online.txt", "model_trajectory.txt"}) {
    WriteTrajectory(paths.run / name, Poses(kSmallRunScale));
  }
  WritePly(paths.run / "model.ply", Cloud(kSmallRunScale));
  WriteDepthMapOfRun(paths.run / "depth");
  return paths;
}

}  // namespace mono3d
