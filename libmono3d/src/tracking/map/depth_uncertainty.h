// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>

#include "tracking/map/map.h"

namespace mono3d::tracking {

// A point that was only seen under rotation is a direction: the inverse of its distance from where
// it was seen is a guess with a standard deviation, MapPoint::depth_sigma, as a share of it
// (Civera, Davison, Montiel 2008). It holds a camera's rotation as any point does, its translation
// only as far as the depth is known.

// Of a guess: by a factor of two to either side.
inline constexpr double kGuessedDepthSigma = 0.5;
// Below, a point is as good as any other: what is left moves it by 0.3 px at f = 300 px and a
// baseline of 0.05 of the depth, where more views have told more.
inline constexpr double kKnownDepthSigma = 0.02;

// Where the keyframes that see the point are in the mean: the depth from there is what is guessed.
Eigen::Vector3d MeanCentre(const Map& map, const MapPoint& point);

// How the point moves, in the world, for one standard deviation of its inverse depth; zero where
// the depth is known.
Eigen::Vector3d DepthAxis(const Map& map, const MapPoint& point);

// The standard deviation of the inverse depth by what the keyframes see, as a share of it, together
// with that of the guess: by how far the keyframes lie apart across the line of sight.
double DepthSigma(const Map& map, const MapPoint& point);

// The same for the points that a keyframe sees whose depth is not known; those that are known well
// enough now (kKnownDepthSigma) become ordinary points.
void UpdateDepthSigmas(Map& map, KeyframeId keyframe);

// The share of the points in view that are directions.
double ShareOfDirections(const Map& map, const View& view);

}  // namespace mono3d::tracking
