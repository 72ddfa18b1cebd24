// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/sensor.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include "mono3d/core/error.h"
#include "synthetic/exposure.h"
#include "synthetic/sensor_noise.h"
#include "synthetic/tone_curve.h"
#include "synthetic/words.h"

namespace mono3d::synthetic {
namespace {

// The level that is read from each pixel, 0 to 1.
cv::Mat ExposeSensor(const cv::Mat& radiance, double exposure, double vignetting,
                     const SensorNoise& noise) {
  const auto gain = static_cast<float>(exposure);
  const auto lost = static_cast<float>(vignetting);
  const bool is_noisy = !noise.IsNone();
  const cv::Point2f middle(0.5F * static_cast<float>(radiance.cols - 1),
                           0.5F * static_cast<float>(radiance.rows - 1));
  const float corner_square = std::max(middle.dot(middle), 1.0F);
  cv::Mat levels(radiance.size(), CV_32FC3);
  cv::parallel_for_(cv::Range(0, radiance.rows), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < radiance.cols; ++x) {
        const cv::Point2f off(static_cast<float>(x) - middle.x, static_cast<float>(y) - middle.y);
        const float light = gain * (1 - lost * off.dot(off) / corner_square);
        for (int channel = 0; channel < 3; ++channel) {
          float level =
              std::clamp(light * radiance.at<cv::Vec3f>(y, x)[channel], 0.0F, noise.max_level());
          if (is_noisy) level = noise.Add(level, {x, y}, channel);
          levels.at<cv::Vec3f>(y, x)[channel] = std::clamp(level, 0.0F, 1.0F);
        }
      }
    }
  });
  return levels;
}

cv::Mat ApplyToneCurve(const cv::Mat& levels, const ToneCurve& curve) {
  cv::Mat bgr(levels.size(), CV_8UC3);
  cv::parallel_for_(cv::Range(0, levels.rows), [&](const cv::Range& rows) {
    for (int y = rows.start; y < rows.end; ++y) {
      for (int x = 0; x < levels.cols; ++x) {
        for (int channel = 0; channel < 3; ++channel) {
          const float grey = 255 * curve(levels.at<cv::Vec3f>(y, x)[channel]);
          bgr.at<cv::Vec3b>(y, x)[channel] = static_cast<std::uint8_t>(grey + 0.5F);
        }
      }
    }
  });
  return bgr;
}

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
  return (ReadsBackwards(options) ? -1 : 1) * options.readout_s / (num_lines - 1);
}

cv::Mat Develop(const cv::Mat& radiance, const SensorOptions& options, double t_s, int frame) {
  options.Validate();
  if (radiance.type() != CV_32FC3) throw Error("radiance to be developed must be CV_32FC3");
  const SensorNoise noise(options, frame);
  cv::Mat levels =
      ExposeSensor(radiance, ExposureFactor(radiance, options, t_s), options.vignetting, noise);
  if (options.denoise > 0 && !noise.IsNone()) levels = SmoothNoise(levels, noise, options.denoise);
  return ApplyToneCurve(levels, ToneCurve(options.tone_curve, options.tone_contrast));
}

}  // namespace mono3d::synthetic
