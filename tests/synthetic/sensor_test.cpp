// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/sensor.h"

#include <gtest/gtest.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <vector>

#include "mono3d/core/error.h"
#include "synthetic/exposure.h"
#include "synthetic/tone_curve.h"

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

// All three channels of all pixels, in electrons of a full well of `electrons` at white.
cv::Mat Electrons(const cv::Mat& bgr, double electrons) {
  cv::Mat counts;
  bgr.convertTo(counts, CV_64F, electrons / 255.0);  // of a linear tone curve
  return counts.reshape(1);
}

SensorOptions PhotonCounter(double full_well_electrons, double gain) {
  SensorOptions options;
  options.full_well_electrons = full_well_electrons;
  options.gain = gain;
  options.tone_curve = "linear";
  return options;
}

TEST(Develop, CountsPhotonsWhoseVarianceIsTheirNumber) {
  // 255 electrons at white: a grey level is an electron. Few are counted, many are drawn from the
  // normal distribution.
  const SensorOptions options = PhotonCounter(2040, 8);
  for (const double mean : {3.0, 20.0, 100.0}) {
    const cv::Mat radiance = Uniform(static_cast<float>(mean / 255));
    cv::Scalar found;
    cv::Scalar sigma;
    cv::meanStdDev(Electrons(Develop(radiance, options, 0, 0), 255), found, sigma);
    // 46,080 values: standard errors of 0.5 % of sigma for the mean and of 0.7 % for the variance.
    EXPECT_NEAR(found[0], mean, 0.02 * std::sqrt(mean));
    EXPECT_NEAR(sigma[0] * sigma[0], mean, 0.03 * mean);
  }
}

TEST(Develop, CountsOfFewPhotonsHaveThePoissonDistribution) {
  const cv::Mat counts =
      Electrons(Develop(Uniform(static_cast<float>(2.0 / 255)), PhotonCounter(255, 1), 0, 0), 255);
  const double expected[] = {0.13534, 0.27067, 0.27067, 0.18045, 0.09022, 0.03609, 0.01203};
  for (int count = 0; count < 7; ++count) {
    const cv::Mat is_count = (counts > count - 0.5) & (counts < count + 0.5);
    const double share = cv::countNonZero(is_count) / static_cast<double>(counts.total());
    // Four standard errors of a share of 46,080.
    EXPECT_NEAR(share, expected[count],
                4 * std::sqrt(expected[count] * (1 - expected[count]) / 46080))
        << count;
  }
}

TEST(Develop, GainTradesPhotonsForBrightness) {
  // The same brightness at sixteen times the gain: four times the noise.
  cv::Scalar mean;
  cv::Scalar low;
  cv::Scalar high;
  SensorOptions options = PhotonCounter(20000, 1);
  options.tone_curve = "gamma";
  cv::meanStdDev(Linear(Develop(Uniform(0.4F), options, 0, 0)), mean, low);
  options.gain = 16;
  cv::meanStdDev(Linear(Develop(Uniform(0.4F), options, 0, 0)), mean, high);
  EXPECT_NEAR(mean[0], 0.4, 0.002);
  EXPECT_NEAR(high[0], std::sqrt(0.4 * 16 / 20000), 0.03 * high[0]);
  EXPECT_NEAR(high[0] / low[0], 4, 0.2);
}

TEST(Develop, ReadNoiseIsInElectrons) {
  SensorOptions options = PhotonCounter(2550, 10);
  options.read_noise_electrons = 12;
  cv::Scalar mean;
  cv::Scalar sigma;
  cv::meanStdDev(Electrons(Develop(Uniform(100.0F / 255), options, 0, 0), 255), mean, sigma);
  EXPECT_NEAR(mean[0], 100, 0.4);
  EXPECT_NEAR(sigma[0], std::sqrt(100.0 + 12 * 12), 0.3);
}

TEST(Develop, DenoisingTakesNoiseAwayAndKeepsEdges) {
  SensorOptions options = PhotonCounter(2000, 8);
  cv::Mat radiance = Uniform(0.2F);
  radiance.colRange(80, 160) = cv::Scalar::all(0.8);
  const auto spread = [&](double denoise, int first_column) {
    options.denoise = denoise;
    cv::Mat levels;
    Develop(radiance, options, 0, 0).convertTo(levels, CV_64F, 1 / 255.0);
    cv::Scalar mean;
    cv::Scalar sigma;
    cv::meanStdDev(levels.colRange(first_column, first_column + 70).clone().reshape(1), mean,
                   sigma);
    return cv::Vec2d(mean[0], sigma[0]);
  };
  EXPECT_LT(spread(1, 0)[1], 0.5 * spread(0, 0)[1]);
  EXPECT_LT(spread(0.5, 0)[1], 0.8 * spread(0, 0)[1]);
  // The edge stays where it is: the column on either side has the level of its own side.
  options.denoise = 1;
  cv::Mat levels;
  Develop(radiance, options, 0, 0).convertTo(levels, CV_64F, 1 / 255.0);
  EXPECT_NEAR(cv::mean(levels.col(79))[0], 0.2, 0.02);
  EXPECT_NEAR(cv::mean(levels.col(80))[0], 0.8, 0.02);
}

std::uint8_t GreyOfLevel(float level, const SensorOptions& options) {
  return Develop(Uniform(level), options, 0, 0).at<cv::Vec3b>(3, 4)[1];
}

