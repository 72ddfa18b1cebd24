// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/orthophoto.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <numbers>
#include <opencv2/imgcodecs.hpp>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/geometry/distortion.h"
#include "products/ortho_view.h"
#include "products/view_balance.h"

namespace mono3d {
namespace {

using Eigen::Vector3d;

// Level ground of 10 x 8 m with a box on it, 4 m high, whose walls are of a colour that no map
// shows.
constexpr double kBoxHeight = 4;
bool IsOnBox(double x, double y) { return x > 3 && x < 5 && y > 2 && y < 4; }

// Red, green, blue.
cv::Vec3d ColourFromAbove(double x, double y) {
  if (IsOnBox(x, y)) return {90 + 20 * std::sin(x + y), 60, 120 + 20 * std::cos(x)};
  return {120 + 60 * std::sin(1.3 * x), 130 + 50 * std::cos(1.1 * y), 110 + 30 * std::sin(x + y)};
}

const cv::Vec3d kWall(255, 0, 255);

// What the ray from above shows.
cv::Vec3d ColourOfRay(const Vector3d& eye, const Vector3d& direction) {
  const auto at_height = [&](double z) -> Vector3d {
    return eye + (z - eye.z()) / direction.z() * direction;
  };
  const Vector3d top = at_height(kBoxHeight), ground = at_height(0);
  if (IsOnBox(top.x(), top.y())) return ColourFromAbove(top.x(), top.y());
  constexpr int kSteps = 200;
  for (int i = 0; i < kSteps; ++i) {
    const Vector3d between = top + (i + 0.5) / kSteps * (ground - top);
    if (IsOnBox(between.x(), between.y())) return kWall;
  }
  return ColourFromAbove(ground.x(), ground.y());
}

enum class Sight { kClear, kHidden, kAtAnEdge };

// Of a place on the ground or on the box, and what lies up to two cells around.
Sight SightFrom(const Vector3d& eye, double x, double y) {
  const bool is_on_box = IsOnBox(x, y);
  int num_clear = 0;
  for (const double dx : {-0.1, 0.0, 0.1}) {
    for (const double dy : {-0.1, 0.0, 0.1}) {
      if (IsOnBox(x + dx, y + dy) != is_on_box) return Sight::kAtAnEdge;
      if (is_on_box) continue;
      bool is_clear = true;
      constexpr int kSteps = 50;  // up to the height of the box
      const Vector3d place(x + dx, y + dy, 0);
      const Vector3d step = (kBoxHeight / eye.z()) * (eye - place) / kSteps;
      for (int i = 1; i < kSteps && is_clear; ++i) {
        const Vector3d between = place + i * step;
        is_clear = !IsOnBox(between.x(), between.y());
      }
      if (is_clear) ++num_clear;
    }
  }
  if (is_on_box || num_clear == 9) return Sight::kClear;
  return num_clear == 0 ? Sight::kHidden : Sight::kAtAnEdge;
}

const CameraModel kNadirCamera = {
    .width = 400, .height = 320, .fx = 500, .fy = 500, .cx = 199.5, .cy = 159.5};

Pose LookingDown(const Vector3d& eye) {
  return {Eigen::Quaterniond(Eigen::AngleAxisd(std::numbers::pi, Vector3d::UnitX())), eye};
}

const RasterGrid kSceneGrid = {.west = 0, .north = 8, .cell = 0.05, .width = 200, .height = 160};

HeightSource HeightsOfScene() {
  return {.grid = kSceneGrid, .read = [](const cv::Rect& place) {
            cv::Mat heights(place.height, place.width, CV_32FC1);
            for (int row = 0; row < place.height; ++row) {
              for (int column = 0; column < place.width; ++column) {
                const Eigen::Vector2d at = kSceneGrid.ToMap(place.x + column, place.y + row);
                heights.at<float>(row, column) =
                    IsOnBox(at.x(), at.y()) ? static_cast<float>(kBoxHeight) : 0;
              }
            }
            heights.at<float>(0, 0) = kNoHeight;
            return heights;
          }};
}

class OrthophotoTest : public TemporaryFolderTest {
 protected:
  void AddImage(FinishedRun& run, const Pose& T_world_cam, double exposure) const {
    cv::Mat image(kNadirCamera.height, kNadirCamera.width, CV_8UC3);
    for (int row = 0; row < image.rows; ++row) {
      for (int column = 0; column < image.cols; ++column) {
        const Vector3d ray = kNadirCamera.Unproject({column, row});
        const cv::Vec3d rgb =
            exposure * ColourOfRay(T_world_cam.translation(), T_world_cam.rotation() * ray);
        image.at<cv::Vec3b>(row, column) = cv::Vec3b(cv::saturate_cast<std::uint8_t>(rgb[2]),
                                                     cv::saturate_cast<std::uint8_t>(rgb[1]),
                                                     cv::saturate_cast<std::uint8_t>(rgb[0]));
      }
    }
    const std::string name = std::to_string(run.images.size()) + ".png";
    cv::imwrite((folder_ / name).string(), image);
    RunImage& of_run = run.images.emplace_back();
    of_run.name = name;
    of_run.file = folder_ / name;
    of_run.camera = kNadirCamera;
    of_run.T_world_cam = T_world_cam;
  }

