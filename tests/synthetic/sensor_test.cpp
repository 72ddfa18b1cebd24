// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/sensor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>

#include "mono3d/core/error.h"

namespace mono3d::synthetic {
namespace {

cv::Mat Uniform(float level) { return cv::Mat(96, 160, CV_32FC3, cv::Scalar::all(level)); }

// Back to linear light, 0 to 1.
cv::Mat Linear(const cv::Mat& bgr) {
  cv::Mat linear;
  bgr.convertTo(linear, CV_64F, 1 / 255.0);
  cv::pow(linear, 2.2, linear);
  return linear.reshape(1);
}

TEST(Develop, AppliesTheGammaAndClips) {
  EXPECT_EQ(Develop(Uniform(1), {}, 0, 0).at<cv::Vec3b>(3, 4)[1], 255);
  EXPECT_EQ(Develop(Uniform(7), {}, 0, 0).at<cv::Vec3b>(3, 4)[1], 255);
  EXPECT_EQ(Develop(Uniform(0), {}, 0, 0).at<cv::Vec3b>(3, 4)[1], 0);
  // 255 * 0.5^(1 / 2.2) = 186.1
  EXPECT_EQ(Develop(Uniform(0.5F), {}, 0, 0).at<cv::Vec3b>(3, 4)[1], 186);
}

TEST(Develop, NoiseHasItsStandardDeviation) {
  SensorOptions options;
  options.shot_noise = 0.06;
  options.read_noise = 0.02;
  for (const double level : {0.25, 0.5}) {
    cv::Scalar mean;
    cv::Scalar sigma;
    cv::meanStdDev(Linear(Develop(Uniform(static_cast<float>(level)), options, 0, 0)), mean, sigma);
    // 46,080 values: a standard error of 0.3 % of sigma; grey levels are 1 % of the range at most.
    const double expected = std::sqrt(0.06 * 0.06 * level + 0.02 * 0.02);
    EXPECT_NEAR(sigma[0], expected, 0.02 * expected);
    EXPECT_NEAR(mean[0], level, 0.001);
  }
}

TEST(Develop, GivesEachFrameNoiseOfItsOwnAndTheSameFrameTheSame) {
  SensorOptions options;
  options.read_noise = 0.05;
  const cv::Mat a = Develop(Uniform(0.5F), options, 0, 0);
  EXPECT_EQ(cv::norm(a, Develop(Uniform(0.5F), options, 0, 0), cv::NORM_INF), 0);
  const cv::Mat next = Linear(Develop(Uniform(0.5F), options, 0, 1)) - 0.5;
  // Independent: the correlation of 46,080 pairs is 0 within 5 standard errors of 1 / sqrt(46,080).
  const cv::Mat first = Linear(a) - 0.5;
  const double correlation = first.dot(next) / (cv::norm(first) * cv::norm(next));
  EXPECT_LT(std::abs(correlation), 5 / std::sqrt(46080.0));
}

TEST(Develop, VignettingTakesItsShareInTheCornersAndNothingInTheMiddle) {
  SensorOptions options;
  options.vignetting = 0.4;
  const cv::Mat radiance(97, 161, CV_32FC3, cv::Scalar::all(0.8));
  const cv::Mat linear = Linear(Develop(radiance, options, 0, 0));
  constexpr double kGreyLevel = 0.01;  // of the linear range
  EXPECT_NEAR(linear.at<double>(48, 3 * 80), 0.8, kGreyLevel);
  EXPECT_NEAR(linear.at<double>(0, 0), 0.8 * 0.6, kGreyLevel);
  EXPECT_NEAR(linear.at<double>(96, 3 * 160), 0.8 * 0.6, kGreyLevel);
}

TEST(Develop, AutoExposureBringsTheMeanToGrey) {
  SensorOptions options;
  options.auto_exposure = 1;
  for (const float level : {0.02F, 0.6F}) {
    EXPECT_NEAR(cv::mean(Linear(Develop(Uniform(level), options, 0, 0)))[0], 0.18, 0.005);
  }
}

TEST(ExposureDrift, IsSlowAndHasItsSpread) {
  SensorOptions options;
  EXPECT_EQ(ExposureDrift(options, 12), 1);
  options.exposure_drift_stops = 0.5;
  double square = 0;
  constexpr int kNumTimes = 5000;
  for (int t_s = 0; t_s < kNumTimes; ++t_s) {
    const double stops = std::log2(ExposureDrift(options, t_s));
    square += stops * stops / kNumTimes;
    EXPECT_NEAR(std::log2(ExposureDrift(options, t_s + 0.1)), stops, 0.08);
  }
  EXPECT_NEAR(std::sqrt(square), 0.5, 0.03);  // few swings over many of their periods
}

TEST(Develop, RefusesBadInput) {
  EXPECT_THROW(Develop(cv::Mat(4, 4, CV_8UC3), {}, 0, 0), Error);
  SensorOptions options;
  options.vignetting = 1;
  EXPECT_THROW(Develop(Uniform(1), options, 0, 0), UsageError);
  options = {};
  options.readout_s = -1;
  EXPECT_THROW(Develop(Uniform(1), options, 0, 0), UsageError);
}

}  // namespace
}  // namespace mono3d::synthetic
