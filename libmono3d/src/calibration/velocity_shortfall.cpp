// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/velocity_shortfall.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "mono3d/geometry/rolling_shutter.h"

namespace mono3d::calibration {
namespace {

// By the polynomial through frame `at` and so many on each side, which are there.
std::optional<Eigen::Vector3d> Turning(std::span<const TrajectoryEntry> frames, std::size_t at,
                                       std::size_t on_side) {
  std::vector<LaterPose> around;
  const double unit_s = frames[at + 1].timestamp_s - frames[at].timestamp_s;
  for (std::size_t i = at - on_side; i <= at + on_side; ++i) {
    if (i == at) continue;
    around.push_back({frames[i].T_world_cam.Inverse() * frames[at].T_world_cam,
                      frames[i].timestamp_s - frames[at].timestamp_s});
  }
  const std::optional<CameraVelocity> velocity = VelocityThrough(around, unit_s);
  if (!velocity) return std::nullopt;
  return velocity->angular_rad_per_s;
}

// Frames of one map whose times lie evenly enough.
bool AreEven(std::span<const TrajectoryEntry> frames) {
  constexpr double kMaxRatio = 1.5;  // of the times from one to the next
  double least_s = frames[1].timestamp_s - frames[0].timestamp_s;
  double most_s = least_s;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    if (frames[i].map_id != frames[0].map_id) return false;
    const double step_s = frames[i].timestamp_s - frames[i - 1].timestamp_s;
    least_s = std::min(least_s, step_s);
    most_s = std::max(most_s, step_s);
  }
  return least_s > 0 && most_s <= kMaxRatio * least_s;
}

}  // namespace

void VelocityShortfall::Add(std::span<const TrajectoryEntry> frames) {
  constexpr std::size_t kFew = 2;
  constexpr std::size_t kMany = 4;
  for (std::size_t at = kMany; at + kMany < frames.size(); ++at) {
    if (!AreEven(frames.subspan(at - kMany, 2 * kMany + 1))) continue;
    const std::optional<Eigen::Vector3d> by_few = Turning(frames, at, kFew);
    const std::optional<Eigen::Vector3d> by_many = Turning(frames, at, kMany);
    if (!by_few || !by_many) continue;
    const Eigen::Vector3d missing = *by_many - *by_few;
    num_frames_ += 1;
    sum_ += *by_many;
    missing_ += missing;
    squares_ += by_many->squaredNorm();
    products_ += by_many->dot(missing);
  }
}

double VelocityShortfall::Share() const {
  if (num_frames_ == 0) return 0;
  const double variance = squares_ - sum_.squaredNorm() / num_frames_;
  const double covariance = products_ - sum_.dot(missing_) / num_frames_;
  return variance > 0 ? std::clamp(covariance / variance, 0.0, 1.0) : 0;
}

}  // namespace mono3d::calibration
