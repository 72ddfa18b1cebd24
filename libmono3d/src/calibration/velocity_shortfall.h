// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <span>

#include "mono3d/image/keyframe_poses.h"

namespace mono3d::calibration {

// The share by which velocities from differences of poses fall short of a camera that shakes too
// fast for its frame rate: a readout time is found too long by as much. Measured is by how much
// velocities by two frames on each side fall short of those by four, in how the camera turns about
// its mean turning, as an even motion tells nothing of a readout. What those of a settled map, by
// six, still miss is less than that, up to a shake of two fifths of the frame rate.
class VelocityShortfall {
 public:
  // Frames of one or more maps, each map in the order of time.
  void Add(std::span<const TrajectoryEntry> frames);
  // 0 where nothing is known.
  double Share() const;

 private:
  double num_frames_ = 0;
  Eigen::Vector3d sum_ = Eigen::Vector3d::Zero();      // of turning by four, rad/s
  Eigen::Vector3d missing_ = Eigen::Vector3d::Zero();  // of what two fall short of it
  double squares_ = 0;
  double products_ = 0;  // of both
};

}  // namespace mono3d::calibration
