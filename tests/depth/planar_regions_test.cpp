// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/planar_regions.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <opencv2/core.hpp>
#include <random>

#include "depth/image_cells.h"
#include "depth/stage_testing.h"

namespace mono3d {
namespace {

constexpr double kPlaneStep = 0.02;  // 1/su
const cv::Size kImage(320, 240);
const cv::Rect kBare(80, 60, 160, 120);  // in the middle

struct View {
  cv::Mat bgr = cv::Mat(kImage, CV_8UC3, cv::Scalar::all(150));
  cv::Mat depth = cv::Mat(kImage, CV_32FC1, cv::Scalar(0));
  cv::Mat unfiltered = cv::Mat(kImage, CV_32FC1, cv::Scalar(0));
  cv::Mat sky = cv::Mat(kImage / kImageCell_px, CV_8UC1, cv::Scalar(0));
  cv::Mat winners = {};
  int winner_level = 0;
};

using Surface = std::function<double(int, int)>;  // inverse depth, 1/su

// Planes of the sweep times kPlaneStep.
double Tilted(int x, int y) { return kPlaneStep * (40 + 0.05 * x - 0.03 * y); }

// Matched around kBare, with a third of a plane of noise, and not in it.
View BareInTheMiddle(const Surface& surface, std::mt19937& random) {
  View view;
  std::normal_distribution<double> noise(0, kPlaneStep / 3);
  for (int y = 0; y < kImage.height; ++y) {
    for (int x = 0; x < kImage.width; ++x) {
      if (kBare.contains({x, y})) continue;
      view.bgr.at<cv::Vec3b>(y, x) = cv::Vec3b::all(static_cast<std::uint8_t>(90 + random() % 80));
      view.depth.at<float>(y, x) = static_cast<float>(1 / (surface(x, y) + noise(random)));
    }
  }
  return view;
}

cv::Mat PlanesIn(const View& view) {
  return FindPlanarRegions({.bgr = view.bgr,
                            .depth = view.depth,
                            .unfiltered = view.unfiltered,
                            .winners = view.winners,
                            .winner_level = view.winner_level,
                            .sky = view.sky,
                            .step = kPlaneStep,
                            .max_difference = 3});
}

const cv::Rect kBareCells(kBare.tl() / kImageCell_px, kBare.size() / kImageCell_px);

int NumWithPlane(const cv::Mat& cells) {
  cv::Mat confidence;
  cv::extractChannel(cells, confidence, 3);
  return cv::countNonZero(confidence > 0);
}

// Within a fifth of a plane of the sweep, and the slopes with it.
void ExpectTilted(const cv::Mat& cells) {
  for (int y = kBareCells.y; y < kBareCells.br().y; ++y) {
    for (int x = kBareCells.x; x < kBareCells.br().x; ++x) {
      const auto& cell = cells.at<cv::Vec4f>(y, x);
      const double middle = kPlaneStep * (40 + 0.05 * (4 * x + 1.5) - 0.03 * (4 * y + 1.5));
      ASSERT_NEAR(double(cell[0]), middle, kPlaneStep / 5) << x << " " << y;
      ASSERT_NEAR(double(cell[1]), 0.05 * kPlaneStep, 0.002 * kPlaneStep);
      ASSERT_NEAR(double(cell[2]), -0.03 * kPlaneStep, 0.002 * kPlaneStep);
      ASSERT_GT(double(cell[3]), 0.1);
      ASSERT_LE(double(cell[3]), 0.125);
    }
  }
}

TEST(FindPlanarRegions, CompletesTheSurfaceAround) {
  std::mt19937 random = SeededByTestName();
  const cv::Mat cells = PlanesIn(BareInTheMiddle(Tilted, random));
  ASSERT_EQ(cells.size(), kImage / kImageCell_px);
  ExpectTilted(cells);
  EXPECT_EQ(NumWithPlane(cells), kBareCells.area());
}

TEST(FindPlanarRegions, LooksPastWhatStandsBeforeTheSurface) {
  std::mt19937 random = SeededByTestName();
  // A third of the border is that of something ten planes nearer.
  const cv::Mat cells = PlanesIn(BareInTheMiddle(
      [](int x, int y) { return Tilted(x, y) + (x > 215 ? 10 * kPlaneStep : 0); }, random));
  ExpectTilted(cells);
}

TEST(FindPlanarRegions, FindsNoneWhereTheSurfaceAroundIsNone) {
  std::mt19937 random = SeededByTestName();
  const auto bowl = [](int x, int y) {
    return kPlaneStep * (40 + 0.001 * (x - 160) * (x - 160) - 0.001 * (y - 120) * (y - 120));
  };
  EXPECT_EQ(NumWithPlane(PlanesIn(BareInTheMiddle(bowl, random))), 0);
}

// A border on one side does not say how the surface goes on.
TEST(FindPlanarRegions, IsLessSureFarFromWhatWasMatched) {
  std::mt19937 random = SeededByTestName();
  View view = BareInTheMiddle(Tilted, random);
  const cv::Rect right(kBare.x, 0, kImage.width - kBare.x, kImage.height);
  view.bgr(right).setTo(cv::Scalar::all(150));
  view.depth(right).setTo(0);
  const cv::Mat cells = PlanesIn(view);
  const float near = cells.at<cv::Vec4f>(30, 21)[3];
  const float far = cells.at<cv::Vec4f>(30, 78)[3];
  EXPECT_GT(near, 0.08);
  EXPECT_LT(far, near / 4);
}

TEST(FindPlanarRegions, LeavesASmoothSurfaceThatIsSeenAsItIs) {
  std::mt19937 random = SeededByTestName();
  View view = BareInTheMiddle(Tilted, random);
  std::normal_distribution<double> noise(0, kPlaneStep / 3);
  // Bulges by four planes of the sweep.
  for (int y = kBare.y; y < kBare.br().y; ++y) {
    for (int x = kBare.x; x < kBare.br().x; ++x) {
      const double from_middle = std::hypot(x - 160, y - 120) / 60;
      view.unfiltered.at<float>(y, x) = static_cast<float>(
          Tilted(x, y) + kPlaneStep * 4 * std::max(0.0, 1 - from_middle * from_middle) +
          noise(random));
    }
  }
  EXPECT_EQ(NumWithPlane(PlanesIn(view)), 0);
  // Chance.
  for (int y = kBare.y; y < kBare.br().y; ++y) {
    for (int x = kBare.x; x < kBare.br().x; ++x) {
      view.unfiltered.at<float>(y, x) = static_cast<float>(
          Tilted(x, y) + kPlaneStep * static_cast<double>((x / 4 + y / 4 * 7) % 13 - 6));
    }
  }
  ExpectTilted(PlanesIn(view));
}

// One of 16 planes by chance, of which the middle one lies on a surface; a share of them on the
// surface itself, but for a plane each way.
void AddWinners(const Surface& surface, double share_on_it, int level, std::mt19937& random,
                View& view) {
  view.winner_level = level;
  view.winners.create(kImage.height >> level, kImage.width >> level, CV_32FC1);
  for (int y = 0; y < view.winners.rows; ++y) {
    for (int x = 0; x < view.winners.cols; ++x) {
      const bool is_on_it = static_cast<double>(random() % 1000) < 1000 * share_on_it;
      const int plane = is_on_it ? int(random() % 3) - 1 : int(random() % 16) - 8;
      view.winners.at<float>(y, x) =
          -static_cast<float>(surface(x << level, y << level) + plane * kPlaneStep);
    }
  }
}

int NumBelieved(const cv::Mat& cells) {
  cv::Mat confidence;
  cv::extractChannel(cells, confidence, 3);
  return cv::countNonZero(confidence > 1);
}

// A third of the border lies on the surface; all kinds of things stand before the rest.
double TiltedBehindThings(int x, int y) {
  return Tilted(x, y) + (x > 130 ? (8 + 4 * ((x / 16 + y / 16) % 5)) * kPlaneStep : 0);
}

TEST(FindPlanarRegions, BelievesAPlaneOnWhichMostWinnersLie) {
  std::mt19937 random = SeededByTestName();
  for (const int level : {0, 1}) {
    View view = BareInTheMiddle(Tilted, random);
    AddWinners(Tilted, 0.3, level, random, view);
    const cv::Mat cells = PlanesIn(view);
    EXPECT_EQ(NumBelieved(cells), kBareCells.area()) << level;
    const float confidence = cells.at<cv::Vec4f>(30, 40)[3];
    EXPECT_GT(confidence, 1.1);
    EXPECT_LE(confidence, 1.125);
  }
}

TEST(FindPlanarRegions, DoesNotBelieveAPlaneThatWinnersContradict) {
  std::mt19937 random = SeededByTestName();
  View view = BareInTheMiddle(Tilted, random);
  AddWinners(Tilted, 0, 0, random, view);
  EXPECT_EQ(NumBelieved(PlanesIn(view)), 0) << "by chance";
  AddWinners([](int x, int y) { return Tilted(x, y) + 4 * kPlaneStep; }, 0.6, 0, random, view);
  const cv::Mat cells = PlanesIn(view);
  EXPECT_EQ(NumBelieved(cells), 0) << "beside it";
  EXPECT_EQ(NumWithPlane(cells), kBareCells.area());
  view.winners.setTo(0, view.depth > 0);
  view.winners(cv::Rect(kBare.x, kBare.y, kBare.width, kBare.height / 2)).setTo(0);
  EXPECT_EQ(NumBelieved(PlanesIn(view)), 0) << "where no source sees it";
}

TEST(FindPlanarRegions, FindsAWallBehindWhatStandsAroundIt) {
  std::mt19937 random = SeededByTestName();
  View view = BareInTheMiddle(TiltedBehindThings, random);
  EXPECT_EQ(NumWithPlane(PlanesIn(view)), 0);
  AddWinners(Tilted, 0.3, 0, random, view);
  const cv::Mat cells = PlanesIn(view);
  EXPECT_EQ(NumBelieved(cells), kBareCells.area());
  EXPECT_NEAR(double(cells.at<cv::Vec4f>(30, 40)[0]), Tilted(161, 121), kPlaneStep);
}

TEST(FindPlanarRegions, MarksTheSkyAndLeavesItOut) {
  std::mt19937 random = SeededByTestName();
  View view = BareInTheMiddle(Tilted, random);
  view.sky(kBareCells).setTo(255);
  const cv::Mat cells = PlanesIn(view);
  EXPECT_EQ(NumWithPlane(cells), 0);
  EXPECT_LT(cells.at<cv::Vec4f>(30, 40)[3], 0);
  EXPECT_EQ(cells.at<cv::Vec4f>(1, 1)[3], 0);
}

}  // namespace
}  // namespace mono3d