  static cv::Mat Make(const FinishedRun& run) {
    cv::Mat all(kSceneGrid.height, kSceneGrid.width, CV_8UC4);
    const MapAxes axes;
    MakeOrthophoto(run, axes, HeightsOfScene(), kSceneGrid,
                   [&](const cv::Rect& place, const cv::Mat& cells) { cells.copyTo(all(place)); });
    return all;
  }
};

TEST_F(OrthophotoTest, ShowsTheSceneFromAboveWithEqualExposure) {
  FinishedRun run;
  const std::array<Vector3d, 2> eyes = {Vector3d(2.5, 4, 20), Vector3d(9, 4, 20)};
  AddImage(run, LookingDown(eyes[0]), 1);
  AddImage(run, LookingDown(eyes[1]), 0.8);
  const cv::Mat map = Make(run);
  // Both are equally far from what comes out.
  const double gain = std::sqrt(0.8);
  int num_hidden_from_nearer = 0, num_hidden_from_both = 0;
  for (int row = 1; row < kSceneGrid.height - 1; ++row) {
    for (int column = 1; column < kSceneGrid.width - 1; ++column) {
      const Eigen::Vector2d at = kSceneGrid.ToMap(column, row);
      const Sight left = SightFrom(eyes[0], at.x(), at.y());
      const Sight right = SightFrom(eyes[1], at.x(), at.y());
      if (left == Sight::kAtAnEdge || right == Sight::kAtAnEdge) continue;
      const auto cell = map.at<cv::Vec4b>(row, column);
      if (left == Sight::kHidden && right == Sight::kHidden) {
        ++num_hidden_from_both;
        ASSERT_EQ(cell[3], 0) << at.transpose();
        continue;
      }
      if (left == Sight::kHidden && at.x() < 5.75) ++num_hidden_from_nearer;
      ASSERT_EQ(cell[3], 255) << at.transpose();
      const cv::Vec3d expected = gain * ColourFromAbove(at.x(), at.y());
      for (int k = 0; k < 3; ++k) ASSERT_NEAR(cell[k], expected[k], 4) << at.transpose();
    }
  }
  EXPECT_GT(num_hidden_from_nearer, 100);
  EXPECT_GT(num_hidden_from_both, 100);
}

TEST_F(OrthophotoTest, IsTransparentWhereNothingIsKnown) {
  FinishedRun run;
  AddImage(run, LookingDown({2.5, 4, 10}), 1);  // sees up to x = 6.5
  const cv::Mat map = Make(run);
  EXPECT_EQ(map.at<cv::Vec4b>(80, 20)[3], 255);
  EXPECT_EQ(map.at<cv::Vec4b>(80, 150)[3], 0);  // x = 7.5
  EXPECT_EQ(map.at<cv::Vec4b>(0, 0)[3], 0);     // no height
  // Hidden by the box: its shadow from 2.5 reaches to 5 + 2.5 / 6 * 4.
  EXPECT_EQ(map.at<cv::Vec4b>(100, 110)[3], 0);
}

TEST_F(OrthophotoTest, NamesImagesThatAreMissing) {
  FinishedRun run;
  EXPECT_THROW(Make(run), Error);
  AddImage(run, LookingDown({5, 4, 20}), 1);
  run.images.push_back(run.images[0]);
  run.images[1].name = "gone";
  run.images[1].file = folder_ / "gone.png";
  run.images.push_back(run.images[0]);
  run.images[2].name = "resized";
  run.images[2].camera = kNadirCamera.Resized(800, 640);
  const MapAxes axes;
  const OrthophotoReport report = MakeOrthophoto(run, axes, HeightsOfScene(), kSceneGrid,
                                                 [](const cv::Rect&, const cv::Mat&) {});
  EXPECT_EQ(report.num_views, 1u);
  EXPECT_EQ(report.missing_images, (std::vector<std::string>{"gone", "resized"}));
}

TEST(OrthoView, ShowsPlacesThroughTheLens) {
  CameraModel camera = kNadirCamera;
  camera.distortion = {-0.25, 0, 0.001, -0.002, 0};
  const Pose pose = LookingDown({1, 2, 30});
  const OrthoView view(camera, pose);
  const Vector3d place(4, -3, 1.5);
  const auto sight = view.See(place);
  ASSERT_TRUE(sight);
  const Eigen::Vector2d pixel = ProjectDistorted(camera, pose.Inverse() * place);
  EXPECT_LT((sight->pixel.cast<double>() - pixel).norm(), 1e-3);
  // The formula of the lens folds back far outside, into the image.
  const Vector3d far(1 + 30 * 1.98, 2, 0);
  EXPECT_TRUE(camera.Contains(ProjectDistorted(camera, pose.Inverse() * far)));
  EXPECT_FALSE(view.See(far));
  EXPECT_FALSE(view.See({1, 2, 60}));  // behind
  // Nearer and more from above is better.
  EXPECT_GT(view.See({1, 2, 5})->quality, view.See({1, 2, 0})->quality);
  EXPECT_GT(view.See({1, 2, 0})->quality, view.See({6, 2, 0})->quality);
}

TEST(BalanceViews, FindsTheFactorsInSpiteOfOutliers) {
  const std::vector<double> exposures = {1, 0.8, 1.1, 0.9};
  std::vector<ColourSample> samples;
  for (std::size_t place = 0; place < 300; ++place) {
    for (std::size_t view = place % 3; view < place % 3 + 2; ++view) {
      const bool is_outlier = (place * 7 + view) % 10 == 0;
      const double level = exposures[view] * (60 + static_cast<double>(place % 50));
      const auto value = static_cast<float>(is_outlier ? 200 : level);
      samples.push_back({place, view, cv::Vec3f(value, value, 255)});
    }
  }
  const std::vector<cv::Vec3f> gains = BalanceViews(samples, 5);
  for (std::size_t view = 1; view < exposures.size(); ++view) {
    const double ratio = gains[view][0] / gains[0][0];
    EXPECT_NEAR(ratio, exposures[0] / exposures[view], 0.01);
  }
  EXPECT_FLOAT_EQ(gains[0][2], 1);  // clipped values tell nothing
  EXPECT_FLOAT_EQ(gains[4][0], 1);
}

}  // namespace
}  // namespace mono3d
