// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/sensor_options.h"

#include <cmath>

#include "synthetic/tone_curve.h"
#include "synthetic/words.h"

namespace mono3d::synthetic {
namespace {

void RequireNonNegative(const char* name, double value) {
  RequireOption(std::isfinite(value) && value >= 0, name, "at least 0", value);
}

void ValidateElectrons(const SensorOptions& options) {
  RequireNonNegative("sensor.full_well_electrons", options.full_well_electrons);
  RequireNonNegative("sensor.read_noise_electrons", options.read_noise_electrons);
  RequireOption(std::isfinite(options.gain) && options.gain >= 1, "sensor.gain", "at least 1",
                options.gain);
  const bool counts = options.full_well_electrons > 0;
  RequireOption(!counts || options.shot_noise + options.read_noise <= 0,
                "sensor.full_well_electrons", "0 with sensor.shot_noise or sensor.read_noise",
                options.full_well_electrons);
  RequireOption(counts || (options.gain == 1 && options.read_noise_electrons <= 0),
                "sensor.full_well_electrons",
                "above 0 with sensor.gain or sensor.read_noise_electrons",
                options.full_well_electrons);
}

}  // namespace

void SensorOptions::Visit(OptionVisitor& visit) {
  visit("readout_s", readout_s, "rolling shutter: from the first line to the last, seconds");
  visit("readout_direction", readout_direction,
        "lines are read down, up (rows), right or left (columns)");
  visit("exposure_s", exposure_s, "motion blur: how long the shutter is open, seconds");
  visit("exposure", exposure, "brightness factor");
  visit("auto_exposure", auto_exposure, "share of the way to a mean level of 0.18, 0 to 1");
  visit("exposure_drift_stops", exposure_drift_stops, "standard deviation of a slow drift, stops");
  visit("exposure_step", exposure_step, "jumps of the exposure, 0.3: by 30 % at once");
  visit("exposure_step_interval_s", exposure_step_interval_s, "mean time between jumps, seconds");
  visit("vignetting", vignetting, "share of the light lost in the corners, below 1");
  visit("shot_noise", shot_noise, "standard deviation at full level, full level = 1");
  visit("read_noise", read_noise, "standard deviation at every level, full level = 1");
  visit("full_well_electrons", full_well_electrons,
        "count photons: electrons that fill a pixel; 0: noise as of shot_noise and read_noise");
  visit("gain", gain, "with full_well_electrons: amplification, as ISO over base ISO");
  visit("read_noise_electrons", read_noise_electrons, "with full_well_electrons: of each reading");
  visit("denoise", denoise, "smoothing of the noise in the camera, 0 to 1");
  visit("tone_curve", tone_curve, "gamma (2.2), linear, srgb or s_curve");
  visit("tone_contrast", tone_contrast, "of s_curve, 0 (sRGB) to 1");
  visit("seed", seed, "seed of drift, jumps and noise");
}

void SensorOptions::Validate() const {
  RequireNonNegative("sensor.readout_s", readout_s);
  RequireNonNegative("sensor.exposure_s", exposure_s);
  RequireOption(std::isfinite(exposure) && exposure > 0, "sensor.exposure", "above 0", exposure);
  RequireOption(auto_exposure >= 0 && auto_exposure <= 1, "sensor.auto_exposure", "0 to 1",
                auto_exposure);
  RequireNonNegative("sensor.exposure_drift_stops", exposure_drift_stops);
  RequireOption(vignetting >= 0 && vignetting < 1, "sensor.vignetting", "at least 0, below 1",
                vignetting);
  RequireNonNegative("sensor.shot_noise", shot_noise);
  RequireNonNegative("sensor.read_noise", read_noise);
  RequireOneOf("sensor.readout_direction", readout_direction, kReadoutDirections);
  RequireOption(exposure_step >= 0 && exposure_step <= 10, "sensor.exposure_step", "0 to 10",
                exposure_step);
  RequireOption(std::isfinite(exposure_step_interval_s) && exposure_step_interval_s >= 1e-3,
                "sensor.exposure_step_interval_s", "at least 0.001", exposure_step_interval_s);
  ValidateElectrons(*this);
  RequireOption(denoise >= 0 && denoise <= 1, "sensor.denoise", "0 to 1", denoise);
  RequireOneOf("sensor.tone_curve", tone_curve, kToneCurves);
  RequireOption(tone_contrast >= 0 && tone_contrast <= 1, "sensor.tone_contrast", "0 to 1",
                tone_contrast);
}

bool ReadsColumns(const SensorOptions& options) {
  return options.readout_direction == "right" || options.readout_direction == "left";
}

bool ReadsBackwards(const SensorOptions& options) {
  return options.readout_direction == "up" || options.readout_direction == "left";
}

int NumLines(const SensorOptions& options, int width, int height) {
  return ReadsColumns(options) ? width : height;
}

double LineDelay_s(const SensorOptions& options, int width, int height) {
  const int num_lines = NumLines(options, width, height);
  if (num_lines < 2) return 0;
  return ShutterOf(options).readout_s / (num_lines - 1);
}

RollingShutter ShutterOf(const SensorOptions& options) {
  return {ReadsBackwards(options) ? -options.readout_s : options.readout_s, ReadsColumns(options)};
}

}  // namespace mono3d::synthetic
