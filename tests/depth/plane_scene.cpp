// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/plane_scene.h"

#include <numbers>
#include <opencv2/imgproc.hpp>

namespace mono3d {
namespace {

constexpr double kOffset = 2;
constexpr int kTextureSide = 700;
constexpr double kTexelsPerUnit = 150;
constexpr int kTexelsPerPixel = 2;  // in the middle of the reference

cv::Mat Texture(double contrast, int blank) {
  cv::Mat noise(kTextureSide, kTextureSide, CV_32FC1);
  cv::RNG random(7);
  random.fill(noise, cv::RNG::UNIFORM, -1.f, 1.f);
  cv::GaussianBlur(noise, noise, {}, 1.2);
  const int first = (kTextureSide - blank) / 2;
  noise(cv::Rect(first, first, blank, blank)).setTo(0);
  return 128 + contrast * 200 * noise;
}

// Where the ray of a pixel meets the plane, in the unscaled world.
Eigen::Vector3d Meet(const Eigen::Vector3d& plane, const CameraModel& camera,
                     const Pose& T_world_cam, double x, double y) {
  const Eigen::Vector3d origin = T_world_cam.translation();
  const Eigen::Vector3d ray = T_world_cam.rotation() * camera.Unproject({x, y});
  return origin + (kOffset - plane.dot(origin)) / plane.dot(ray) * ray;
}

cv::Mat Render(const Eigen::Vector3d& plane, const CameraModel& camera, const Pose& T_world_cam,
               const cv::Mat& texture) {
  cv::Mat map_x(camera.height, camera.width, CV_32FC1);
  cv::Mat map_y(camera.height, camera.width, CV_32FC1);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d p = Meet(plane, camera, T_world_cam, x, y);
      map_x.at<float>(y, x) = static_cast<float>(p.x() * kTexelsPerUnit + kTextureSide / 2.0);
      map_y.at<float>(y, x) = static_cast<float>(p.y() * kTexelsPerUnit + kTextureSide / 2.0);
    }
  }
  cv::Mat grey;
  cv::remap(texture, grey, map_x, map_y, cv::INTER_LINEAR, cv::BORDER_REFLECT);
  grey.convertTo(grey, CV_8U);
  cv::Mat bgr;
  cv::cvtColor(grey, bgr, cv::COLOR_GRAY2BGR);
  return bgr;
}

}  // namespace

cv::Mat PlaneScene::TrueDepth() const {
  cv::Mat depth(camera.height, camera.width, CV_32FC1);
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      depth.at<float>(y, x) = static_cast<float>(scale * Meet(plane, camera, Pose(), x, y).z());
    }
  }
  return depth;
}

ImageBundle PlaneScene::Bundle() const {
  const cv::Mat texture = Texture(contrast, kTexelsPerPixel * blank_px);
  ImageBundle bundle;
  for (int i = 0; i < num_images; ++i) {
    const double side = i - num_images / 2;
    // The reference in the middle, at the origin; the others a little turned towards it.
    const Pose T_world_cam(RotationExp(Eigen::Vector3d(0.005, -0.02, 0.01) * side),
                           baseline * side * direction);
    Keyframe keyframe;
    keyframe.id = 10 + i;
    keyframe.frame = {.index = 20 + i,
                      .timestamp_s = 0.5 * i,
                      .name = "plane",
                      .bgr = Render(plane, camera, T_world_cam, texture),
                      .camera = camera};
    bundle.keyframes.push_back(keyframe);
    // The world is the reference's camera.
    bundle.T_ref_cam.emplace_back(T_world_cam.rotation(), scale * T_world_cam.translation());
  }
  if (with_sparse_depths && num_images > 0) {
    const cv::Mat depth = TrueDepth();
    for (int y = 2; y < depth.rows; y += 8) {
      for (int x = 2; x < depth.cols; x += 8) {
        bundle.keyframes[bundle.reference_index()].sparse_depths_su.push_back(
            depth.at<float>(y, x));
      }
    }
  }
  return bundle;
}

void TurnImage(std::size_t index, unsigned quarter_turns, ImageBundle& bundle) {
  Frame& frame = bundle.keyframes[index].frame;
  for (unsigned i = 0; i < quarter_turns; ++i) {
    const CameraModel upright = frame.camera;
    cv::rotate(frame.bgr.clone(), frame.bgr, cv::ROTATE_90_CLOCKWISE);
    std::swap(frame.camera.fx, frame.camera.fy);
    std::swap(frame.camera.width, frame.camera.height);
    frame.camera.cx = upright.height - 1 - upright.cy;
    frame.camera.cy = upright.cx;
    const Eigen::Quaterniond back = RotationExp(Eigen::Vector3d(0, 0, -std::numbers::pi / 2));
    bundle.T_ref_cam[index] = bundle.T_ref_cam[index] * Pose(back, Eigen::Vector3d::Zero());
  }
}

}  // namespace mono3d
