// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/similarity.h"

namespace MONO3D_EXPORT mono3d {

// How positions err, one axis: an error that wanders (first-order Gauss-Markov process) and white
// noise.
struct PositionNoise {
  double wander_m = 0;       // standard deviation
  double correlation_s = 0;  // after this time the wandering error has fallen to 1/e
  double white_m = 0;        // standard deviation
};

// A measured camera centre, in metres.
struct CameraPosition {
  double time_s = 0;  // of the images
  Eigen::Vector3d p_m = Eigen::Vector3d::Zero();
  // Where it belongs to a frame by its name, that one's index (its time then counts for nothing),
  // and how well it is known (standard deviations).
  std::int64_t frame_index = -1;
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Zero();
};

// Where a frame shows a point.
struct PointSight {
  std::int64_t frame_index = 0;
  Eigen::Vector3d ray_cam = Eigen::Vector3d::UnitZ();  // at z = 1, free of distortion
  double sigma = 0;                                    // standard deviation at z = 1, of x and of y
};

// A place on the ground that was surveyed, in metres.
struct KnownPoint {
  Eigen::Vector3d p_m = Eigen::Vector3d::Zero();
  Eigen::Vector3d sigma_m = Eigen::Vector3d::Zero();  // 0: not known
  std::vector<PointSight> sights;
};

// What was measured of where the cameras of one map were, in axes of its own with z up.
struct CameraPositions {
  int map_id = 0;
  Similarity S_metric_map;                // about; the map may have moved since
  std::vector<CameraPosition> positions;  // in the order of time
  std::vector<KnownPoint> points;         // ground control
  bool has_vertical = true;               // z is measured as well
  // By how much the times may all be off, as far as that is known without the path: to be added to
  // each, and its standard deviation; 0: they are exact.
  double clock_offset_s = 0;
  double clock_offset_sigma_s = 0;
  // Standard deviations that such measurements have, and how many independent errors that knowledge
  // is worth beside the measurements themselves.
  double typical_horizontal_m = 0;
  double typical_vertical_m = 0;
  double worth = 2;
};

// How far a tracker is off from one keyframe to the next: standard deviations.
struct PathDrift {
  double rotation_rad = 0;  // about each axis
  double log_scale = 0;
};

// What became of the positions of a map.
struct PositionFit {
  int map_id = 0;
  std::size_t num_used = 0;
  std::size_t num_outliers = 0;
  // Of known points; of a path those of each time that it came past one.
  std::size_t num_points_used = 0;
  std::size_t num_point_outliers = 0;
  PositionNoise horizontal;  // of x and y each
  PositionNoise vertical;
  PathDrift drift;
  double rms_moved_m = 0;  // of the keyframes against the best similarity of the path before
};

}  // namespace mono3d
