// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "tracking/map/map.h"

namespace mono3d::tracking {

// Whether what was read from elsewhere can be: nothing refers to what is not there.

// Points, keyframes and constraints of a map agree with each other; an empty map does.
bool AreConsistent(const Map& map);

// The places of all points that are not alive, each once.
bool AreFreePlaces(const Map& map, const std::vector<std::uint32_t>& places);

// On a level, in an image of the camera, with an angle from 0 to 360 degrees.
bool IsFeatureOf(const CameraModel& camera, int num_levels, const Feature& feature);

// One point or none of each feature, each in a place that the map has.
bool IsViewOf(const Map& map, const View& view);

// The keyframe is one of the map, and alive or fixed to one that is.
bool IsKeyframeOf(const Map& map, KeyframeId keyframe);

}  // namespace mono3d::tracking
