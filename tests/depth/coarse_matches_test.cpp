// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/coarse_matches.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <opencv2/core.hpp>
#include <random>
#include <vector>

namespace mono3d {
namespace {

constexpr double kSurface = 0.5;
constexpr double kFineStep = 0.004;  // of the finest level

// 256x128 pixels of a crown: three of eight were matched, two planes beside a surface, all of which
// the level of a quarter of the size has.
class CoarseMatching : public testing::Test {
 protected:
  CoarseMatching()
      : depth_(128, 256, CV_32FC1, cv::Scalar(0)), response_(128, 256, CV_32SC1, cv::Scalar(60)) {
    levels_.push_back(LevelWith(2, kSurface));
    std::mt19937 random(1);
    for (int y = 0; y < depth_.rows; ++y) {
      for (int x = 0; x < depth_.cols; ++x) {
        if (random() % 8 < 3) SetMatched({x, y}, random() % 2 == 0 ? 2 : -2);
      }
    }
  }

  static CoarseMatches LevelWith(int level, double inverse_depth) {
    const cv::Mat found(128 >> level, 256 >> level, CV_32FC1, cv::Scalar(inverse_depth));
    return {level, kFineStep * (1 << level), found.clone(),
            cv::Mat(found.size(), CV_32FC1, cv::Scalar(0.2)), found.clone()};
  }

  void SetMatched(const cv::Point& pixel, double steps) {
    depth_.at<float>(pixel) = static_cast<float>(1 / (kSurface + steps * kFineStep));
  }

  cv::Mat Found() const {
    return FindCoarseMatches({.levels = levels_,
                              .depth = depth_,
                              .response = response_,
                              .min_response = 50,
                              .min_uniqueness = 0.1F,
                              .min_support = 13});
  }
  int NumFound() const {
    const cv::Mat found = Found();
    cv::Mat channels[3];
    cv::split(found, channels);
    return cv::countNonZero(channels[2]);
  }

  cv::Mat depth_;
  cv::Mat response_;
  std::vector<CoarseMatches> levels_;
};

TEST_F(CoarseMatching, FindsASurfaceOfWhichFewPixelsMatch) {
  const cv::Mat found = Found();
  ASSERT_EQ(found.size(), cv::Size(64, 32));
  EXPECT_EQ(NumFound(), 64 * 32);
  const auto cell = found.at<cv::Vec3f>(16, 32);
  EXPECT_FLOAT_EQ(cell[0], float(kSurface));
  EXPECT_FLOAT_EQ(cell[1], float(4 * kFineStep));
  // What was matched is 1.6 % of the depth beside it.
  EXPECT_NEAR(cell[2], 1 / (1 + 16.0), 0.002);
}

TEST_F(CoarseMatching, LeavesNarrowHolesAndWhatNobodySees) {
  for (int y = 0; y < depth_.rows; ++y) {
    for (int x = 0; x < depth_.cols; ++x) {
      const bool is_left = x < 128;
      if (is_left && x % 5 != 0) SetMatched({x, y}, 0);
      if (!is_left) depth_.at<float>(y, x) = 0;
    }
  }
  const cv::Mat found = Found();
  // Windows reach four coarse pixels, and beside the border both halves are in them.
  cv::Mat left = found.colRange(0, 27);
  cv::Mat right = found.colRange(37, 64);
  EXPECT_EQ(cv::countNonZero(left.clone().reshape(1)), 0);
  EXPECT_EQ(cv::countNonZero(right.clone().reshape(1)), 0);
}

TEST_F(CoarseMatching, AsksForTexture) {
  response_.setTo(40);
  EXPECT_EQ(NumFound(), 0);
}

TEST_F(CoarseMatching, AsksForClearWinnersThatAgree) {
  const CoarseMatches before = levels_[0];
  levels_[0].uniqueness = cv::Mat(before.uniqueness.size(), CV_32FC1, cv::Scalar(0.05));
  EXPECT_EQ(NumFound(), 0);
  levels_[0] = before;
  levels_[0].winners = cv::Mat(before.winners + 2.5 * before.step).clone();
  EXPECT_EQ(NumFound(), 0);
  levels_[0].winners = cv::Mat(before.winners + 1.5 * before.step).clone();
  EXPECT_EQ(NumFound(), 64 * 32);
}

TEST_F(CoarseMatching, AsksForWhatWasMatchedToLieOnIt) {
  for (int y = 0; y < depth_.rows; ++y) {
    for (int x = 0; x < depth_.cols; ++x) {
      if (depth_.at<float>(y, x) > 0) SetMatched({x, y}, 9);  // two coarse planes are eight steps
    }
  }
  EXPECT_EQ(NumFound(), 0);
}

TEST_F(CoarseMatching, TakesTheFinestLevelThatCounts) {
  levels_.insert(levels_.begin(), LevelWith(1, kSurface + kFineStep));
  EXPECT_FLOAT_EQ(Found().at<cv::Vec3f>(16, 32)[0], float(kSurface + kFineStep));
  levels_[0].uniqueness = cv::Mat::zeros(levels_[0].uniqueness.size(), CV_32FC1);
  EXPECT_FLOAT_EQ(Found().at<cv::Vec3f>(16, 32)[0], float(kSurface));
}

TEST_F(CoarseMatching, FindsNothingWithoutACoarserLevel) {
  levels_.clear();
  EXPECT_EQ(NumFound(), 0);
}

}  // namespace
}  // namespace mono3d
