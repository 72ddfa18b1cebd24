// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/image_bundle.h"

#include <cmath>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <string>
#include <utility>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// A rotation that cannot be normalised, of a matrix that is none, comes out as NaN or of another
// length.
void ValidatePose(const Keyframe& keyframe, const Pose& T_ref_cam) {
  constexpr double kLengthRounding = 1e-6;
  const Eigen::Quaterniond& q = T_ref_cam.rotation();
  const Eigen::Vector3d& t = T_ref_cam.translation();
  const bool is_rotation = std::abs(q.norm() - 1) <= kLengthRounding;  // false for NaN
  if (is_rotation && t.allFinite()) return;
  std::ostringstream found;
  found << (is_rotation ? "translation " : "quaternion ");
  if (is_rotation) {
    found << t.transpose();
  } else {
    found << q.coeffs().transpose();
  }
  throw Error(ErrorParts{.what = "pose is no rigid motion",
                         .where = keyframe.frame.name,
                         .expected = "a unit quaternion and a finite translation",
                         .found = found.str()});
}

void RequireNumPoses(std::size_t num_poses, const ImageBundle& bundle) {
  if (num_poses == bundle.keyframes.size()) return;
  throw Error(ErrorParts{.what = "wrong number of poses in a bundle",
                         .where = {},
                         .expected = std::to_string(bundle.keyframes.size()),
                         .found = std::to_string(num_poses)});
}

void RequireSides(const ImageBundle& bundle) {
  const std::size_t size = bundle.keyframes.size();
  const std::size_t before = bundle.reference_index();
  const bool has_reference = before < size;
  const auto is_side = [](std::size_t num_images) {
    return num_images >= 1 && num_images <= kMaxSideSize;
  };
  if (has_reference && is_side(before) && is_side(size - 1 - before)) return;
  throw Error(ErrorParts{.what = "wrong number of images in a bundle",
                         .where = {},
                         .expected = "3 to 9, 1 to 4 of them on each side of the reference",
                         .found = std::to_string(size) + ", " + std::to_string(before) +
                                  " of them before the reference"});
}

// The difference of the places comes first: far from the world's origin it is more exact, and it is
// zero, with no rounding, where both are in one place.
}  // namespace

void Validate(const ImageBundle& bundle) {
  RequireSides(bundle);
  RequireNumPoses(bundle.T_ref_cam.size(), bundle);
  const Keyframe& reference = bundle.reference();
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
    const Keyframe& keyframe = bundle.keyframes[i];
    Validate(keyframe.frame);
    ValidatePose(keyframe, bundle.T_ref_cam[i]);
    if (keyframe.frame.bgr.size() != reference.frame.bgr.size()) {
      throw Error(ErrorParts{.what = "images of a bundle differ in size",
                             .where = keyframe.frame.name,
                             .expected = std::to_string(reference.frame.bgr.cols) + "x" +
                                         std::to_string(reference.frame.bgr.rows),
                             .found = std::to_string(keyframe.frame.bgr.cols) + "x" +
                                      std::to_string(keyframe.frame.bgr.rows)});
    }
  }
}

bool SetPoses(const KeyframePoses& poses, ImageBundle& bundle) {
  const KeyframePose* reference = poses.Find(bundle.reference().id);
  if (reference == nullptr) return false;
  std::vector<Pose> T_ref_cam;
  for (const Keyframe& keyframe : bundle.keyframes) {
    const KeyframePose* pose = poses.Find(keyframe.id);
    if (pose == nullptr || pose->map_id != reference->map_id) return false;
    T_ref_cam.push_back(RelativePose(reference->S_world_kf, pose->T_world_cam()));
  }
  bundle.T_ref_cam = std::move(T_ref_cam);
  return true;
}

void SetPoses(std::span<const Pose> T_world_cam, ImageBundle& bundle) {
  RequireNumPoses(T_world_cam.size(), bundle);
  std::vector<Pose> T_ref_cam;
  for (const Pose& pose : T_world_cam) {
    T_ref_cam.push_back(RelativePose({1, T_world_cam[bundle.reference_index()]}, pose));
  }
  bundle.T_ref_cam = std::move(T_ref_cam);
}

ImageBundle HalfSize(const ImageBundle& bundle) {
  ImageBundle half = bundle;
  for (Keyframe& keyframe : half.keyframes) {
    Frame& frame = keyframe.frame;
    const int width = frame.camera.width / 2, height = frame.camera.height / 2;
    const double scale_x = double(width) / frame.camera.width;
    const double scale_y = double(height) / frame.camera.height;
    cv::Mat bgr;
    cv::resize(frame.bgr, bgr, {width, height}, 0, 0, cv::INTER_AREA);
    frame.bgr = bgr;
    frame.camera = frame.camera.Resized(width, height);
    if (frame.sensor.width > 0) frame.sensor = frame.sensor.Resized(width, height);
    if (!frame.content.empty()) {
      // Pixels of which a part was not taken are left out.
      const cv::Point from(static_cast<int>(std::ceil(frame.content.x * scale_x)),
                           static_cast<int>(std::ceil(frame.content.y * scale_y)));
      const cv::Point to(static_cast<int>(frame.content.br().x * scale_x),
                         static_cast<int>(frame.content.br().y * scale_y));
      frame.content = cv::Rect(from, to);
    }
    for (Eigen::Vector2f& pixel : keyframe.sparse_pixels) {
      pixel = Eigen::Vector2f((pixel.x() + 0.5f) * static_cast<float>(scale_x) - 0.5f,
                              (pixel.y() + 0.5f) * static_cast<float>(scale_y) - 0.5f);
    }
  }
  return half;
}

}  // namespace mono3d
