// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/image_bundle.h"

#include <cmath>
#include <sstream>
#include <string>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// A rotation that cannot be normalised, of a matrix that is none, comes out as NaN or of another
// length.
void ValidatePose(const Keyframe& keyframe) {
  constexpr double kLengthRounding = 1e-6;
  const Eigen::Quaterniond& q = keyframe.T_world_cam.rotation();
  const Eigen::Vector3d& t = keyframe.T_world_cam.translation();
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

}  // namespace

void Validate(const ImageBundle& bundle) {
  if (!IsBundleSize(bundle.keyframes.size())) {
    throw Error(ErrorParts{.what = "wrong number of images in a bundle",
                           .where = {},
                           .expected = kBundleSizesText,
                           .found = std::to_string(bundle.keyframes.size())});
  }
  const Keyframe& reference = bundle.reference();
  for (const Keyframe& keyframe : bundle.keyframes) {
    Validate(keyframe.frame);
    ValidatePose(keyframe);
    if (keyframe.frame.bgr.size() != reference.frame.bgr.size()) {
      throw Error(ErrorParts{.what = "images of a bundle differ in size",
                             .where = keyframe.frame.name,
                             .expected = std::to_string(reference.frame.bgr.cols) + "x" +
                                         std::to_string(reference.frame.bgr.rows),
                             .found = std::to_string(keyframe.frame.bgr.cols) + "x" +
                                      std::to_string(keyframe.frame.bgr.rows)});
    }
    if (keyframe.map_id != reference.map_id) {
      throw Error(ErrorParts{.what = "images of a bundle belong to different maps",
                             .where = keyframe.frame.name,
                             .expected = "map " + std::to_string(reference.map_id),
                             .found = "map " + std::to_string(keyframe.map_id)});
    }
  }
}

}  // namespace mono3d
