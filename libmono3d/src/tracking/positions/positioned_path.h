// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <vector>

#include "mono3d/geometry/similarity.h"
#include "mono3d/image/camera_positions.h"
#include "tracking/optimisation/pose_graph.h"

namespace mono3d::tracking {

// A position of the camera, or a known point, at a point that goes with a keyframe.
struct PathPosition {
  double time_s = 0;
  std::size_t node = 0;
  Eigen::Vector3d p_kf = Eigen::Vector3d::Zero();  // in the camera frame of the keyframe
  Eigen::Vector3d p_m = Eigen::Vector3d::Zero();
  // How fast p_kf moves, in camera frames of the keyframe a second; of a known point 0.
  Eigen::Vector3d velocity_kf = Eigen::Vector3d::Zero();
  // Of a known point: how well p_m and p_kf together are known, in square metres. A position of the
  // camera has none, and errs as PathNoise says.
  std::optional<Eigen::Matrix3d> covariance_m2 = {};
};

// The keyframes of a map and what is known of where they were. `S_metric_kf` has lengths of the
// camera frames, which are those of `edges`, and metres.
struct PositionedPath {
  std::vector<Similarity> S_metric_kf;  // in the order of flight, as they are now
  // What vision knows: of each keyframe and the next one first, in their order, then of others.
  std::vector<SimilarityEdge> edges;
  std::vector<PathPosition> positions;  // by ascending node, then time
  bool has_vertical = true;
  double clock_offset_s = 0, clock_offset_sigma_s = 0;                 // see CameraPositions
  double typical_horizontal_m = 0, typical_vertical_m = 0, worth = 2;  // see CameraPositions
  // How far each keyframe is off from the one before, as the images have it.
  PathDrift drift = {1e-4, 1e-4};
  // By how much an edge is off in translation, in lengths of the camera frames. It does not grow
  // with the drift: images hold the place of a camera to its neighbours, whatever bends the path in
  // the long run, and a larger one would look like the errors of positions.
  double shift = 1e-4;
};

// How the path drifts and the positions err.
struct PathNoise {
  PathDrift drift;
  PositionNoise horizontal;
  PositionNoise vertical;
};

}  // namespace mono3d::tracking