TEST(Develop, AppliesTheToneCurveAskedFor) {
  SensorOptions options;
  options.tone_curve = "linear";
  EXPECT_EQ(GreyOfLevel(0.5F, options), 128);
  options.tone_curve = "srgb";
  EXPECT_EQ(GreyOfLevel(0.5F, options), 188);  // 255 * (1.055 * 0.5^(1 / 2.4) - 0.055) = 187.5
  EXPECT_EQ(GreyOfLevel(0.002F, options), 7);  // 255 * 12.92 * 0.002 = 6.6
  options.tone_curve = "s_curve";
  options.tone_contrast = 0;
  EXPECT_EQ(GreyOfLevel(0.5F, options), 188) << "sRGB";
  options.tone_contrast = 1;
  // 3 v^2 - 2 v^3 of v = 0.73536 and of v = 0.24941
  EXPECT_EQ(GreyOfLevel(0.5F, options), 211);
  EXPECT_EQ(GreyOfLevel(0.0507F, options), 40);
  EXPECT_EQ(GreyOfLevel(0, options), 0);
  EXPECT_EQ(GreyOfLevel(1, options), 255);
}

TEST(Develop, ToneCurvesNeverFall) {
  cv::Mat ramp(4, 4000, CV_32FC3);
  for (int x = 0; x < ramp.cols; ++x) {
    ramp.col(x) = cv::Scalar::all(static_cast<double>(x) / (ramp.cols - 1));
  }
  for (const char* curve : kToneCurves) {
    SensorOptions options;
    options.tone_curve = curve;
    options.tone_contrast = 1;
    const cv::Mat grey = Develop(ramp, options, 0, 0).reshape(1);
    for (int x = 3; x < grey.cols; ++x) {
      ASSERT_GE(grey.at<std::uint8_t>(0, x), grey.at<std::uint8_t>(0, x - 3)) << curve << x;
    }
  }
}

TEST(ExposureStep, JumpsUpAndDownAtOnce) {
  SensorOptions options;
  EXPECT_EQ(ExposureStep(options, 100), 1);
  options.exposure_step = 0.3;
  options.exposure_step_interval_s = 2;
  constexpr double kDuration_s = 400;
  constexpr double kStep_s = 0.01;
  int num_jumps = 0;
  double before = ExposureStep(options, 0);
  EXPECT_EQ(before, 1);
  for (double t_s = kStep_s; t_s < kDuration_s; t_s += kStep_s) {
    const double now = ExposureStep(options, t_s);
    if (now == before) continue;
    // Up by 30 % or back, with nothing in between.
    EXPECT_NEAR(std::abs(std::log(now / before)), std::log(1.3), 1e-12);
    EXPECT_LE(std::abs(std::log(now)), std::log(1.3) + 1e-12);
    before = now;
    ++num_jumps;
  }
  // 200 intervals of 2 s with a standard deviation of 0.58 s each: 200 +- 4.
  EXPECT_NEAR(num_jumps, kDuration_s / 2, 16);
}

TEST(ExposureStep, IsOfItsSeed) {
  SensorOptions options;
  options.exposure_step = 0.3;
  options.exposure_step_interval_s = 1;
  const auto steps = [&](int seed) {
    options.seed = seed;
    std::vector<double> values;
    for (int i = 0; i < 100; ++i) values.push_back(ExposureStep(options, 0.25 * i));
    return values;
  };
  EXPECT_EQ(steps(3), steps(3));
  EXPECT_NE(steps(3), steps(4));
}

TEST(ExposureFactor, IsWhatThePictureWasMultipliedBy) {
  SensorOptions options;
  options.exposure = 0.7;
  options.auto_exposure = 0.5;
  options.exposure_drift_stops = 0.3;
  options.exposure_step = 0.3;
  options.exposure_step_interval_s = 1;
  for (const double t_s : {0.0, 1.7, 8.2}) {
    const double factor = ExposureFactor(Uniform(0.3F), options, t_s);
    const double level = cv::mean(Linear(Develop(Uniform(0.3F), options, t_s, 0)))[0];
    EXPECT_NEAR(level, 0.3 * factor, 0.003) << t_s;
  }
}

TEST(Develop, RefusesBadInput) {
  EXPECT_THROW(Develop(cv::Mat(4, 4, CV_8UC3), {}, 0, 0), Error);
  SensorOptions options;
  options.vignetting = 1;
  EXPECT_THROW(Develop(Uniform(1), options, 0, 0), UsageError);
  options = {};
  options.readout_s = -1;
  EXPECT_THROW(Develop(Uniform(1), options, 0, 0), UsageError);
  options = {};
  options.readout_direction = "sideways";
  EXPECT_THROW(Develop(Uniform(1), options, 0, 0), UsageError);
  options = {};
  options.tone_curve = "film";
  EXPECT_THROW(Develop(Uniform(1), options, 0, 0), UsageError);
  options = {};
  options.gain = 4;  // of nothing that is counted
  EXPECT_THROW(Develop(Uniform(1), options, 0, 0), UsageError);
  options = {};
  options.full_well_electrons = 1000;
  options.shot_noise = 0.01;  // twice
  EXPECT_THROW(Develop(Uniform(1), options, 0, 0), UsageError);
}

}  // namespace
}  // namespace mono3d::synthetic
