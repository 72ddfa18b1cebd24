// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cmath>
#include <cstdint>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/geometry/rolling_shutter.h"
#include "mono3d/geometry/similarity.h"

namespace mono3d {

// For the archives of image/state_archive.h.

// Places, times, lengths and ratios of lengths are far from these in any run; of what lies beyond,
// squares of products would no longer be numbers.
inline constexpr double kMostOfState = 1e30;
inline constexpr double kLeastScaleOfState = 1 / kMostOfState;

template <typename Archive>
void ExchangeBounded(Archive& archive, double& number) {
  archive.Number(number);
  if constexpr (Archive::kReads) {
    if (!(std::abs(number) <= kMostOfState)) archive.Refuse("a number is too large");
  }
}

// A count that may be counted further.
template <typename Archive>
void ExchangeCount(Archive& archive, std::int64_t& count) {
  archive.Number(count);
  if constexpr (Archive::kReads) {
    constexpr std::int64_t kMost = 1'000'000'000'000;
    if (count < 0 || count > kMost) archive.Refuse("contradicts itself");
  }
}

template <typename Archive>
void ExchangeScale(Archive& archive, double& scale) {
  archive.Number(scale);
  if constexpr (Archive::kReads) {
    if (!(scale >= kLeastScaleOfState && scale <= kMostOfState)) archive.Refuse("a scale is none");
  }
}

template <typename Archive, typename Matrix>
void ExchangeElements(Archive& archive, Matrix& matrix) {
  archive.Numbers(matrix.data(), static_cast<std::size_t>(matrix.size()));
  if constexpr (Archive::kReads) {
    if (!(matrix.template cast<double>().cwiseAbs().maxCoeff() <= kMostOfState)) {
      archive.Refuse("a number is too large");
    }
  }
}

template <typename Archive>
void ExchangeState(Archive& archive, Pose& pose) {
  Eigen::Vector4d q = pose.rotation().coeffs();
  Eigen::Vector3d t = pose.translation();
  ExchangeElements(archive, q);
  ExchangeElements(archive, t);
  if constexpr (Archive::kReads) {
    if (!(std::abs(q.norm() - 1) < 1e-6)) archive.Refuse("a rotation is none");
    pose = Pose::Exactly(Eigen::Quaterniond(q), t);
  }
}

template <typename Archive>
void ExchangeState(Archive& archive, Similarity& similarity) {
  double scale = similarity.scale();
  Pose pose = similarity.pose();
  ExchangeScale(archive, scale);
  ExchangeState(archive, pose);
  if constexpr (Archive::kReads) similarity = {scale, pose};
}

template <typename Archive>
void ExchangeState(Archive& archive, CameraModel& camera) {
  archive.Number(camera.width);
  archive.Number(camera.height);
  for (double* number : {&camera.fx, &camera.fy, &camera.cx, &camera.cy}) {
    ExchangeBounded(archive, *number);
  }
  archive.Numbers(camera.distortion.data(), camera.distortion.size());
  archive.Number(camera.shutter.readout_s);
  archive.Number(camera.shutter.reads_columns);
  bool is_fisheye = camera.lens == LensModel::kFisheye;
  archive.Number(is_fisheye);
  camera.lens = is_fisheye ? LensModel::kFisheye : LensModel::kBrown;
}

template <typename Archive>
void ExchangeState(Archive& archive, CameraVelocity& velocity) {
  for (Eigen::Vector3d* axes : {&velocity.angular_rad_per_s, &velocity.linear_su_per_s,
                                &velocity.angular_rad_per_s2, &velocity.linear_su_per_s2}) {
    ExchangeElements(archive, *axes);
  }
}

}  // namespace mono3d
