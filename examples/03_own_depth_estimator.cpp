// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// A depth estimator of one's own in the chain: OpenCV's semi-global block matching between the
// middle image of the bundle and one neighbour.
//   03_own_depth_estimator village_orbit village_orbit/camera.yaml -> cloud.ply

#include <Eigen/Geometry>
#include <exception>
#include <iostream>
#include <memory>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>

#include "mono3d/gpu/device.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/pipeline/pipeline.h"

namespace {

// Two images turned so that a point lies in the same row of both.
struct RectifiedPair {
  cv::Mat left;
  cv::Mat right;
  Eigen::Matrix3d R_rectified_left;
  Eigen::Matrix<double, 3, 4> P_left;
  double focal_times_baseline;  // px su
};

RectifiedPair Rectify(const mono3d::Keyframe& left, const mono3d::Keyframe& right,
                      const mono3d::Pose& T_right_left) {
  cv::Mat K, R, t, R_left, R_right, P_left, P_right, Q, map_x, map_y;
  cv::eigen2cv(left.frame.camera.Matrix(), K);
  cv::eigen2cv(T_right_left.rotation().toRotationMatrix(), R);
  cv::eigen2cv(T_right_left.translation(), t);
  const cv::Size size = left.frame.bgr.size();
  cv::stereoRectify(K, {}, K, {}, size, R, t, R_left, R_right, P_left, P_right, Q);
  RectifiedPair pair;
  cv::initUndistortRectifyMap(K, {}, R_left, P_left, size, CV_32FC1, map_x, map_y);
  cv::remap(left.frame.bgr, pair.left, map_x, map_y, cv::INTER_LINEAR);
  cv::initUndistortRectifyMap(K, {}, R_right, P_right, size, CV_32FC1, map_x, map_y);
  cv::remap(right.frame.bgr, pair.right, map_x, map_y, cv::INTER_LINEAR);
  cv::cv2eigen(R_left, pair.R_rectified_left);
  cv::cv2eigen(P_left, pair.P_left);
  pair.focal_times_baseline = -P_right.at<double>(0, 3);
  return pair;
}

// Depth of the left image, as it was before it was turned, from disparities of the turned one.
cv::Mat DepthFromDisparity(const RectifiedPair& pair, const cv::Mat& disparity,
                           const mono3d::CameraModel& camera) {
  cv::Mat depth = cv::Mat::zeros(disparity.size(), CV_32FC1);
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const Eigen::Vector3d ray_left = camera.Unproject(Eigen::Vector2d(x, y));
      const Eigen::Vector3d ray = pair.R_rectified_left * ray_left;
      const Eigen::Vector3d image = pair.P_left * ray.homogeneous();
      const cv::Point pixel(cvRound(image.x() / image.z()), cvRound(image.y() / image.z()));
      if (!pixel.inside(cv::Rect({0, 0}, disparity.size()))) continue;
      const double disparity_px = disparity.at<short>(pixel) / 16.0;  // OpenCV counts sixteenths
      if (disparity_px < 1) continue;
      depth.at<float>(y, x) =
          static_cast<float>(pair.focal_times_baseline / disparity_px / ray.z());
    }
  }
  return depth;
}

class StereoDepthEstimator : public mono3d::DepthEstimator {
 public:
  mono3d::DepthResult Estimate(const mono3d::ImageBundle& bundle) override {
    mono3d::Validate(bundle);
    mono3d::DepthResult result;
    const mono3d::Keyframe& left = bundle.reference();
    const std::optional<std::size_t> right = RightNeighbour(bundle);
    if (!right) {
      result.reason = "the camera does not move sideways";
      return result;
    }
    const RectifiedPair pair =
        Rectify(left, bundle.keyframes[*right], bundle.T_ref_cam[*right].Inverse());
    cv::Mat disparity;
    matcher_->compute(pair.left, pair.right, disparity);
    result.map.depth = DepthFromDisparity(pair, disparity, left.frame.camera);
    result.map.bgr = left.frame.bgr;
    result.map.camera = left.frame.camera;
    result.map.keyframe_id = left.id;
    result.map.frame_index = left.frame.index;
    result.map.timestamp_s = left.frame.timestamp_s;
    result.map.depth_sigma_per_square_depth = 1 / pair.focal_times_baseline;
    result.status = mono3d::DepthStatus::kEstimated;
    return result;
  }

 private:
  // The neighbour to the right of the middle image, where the flight is a sideways one.
  static std::optional<std::size_t> RightNeighbour(const mono3d::ImageBundle& bundle) {
    for (const std::size_t i : {bundle.reference_index() - 1, bundle.reference_index() + 1}) {
      const Eigen::Vector3d& t_ref = bundle.T_ref_cam[i].translation();
      if (t_ref.x() > 2 * t_ref.tail<2>().norm()) return i;
    }
    return std::nullopt;
  }

  static constexpr int kNumDisparities = 128;
  static constexpr int kBlock_px = 5;
  // Penalties as OpenCV's manual proposes them, for three channels.
  cv::Ptr<cv::StereoSGBM> matcher_ =
      cv::StereoSGBM::create(0, kNumDisparities, kBlock_px, 24 * kBlock_px * kBlock_px,
                             96 * kBlock_px * kBlock_px, 1, 0, 10, 100, 2);
};

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: 03_own_depth_estimator IMAGES CAMERA\n";
    return 2;
  }
  const auto frames = mono3d::OpenFrameSource(argv[1], mono3d::ReadCameraFile(argv[2]));
  mono3d::PipelineStages stages = mono3d::CreateStages({}, mono3d::OpenDevice());
  stages.depth_estimator = std::make_unique<StereoDepthEstimator>();
  mono3d::Pipeline pipeline(std::move(stages));
  const mono3d::Reconstruction result = pipeline.Run(*frames);
  if (result.maps.empty() || result.maps.front().model.empty()) {
    std::cerr << "no model came of " << result.counts.num_frames << " frames\n";
    return 1;
  }
  mono3d::WritePly("cloud.ply", result.maps.front().model);
  std::cout << "cloud.ply: " << result.maps.front().model.size() << " points from "
            << result.counts.num_fused << " depth maps\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << "\n";
  return 1;
}
