// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "mono3d/geo/position_track.h"
#include "mono3d/geometry/geodetic.h"
#include "mono3d/geometry/stamped_pose.h"
#include "mono3d/image/camera_positions.h"

namespace mono3d::tools {

// How a receiver errs that does not exist: on each axis by a wandering error (first-order
// Gauss-Markov process) and a white one.
struct ReceiverKind {
  std::string name;
  double rate_hz = 1;
  PositionNoise noise;
  bool is_stated = false;  // the receiver tells its standard deviation, as those with RTK do
};

// By the names that --kinds knows; throws UsageError on any other.
ReceiverKind ReceiverKindOf(const std::string& name);
inline const std::vector<std::string> kReceiverKinds = {"wander", "white", "rtk"};

struct PositionDrawOptions {
  double outlier_share = 0.02;
  double outlier_m = 30;  // standard deviation on each axis of what outliers are off by more
  double max_clock_offset_s = 2;  // drawn evenly up to this, either way
};

// Positions of a flight as such a receiver tells them, and what is true of them.
struct DrawnPositions {
  PositionTrack track;
  std::vector<double> true_times_s;  // of each fix, of the images
  std::vector<char> is_outlier;      // of each fix
  std::vector<Eigen::Vector3d> errors_m;
  double clock_offset_s = 0;  // time of an image minus that of its fix
};

// Where a smooth path is at a time within it (cubic between the poses, so that a turn is none of
// chords), and how fast it moves. Times ascend; two poses at least.
struct PathPoint {
  Eigen::Vector3d p_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d velocity_m_per_s = Eigen::Vector3d::Zero();
};
PathPoint PathAt(std::span<const StampedPose> path, double time_s);

// `truth` in metres east, north, up of `origin`. The same seed gives the same positions.
DrawnPositions DrawPositions(std::span<const StampedPose> truth, const Geodetic& origin,
                             const ReceiverKind& kind, const PositionDrawOptions& options,
                             std::uint64_t seed);

// A table for `mono3d-reconstruct --positions`, from which ReadPositionFile has the same track.
void WritePositionTable(const std::filesystem::path& path, const PositionTrack& track);

}  // namespace mono3d::tools
