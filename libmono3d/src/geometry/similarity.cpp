// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/similarity.h"

#include <Eigen/Geometry>

#include "mono3d/core/error.h"

namespace mono3d {

Similarity Similarity::Inverse() const {
  const Eigen::Quaterniond rotation = pose_.rotation().conjugate();
  return {1 / scale_, Pose(rotation, rotation * (-pose_.translation() / scale_))};
}

Similarity Similarity::operator*(const Similarity& other) const {
  return {scale_ * other.scale_,
          Pose(pose_.rotation() * other.pose_.rotation(), *this * other.pose_.translation())};
}

Pose Similarity::operator*(const Pose& T_b_cam) const {
  return {pose_.rotation() * T_b_cam.rotation(), *this * T_b_cam.translation()};
}

Similarity FitSimilarity(std::span<const Eigen::Vector3d> p_source,
                         std::span<const Eigen::Vector3d> p_target) {
  if (p_source.size() != p_target.size() || p_source.size() < 3) {
    throw Error(ErrorParts{.what = "cannot fit a similarity",
                           .where = "FitSimilarity",
                           .expected = "three or more pairs of points",
                           .found = std::to_string(p_source.size()) + " and " +
                                    std::to_string(p_target.size()) + " points"});
  }
  const auto count = static_cast<Eigen::Index>(p_source.size());
  Eigen::Matrix3Xd source(3, count);
  Eigen::Matrix3Xd target(3, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    source.col(i) = p_source[static_cast<std::size_t>(i)];
    target.col(i) = p_target[static_cast<std::size_t>(i)];
  }
  const Eigen::Matrix4d fit = Eigen::umeyama(source, target, true);
  const double scale = fit.topLeftCorner<3, 3>().col(0).norm();
  if (!fit.allFinite() || !(scale > 0)) {
    throw Error(ErrorParts{.what = "cannot fit a similarity",
                           .where = "FitSimilarity",
                           .expected = "points that are not all in one place",
                           .found = {}});
  }
  const Eigen::Matrix3d rotation = fit.topLeftCorner<3, 3>() / scale;
  return {scale, Pose(rotation, fit.topRightCorner<3, 1>())};
}

}  // namespace mono3d
