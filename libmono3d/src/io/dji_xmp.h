// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <optional>
#include <string>

namespace mono3d {

// The calibration of one camera, measured by its maker (DewarpData). In pixels of the picture as
// the camera took it; distortion as in CameraModel.
struct DjiDewarpData {
  std::string date;
  double fx = 0;        // px
  double fy = 0;        // px
  double offset_x = 0;  // px, of the principal point from the middle of the picture
  double offset_y = 0;  // px
  std::array<double, 5> distortion = {0, 0, 0, 0, 0};
};

// Where the drone was and the camera looked when it took a photo; nothing where it is not told.
struct DjiXmpPosition {
  std::optional<double> latitude_deg;
  std::optional<double> longitude_deg;
  int num_decimals = 0;              // of latitude or longitude as written
  std::optional<double> altitude_m;  // above the ellipsoid or the sea
  std::optional<double> height_m;    // above the place of take-off
  // Standard deviations of RTK; 0: not told.
  double sigma_latitude_m = 0;
  double sigma_longitude_m = 0;
  double sigma_height_m = 0;
  // From north to the east, upwards, clockwise.
  std::optional<double> gimbal_yaw_deg;
  std::optional<double> gimbal_pitch_deg;
  std::optional<double> gimbal_roll_deg;
};

// What DJI writes of the camera into the XMP of photos.
struct DjiXmp {
  std::string serial;          // of the camera
  double design_focal_px = 0;  // CalibratedFocalLength: as designed; 0: not told
  double design_centre_x = 0;  // px from the corner of the picture; 0: not told
  double design_centre_y = 0;  // px
  std::optional<DjiDewarpData> dewarp;
  DjiXmpPosition position;
  bool is_dewarped = false;       // the camera took the distortion out
  bool has_absurd_value = false;  // and it was left out
};

// `packet` is the XMP of a photo. Nothing when it is no well-formed XML; one of another maker is
// one that tells nothing.
std::optional<DjiXmp> ParseDjiXmp(const std::string& packet);

}  // namespace mono3d
