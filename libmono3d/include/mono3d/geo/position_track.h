// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/core/export.h"

namespace MONO3D_EXPORT mono3d {

// Where the camera points, as the gimbal tells it: yaw from true north to the east, pitch upwards
// (-90: straight down), roll clockwise.
struct GimbalAngles {
  double yaw_deg = 0;
  double pitch_deg = 0;
  double roll_deg = 0;
};

// Where a receiver says it is (WGS 84).
struct PositionFix {
  double time_s = 0;  // see PositionTrack::clock
  double latitude_deg = 0;
  double longitude_deg = 0;
  std::optional<double> altitude_m;  // as the device tells it: above the ellipsoid or the sea
  std::optional<double> height_m;    // above the place of take-off, mostly by the barometer
  // Standard deviations as the receiver states them; 0: not stated.
  double sigma_horizontal_m = 0;
  double sigma_vertical_m = 0;
  std::optional<GimbalAngles> gimbal;
  std::string image;     // the file name of the image it belongs to; empty: by its time
  std::size_t line = 0;  // of the file, from 1; 0: not a text file
};

// What PositionFix::time_s counts from.
enum class PositionClock {
  kVideo,   // the beginning of the video; as files tell it, often off by some seconds
  kUnix,    // 1970, in UTC or in the local time of the device: the offset to the images is unknown
  kImages,  // fixes belong to images by name; see PositionTrack::has_image_times
};

// Positions in the order of their times.
struct PositionTrack {
  std::string source;  // the file or folder
  std::string form;    // "DJI telemetry (GPS)", "GPX", ...
  PositionClock clock = PositionClock::kVideo;
  // With kImages: times are those at which the images were taken, as of kUnix; else all are 0.
  bool has_image_times = false;
  std::vector<PositionFix> fixes;
  // The smallest step that latitude and longitude are written in, in metres on the ground: a file
  // with four decimals knows places to 11 m.
  double resolution_m = 0;
  std::size_t num_entries = 0;           // that the file has, with or without a position
  std::size_t num_without_position = 0;  // no fix: nothing, "n/a", or latitude and longitude 0
  std::size_t num_unreadable = 0;        // entries that are cut off or make no sense
  std::string first_unreadable;          // "line 12: ..."; empty: none
};

}  // namespace mono3d
