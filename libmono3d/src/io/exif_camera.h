// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <string>

namespace mono3d {

// Where the receiver of the camera was (WGS 84).
struct ExifPosition {
  double latitude_deg = 0;
  double longitude_deg = 0;
  int num_decimals = 0;              // of the degrees, that the file can tell
  std::optional<double> altitude_m;  // above the ellipsoid or the sea, as the device tells it
  double sigma_horizontal_m = 0;     // GPSHPositioningError; 0: not told
};

// What EXIF says of the camera; numbers that are not told, or no positive numbers, are 0.
struct ExifCamera {
  std::string make;
  std::string model;
  std::string serial;        // of the body
  std::string lens;          // its model
  int width = 0;             // px, of the picture when EXIF was written (PixelXDimension)
  int height = 0;            // px
  double focal_mm = 0;       // of the lens
  double focal_35mm = 0;     // mm; the same view on film of 36 mm x 24 mm
  double pixels_per_mm = 0;  // on the sensor
  double digital_zoom = 1;   // 1 or more
  int orientation = 1;       // 1 to 8
  std::optional<ExifPosition> position;
  // When the photo was taken by the camera's clock, "2022:05:01 15:01:58.25", and that clock's
  // offset from UTC, "+02:00"; empty: not told.
  std::string taken;
  std::string taken_zone;
  // In TIFF files.
  int stored_width = 0;   // px
  int stored_height = 0;  // px
  std::string xmp;
  bool is_damaged = false;  // a part could not be read
};

// `block` begins with "Exif\0\0". Whatever its content, what can be read is returned.
ExifCamera ParseExif(const std::string& block);

}  // namespace mono3d
