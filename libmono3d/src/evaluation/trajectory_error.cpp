// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/trajectory_error.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>

#include "evaluation/trajectory_alignment.h"
#include "evaluation/trajectory_association.h"
#include "geometry/angles.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

std::vector<PosePair> Associate(std::span<const StampedPose> estimate,
                                std::span<const StampedPose> truth,
                                const TrajectoryErrorOptions& options) {
  std::vector<PosePair> pairs = AssociateByTime(estimate, truth, options.max_time_difference_s);
  const std::size_t needed = options.align == "none" ? 1 : 3;
  if (pairs.size() < needed) {
    std::ostringstream within;
    within << needed << " or more within " << options.max_time_difference_s << " s";
    throw Error(ErrorParts{.what = "too few poses with a true pose of the same time",
                           .where = {},
                           .expected = within.str(),
                           .found = std::to_string(pairs.size()) + " of " +
                                    std::to_string(estimate.size()) + " estimated and " +
                                    std::to_string(truth.size()) + " true poses"});
  }
  return pairs;
}

TrajectoryAlignment Align(std::span<const StampedPose> estimate, std::span<const StampedPose> truth,
                          std::span<const PosePair> pairs, const std::string& align) {
  if (align == "none") return {};
  std::vector<Pose> estimated_poses;
  std::vector<Pose> true_poses;
  for (const PosePair& pair : pairs) {
    estimated_poses.push_back(estimate[pair.estimate_index].T_world_cam);
    true_poses.push_back(truth[pair.truth_index].T_world_cam);
  }
  return AlignTrajectory(estimated_poses, true_poses, align == "sim3");
}

AssociatedPose ComparePoses(std::span<const StampedPose> estimate,
                            std::span<const StampedPose> truth, const PosePair& pair,
                            const Similarity& S_truth_estimate) {
  AssociatedPose pose;
  pose.estimate_index = pair.estimate_index;
  pose.truth_index = pair.truth_index;
  pose.timestamp_s = truth[pair.truth_index].timestamp_s;
  pose.T_truth_cam = truth[pair.truth_index].T_world_cam;
  pose.T_truth_cam_estimated = S_truth_estimate * estimate[pair.estimate_index].T_world_cam;
  pose.position_error =
      (pose.T_truth_cam_estimated.translation() - pose.T_truth_cam.translation()).norm();
  pose.rotation_error_deg =
      kDegreesPerRadian *
      pose.T_truth_cam_estimated.rotation().angularDistance(pose.T_truth_cam.rotation());
  return pose;
}

// Length of the true path from the first associated pose to each.
std::vector<double> PathTravelled(const std::vector<AssociatedPose>& poses) {
  std::vector<double> travelled(poses.size(), 0);
  for (std::size_t i = 1; i < poses.size(); ++i) {
    travelled[i] =
        travelled[i - 1] +
        (poses[i].T_truth_cam.translation() - poses[i - 1].T_truth_cam.translation()).norm();
  }
  return travelled;
}

void AddRelativeErrors(double segment_share, TrajectoryError& error) {
  const std::vector<AssociatedPose>& poses = error.poses;
  const std::vector<double> travelled = PathTravelled(poses);
  if (poses.empty() || !(travelled.back() > 0)) return;
  const double segment = segment_share * travelled.back();
  std::vector<double> positions;
  std::vector<double> rotations_deg;
  std::size_t end = 0;
  for (std::size_t begin = 0; begin < poses.size(); ++begin) {
    while (end < poses.size() && travelled[end] - travelled[begin] < segment) ++end;
    if (end == poses.size()) break;
    const Pose T_begin_end = poses[begin].T_truth_cam.Inverse() * poses[end].T_truth_cam;
    const Pose T_begin_end_estimated =
        poses[begin].T_truth_cam_estimated.Inverse() * poses[end].T_truth_cam_estimated;
    const Pose difference = T_begin_end.Inverse() * T_begin_end_estimated;
    const double length = travelled[end] - travelled[begin];
    positions.push_back(difference.translation().norm() / length);
    rotations_deg.push_back(kDegreesPerRadian * difference.RotationAngle() / length);
  }
  error.relative_position = ComputeStatistics(positions);
  error.relative_rotation_deg = ComputeStatistics(rotations_deg);
}

double PathLength(std::span<const StampedPose> poses) {
  std::vector<StampedPose> ordered(poses.begin(), poses.end());
  std::stable_sort(ordered.begin(), ordered.end(), [](const StampedPose& a, const StampedPose& b) {
    return a.timestamp_s < b.timestamp_s;
  });
  double length = 0;
  for (std::size_t i = 1; i < ordered.size(); ++i) {
    length +=
        (ordered[i].T_world_cam.translation() - ordered[i - 1].T_world_cam.translation()).norm();
  }
  return length;
}

}  // namespace

void TrajectoryErrorOptions::Visit(OptionVisitor& visit) {
  visit("align", align, "alignment to the truth: sim3, se3 or none");
  visit("max_time_difference", max_time_difference_s,
        "largest difference in time of two poses that count as simultaneous, s");
  visit("relative_segment", relative_segment,
        "length of the segments for the relative error, as a share of the path");
}

void TrajectoryErrorOptions::Validate() const {
  if (align != "sim3" && align != "se3" && align != "none") {
    throw UsageError({"no such alignment", "--align", "sim3, se3 or none", align});
  }
  RequireOption(max_time_difference_s >= 0, "max_time_difference", "0 or more",
                max_time_difference_s);
  RequireOption(relative_segment > 0 && relative_segment <= 1, "relative_segment",
                "more than 0, at most 1", relative_segment);
}

TrajectoryError CompareTrajectories(std::span<const StampedPose> estimate,
                                    std::span<const StampedPose> truth,
                                    const TrajectoryErrorOptions& options) {
  options.Validate();
  const std::vector<PosePair> pairs = Associate(estimate, truth, options);
  const TrajectoryAlignment alignment = Align(estimate, truth, pairs, options.align);
  TrajectoryError error;
  error.S_truth_estimate = alignment.S_truth_estimate;
  error.is_straight = alignment.is_straight;
  error.num_estimated = static_cast<std::int64_t>(estimate.size());
  error.num_true = static_cast<std::int64_t>(truth.size());
  error.truth_coverage = static_cast<double>(pairs.size()) / static_cast<double>(truth.size());
  error.path_length = PathLength(truth);
  std::vector<double> positions;
  std::vector<double> rotations_deg;
  for (const PosePair& pair : pairs) {
    error.poses.push_back(ComparePoses(estimate, truth, pair, error.S_truth_estimate));
    positions.push_back(error.poses.back().position_error);
    rotations_deg.push_back(error.poses.back().rotation_error_deg);
  }
  error.position = ComputeStatistics(positions);
  error.rotation_deg = ComputeStatistics(rotations_deg);
  AddRelativeErrors(options.relative_segment, error);
  return error;
}

}  // namespace mono3d
