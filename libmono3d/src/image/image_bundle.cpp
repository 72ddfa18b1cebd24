// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/image_bundle.h"

#include <cmath>
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
Pose Relative(const Similarity& S_world_ref, const Pose& T_world_cam) {
  const Pose& T_world_ref = S_world_ref.pose();
  const Eigen::Quaterniond R_ref_world = T_world_ref.rotation().conjugate();
  return {R_ref_world * T_world_cam.rotation(),
          R_ref_world *
              ((T_world_cam.translation() - T_world_ref.translation()) / S_world_ref.scale())};
}

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
    T_ref_cam.push_back(Relative(reference->S_world_kf, pose->T_world_cam()));
  }
  bundle.T_ref_cam = std::move(T_ref_cam);
  return true;
}

void SetPoses(std::span<const Pose> T_world_cam, ImageBundle& bundle) {
  RequireNumPoses(T_world_cam.size(), bundle);
  std::vector<Pose> T_ref_cam;
  for (const Pose& pose : T_world_cam) {
    T_ref_cam.push_back(Relative({1, T_world_cam[bundle.reference_index()]}, pose));
  }
  bundle.T_ref_cam = std::move(T_ref_cam);
}

}  // namespace mono3d
