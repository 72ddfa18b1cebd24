// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <string>

#include "synthetic/gps.h"

namespace mono3d::tools {

// What a camera notes in its pictures. The sensor is of full frame, 36 mm wide: focal lengths in
// mm and in 35 mm equivalents are the same.
struct ExifFacts {
  double timestamp_s = 0;  // after the start of the flight, at most 86399
  int width = 0;           // px
  int height = 0;          // px
  double focal_px = 0;
  std::optional<Geodetic> place;
};

// The day and the hour at which each simulated flight starts: 21 June 2025, 10:00:00 UTC.
// The picture's time, position (to 3e-5 m), focal length and size as EXIF, put into a JPEG file's
// bytes behind its first marker. Throws Error when `jpeg` is none.
std::string WithExif(const std::string& jpeg, const ExifFacts& facts);

}  // namespace mono3d::tools
