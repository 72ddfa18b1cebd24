// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <string>

#include "mono3d/core/options.h"
#include "mono3d/geometry/camera_model.h"

namespace mono3d::synthetic {

inline constexpr std::array<const char*, 4> kReadoutDirections = {"down", "up", "right", "left"};

// What a real camera does to a picture. Every imperfection is off by default.
struct SensorOptions {
  // The shutter.
  double readout_s = 0;  // rolling shutter: from the first line to the last; 0: all at once
  // Where the lines are read to. down: rows, the top one first; right: columns, the left one first,
  // as of a sensor turned by 90 degrees. One of kReadoutDirections.
  std::string readout_direction = "down";
  double exposure_s = 0;  // that the shutter of a line is open: motion blur; 0: a moment
  // The light.
  double exposure = 1;              // brightness factor
  double auto_exposure = 0;         // share of the way to a mean level of 0.18, 0 to 1
  double exposure_drift_stops = 0;  // standard deviation of a slow seeded drift; 1 stop: a factor 2
  double exposure_step = 0;         // share by which the exposure jumps up or down; 0.3: factor 1.3
  double exposure_step_interval_s = 5;  // mean time between jumps
  double vignetting = 0;                // share of the light that is lost in the corners, below 1
  // The noise, in linear light; 1 is the level at which a pixel is full.
  double shot_noise = 0;  // standard deviation at full level; falls with the root of the level
  double read_noise = 0;  // standard deviation at every level
  // The same by the number of electrons instead: full_well_electrons fill a pixel, a gain'th of
  // them makes it white. Low light: a high gain, the same brightness of fewer electrons.
  double full_well_electrons = 0;   // 0: as above
  double gain = 1;                  // ISO over base ISO, at least 1
  double read_noise_electrons = 0;  // standard deviation of each reading
  // The processing.
  double denoise = 0;                // smoothing of the noise, 0 to 1
  std::string tone_curve = "gamma";  // one of kToneCurves
  double tone_contrast = 0.5;        // of the S curve
  int seed = 1;                      // of drift, jumps and noise

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// The rolling shutter's lines, rows or columns.
bool ReadsColumns(const SensorOptions& options);
bool ReadsBackwards(const SensorOptions& options);  // up or left
int NumLines(const SensorOptions& options, int width, int height);
// From a line to the next one, down or to the right; below 0 where they are read up or to the left.
double LineDelay_s(const SensorOptions& options, int width, int height);
RollingShutter ShutterOf(const SensorOptions& options);

}  // namespace mono3d::synthetic
