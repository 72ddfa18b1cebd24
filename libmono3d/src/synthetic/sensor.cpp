// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/sensor.h"

#include <algorithm>
#include <cstdint>
#include <opencv2/core.hpp>
#include <opencv2/core/utility.hpp>

#include "mono3d/core/error.h"
#include "synthetic/exposure.h"
#include "synthetic/sensor_noise.h"
#include "synthetic/tone_curve.h"

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

}  // namespace

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
