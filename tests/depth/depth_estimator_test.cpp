// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/depth/depth_estimator.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "depth/plane_scene.h"
#include "depth/single_views.h"
#include "depth/stage_testing.h"
#include "depth/sweep_geometry.h"
#include "gpu/test_device.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using ::testing::HasSubstr;

DepthResult Estimate(const ImageBundle& bundle, const DepthEstimatorOptions& options = {}) {
  return CreateDepthEstimator(TestDevice(), options)->Estimate(bundle);
}

// Share of the reference's pixels that have an estimate within `tolerance` of the truth.
double ShareWithin(const cv::Mat& depth, const cv::Mat& truth, float tolerance) {
  int num_good = 0;
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const float expected = truth.at<float>(y, x);
      num_good += std::abs(depth.at<float>(y, x) - expected) <= tolerance * expected ? 1 : 0;
    }
  }
  return double(num_good) / double(depth.total());
}

// A pixel of disparity in the farthest camera is 3 % of the depth here.
constexpr float kDepthTolerance = 0.01f;
constexpr double kShareWithinTolerance = 0.95;
constexpr float kFineTolerance = 0.002f;  // a fifteenth of a pixel, as only the refinement finds it

// The scene is small, a pixel of half the resolution would be 6 % of the depth.
DepthEstimatorOptions FullResolution() {
  DepthEstimatorOptions options;
  options.pyramid.level = 0;
  return options;
}

TEST(DepthEstimator, FindsATiltedPlane) {
  const PlaneScene scene;
  const DepthResult result = Estimate(scene.Bundle(), FullResolution());
  ASSERT_EQ(result.status, DepthStatus::kEstimated) << result.reason;
  EXPECT_GE(ShareWithin(result.map.depth, scene.TrueDepth(), kDepthTolerance),
            kShareWithinTolerance);
}

TEST(DepthEstimator, FindsItAsExactlyWhereTheExposureJumps) {
  const PlaneScene scene;
  ImageBundle bundle = scene.Bundle();
  const DepthResult constant = Estimate(bundle, FullResolution());
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
    if (i == bundle.reference_index()) continue;
    cv::Mat& bgr = bundle.keyframes[i].frame.bgr;
    const double gain = i < bundle.reference_index() ? 0.5 : 0.7;
    bgr = cv::Mat(bgr * gain + cv::Scalar::all(20));
  }
  const DepthResult jumping = Estimate(bundle, FullResolution());
  ASSERT_EQ(constant.status, DepthStatus::kEstimated) << constant.reason;
  ASSERT_EQ(jumping.status, DepthStatus::kEstimated) << jumping.reason;
  const cv::Mat truth = scene.TrueDepth();
  EXPECT_NEAR(ShareWithin(jumping.map.depth, truth, kFineTolerance),
              ShareWithin(constant.map.depth, truth, kFineTolerance), 0.02);
  EXPECT_NEAR(cv::mean(jumping.map.confidence)[0], cv::mean(constant.map.confidence)[0], 0.02);
}

// Flights there and back, and cameras held upright and across.
TEST(DepthEstimator, FindsItInPicturesTurnedByQuarters) {
  PlaneScene scene;
  scene.camera = scene.camera.Resized(128, 128);
  const cv::Mat truth = scene.TrueDepth();
  const DepthResult upright = Estimate(scene.Bundle(), FullResolution());
  ASSERT_EQ(upright.status, DepthStatus::kEstimated) << upright.reason;
  for (const unsigned turns : {1U, 2U, 3U}) {
    ImageBundle bundle = scene.Bundle();
    for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
      if (i != bundle.reference_index()) TurnImage(i, turns, bundle);
    }
    const DepthResult turned = Estimate(bundle, FullResolution());
    ASSERT_EQ(turned.status, DepthStatus::kEstimated) << turns << ": " << turned.reason;
    EXPECT_NEAR(ShareWithin(turned.map.depth, truth, kFineTolerance),
                ShareWithin(upright.map.depth, truth, kFineTolerance), 0.02)
        << turns;
    EXPECT_NEAR(cv::mean(turned.map.confidence)[0], cv::mean(upright.map.confidence)[0], 0.01);
  }
}

bool AreTheSame(const DepthMap& a, const DepthMap& b) {
  const auto same = [](const cv::Mat& one, const cv::Mat& other) {
    return one.total() == other.total() &&
           std::memcmp(one.data, other.data, one.total() * one.elemSize()) == 0;
  };
  return same(a.depth, b.depth) && same(a.normal, b.normal) && same(a.confidence, b.confidence);
}

// Whatever it was before.
TEST(DepthEstimator, WorksAsTheOptionsOfItsEffortSay) {
  PlaneScene scene;
  scene.camera = scene.camera.Resized(2 * scene.camera.width, 2 * scene.camera.height);
  const ImageBundle bundle = scene.Bundle();
  const auto estimator = CreateDepthEstimator(TestDevice());
  for (const DepthEffort effort : {DepthEffort::kHalfSize, DepthEffort::kRefinedOnce,
                                   DepthEffort::kMatchedOnly, DepthEffort::kFull}) {
    estimator->SetEffort(effort);
    const bool is_half_size = effort == DepthEffort::kHalfSize;
    const DepthResult result = estimator->Estimate(bundle);
    const DepthResult expected =
        Estimate(is_half_size ? HalfSize(bundle) : bundle, WithEffort({}, effort));
    ASSERT_EQ(result.status, DepthStatus::kEstimated) << ToString(effort);
    EXPECT_EQ(result.map.depth.cols, scene.camera.width / (is_half_size ? 2 : 1));
    EXPECT_TRUE(AreTheSame(result.map, expected.map)) << ToString(effort);
  }
}

TEST(DepthEstimator, FindsItWithoutAnyDepthKnownBefore) {
  PlaneScene scene;
  scene.with_sparse_depths = false;
  const DepthResult result = Estimate(scene.Bundle(), FullResolution());
  ASSERT_EQ(result.status, DepthStatus::kEstimated) << result.reason;
  EXPECT_GE(ShareWithin(result.map.depth, scene.TrueDepth(), kDepthTolerance),
            kShareWithinTolerance);
  // The range was found, not swept from the camera to infinity.
  EXPECT_GT(result.min_depth_su, 0.5);
  EXPECT_LT(result.max_depth_su, 10);
}

// Crowns of trees above a road: the points that the tracker has lie on what is farther.
TEST(DepthEstimator, FindsWhatIsNearerThanAllPoints) {
  PlaneScene scene;
  scene.plane = {-0.6, 0, 1};
  const cv::Mat truth = scene.TrueDepth();
  ImageBundle bundle = scene.Bundle();
  std::vector<float>& points = bundle.keyframes[bundle.reference_index()].sparse_depths_su;
  std::erase_if(points, [](float depth) { return depth < 2.4F; });
  ASSERT_GE(points.size(), 30U);
  const DepthResult result = Estimate(bundle, FullResolution());
  ASSERT_EQ(result.status, DepthStatus::kEstimated) << result.reason;
  int num_near = 0;
  int num_good = 0;
  for (int y = 0; y < truth.rows; ++y) {
    for (int x = 10; x < truth.cols; ++x) {  // the leftmost columns leave the view of one side
      const float expected = truth.at<float>(y, x);
      if (expected > 1.9F) continue;
      ++num_near;
      const float found = result.map.depth.at<float>(y, x);
      num_good += std::abs(found - expected) <= kDepthTolerance * expected ? 1 : 0;
    }
  }
  EXPECT_GE(num_near, 0.3 * double(truth.total()));
  EXPECT_GE(num_good, 0.9 * num_near);
}

TEST(DepthEstimator, FindsItInThreeToNineImages) {
  const auto estimator = CreateDepthEstimator(TestDevice());
  for (const int num_images : {9, 3, 7, 5}) {  // with buffers of larger bundles before smaller
    PlaneScene scene;
    scene.num_images = num_images;
    scene.baseline = 0.8 / (num_images - 1);  // the outermost where they are by default
    const DepthResult result = estimator->Estimate(scene.Bundle());
    ASSERT_EQ(result.status, DepthStatus::kEstimated) << num_images << ": " << result.reason;
    // Of three images both others must see a point, and each of them misses a fifth of the columns:
    // the plane moves by fx * 0.4 / 2 = 30 of 160 px.
    const double share = num_images == 3 ? 0.6 : kShareWithinTolerance;
    EXPECT_GE(ShareWithin(result.map.depth, scene.TrueDepth(), kDepthTolerance), share)
        << num_images;
    if (num_images == 5) {
      const cv::Mat alone = Estimate(scene.Bundle()).map.depth;
      EXPECT_EQ(std::memcmp(result.map.depth.data, alone.data, 4 * alone.total()), 0);
    }
  }
}

// Of a bundle of nine, those images alone, `before` of them before the reference in the list.
ImageBundle BundleOf(const ImageBundle& nine, const std::vector<std::size_t>& images,
                     std::size_t before) {
  ImageBundle bundle;
  for (const std::size_t i : images) {
    bundle.keyframes.push_back(nine.keyframes[i]);
    bundle.T_ref_cam.push_back(nine.T_ref_cam[i]);
  }
  bundle.num_first_side = before;
  return bundle;
}

// What is around the content repeats its border, as it comes from a FrameSource of several cameras.
void ShowOnly(const cv::Rect& content, Frame& frame) {
  const cv::Mat shown = frame.bgr(content).clone();
  cv::copyMakeBorder(shown, frame.bgr, content.y, frame.bgr.rows - content.br().y, content.x,
                     frame.bgr.cols - content.br().x, cv::BORDER_REPLICATE);
  frame.content = content;
}

TEST(DepthEstimator, FindsItWithinWhatTheImagesShowAndNothingAround) {
  const PlaneScene scene;
  ImageBundle bundle = scene.Bundle();
  const cv::Rect content(30, 0, 100, 80);
  for (Keyframe& keyframe : bundle.keyframes) ShowOnly(content, keyframe.frame);
  const DepthResult result = Estimate(bundle, FullResolution());
  ASSERT_EQ(result.status, DepthStatus::kEstimated) << result.reason;
  cv::Mat around(result.map.depth.size(), CV_8UC1, cv::Scalar(255));
  around(content).setTo(0);
  EXPECT_EQ(cv::countNonZero((result.map.depth != 0) & around), 0);
  EXPECT_EQ(cv::countNonZero((result.map.confidence != 0) & around), 0);
  // Without the width of a census window along the content's borders.
  const cv::Rect inner(34, 0, 92, 76);
  EXPECT_GE(ShareWithin(result.map.depth(inner), scene.TrueDepth()(inner), kDepthTolerance),
            kShareWithinTolerance);
}

// At half the size as well: a pixel of which a part is hidden has none.
TEST(DepthEstimator, HasNoDepthWhereTheSceneIsHidden) {
  PlaneScene scene;
  scene.camera = {.width = 320, .height = 192, .fx = 300, .fy = 300, .cx = 159.5, .cy = 95.5};
  const ImageBundle bundle = scene.Bundle();
  const DepthResult whole = Estimate(bundle, FullResolution());
  DepthEstimatorOptions options = FullResolution();
  options.hidden = cv::Mat(whole.map.depth.size(), CV_8UC1, cv::Scalar(0));
  const cv::Rect hidden(21, 30, 51, 33);
  options.hidden(hidden).setTo(1);
  const DepthResult result = Estimate(bundle, options);
  ASSERT_EQ(result.status, DepthStatus::kEstimated) << result.reason;
  EXPECT_EQ(cv::countNonZero(result.map.depth(hidden)), 0);
  EXPECT_EQ(cv::countNonZero(result.map.confidence(hidden)), 0);
  EXPECT_EQ(cv::norm(result.map.depth, whole.map.depth, cv::NORM_INF, options.hidden == 0), 0);
  const DepthResult half = Estimate(HalfSize(bundle), options);
  ASSERT_EQ(half.status, DepthStatus::kEstimated) << half.reason;
  EXPECT_EQ(cv::countNonZero(half.map.depth({10, 15, 26, 17})), 0);
  EXPECT_GT(half.map.depth.at<float>(24, 9), 0);
}

TEST(DepthEstimator, FindsItBesideASourceThatShowsAPart) {
  const PlaneScene scene;
  ImageBundle bundle = scene.Bundle();
  ShowOnly({0, 0, 60, 96}, bundle.keyframes[1].frame);
  const DepthResult result = Estimate(bundle, FullResolution());
  ASSERT_EQ(result.status, DepthStatus::kEstimated) << result.reason;
  EXPECT_GE(ShareWithin(result.map.depth, scene.TrueDepth(), kDepthTolerance),
            kShareWithinTolerance);
}

TEST(DepthEstimator, FindsItWithUnequalSides) {
  PlaneScene scene;
  scene.num_images = 9;
  scene.baseline = 0.1;
  const ImageBundle nine = scene.Bundle();
  const auto estimator = CreateDepthEstimator(TestDevice());
  const std::vector<ImageBundle> bundles = {
      BundleOf(nine, {2, 4, 5, 6, 7}, 1),     // one before, three after it
      BundleOf(nine, {0, 1, 2, 3, 4, 5}, 4),  // four before, one after it
      BundleOf(nine, {3, 4, 5, 6}, 1)};
  for (const ImageBundle& bundle : bundles) {
    ASSERT_EQ(bundle.reference().id, nine.reference().id);
    const DepthResult result = estimator->Estimate(bundle);
    ASSERT_EQ(result.status, DepthStatus::kEstimated) << result.reason;
    EXPECT_GE(ShareWithin(result.map.depth, scene.TrueDepth(), kDepthTolerance), 0.8)
        << bundle.keyframes.size();
  }
}

// The farther ones are one side, the nearer ones the other. What leaves the view of all but one is
// lost: fx * 0.4 / 2 = 30 of 160 px.
TEST(DepthEstimator, FindsItFromOneSide) {
  PlaneScene scene;
  scene.num_images = 9;
  scene.baseline = 0.1;
  const ImageBundle bundle = BundleOf(scene.Bundle(), {8, 7, 4, 5, 6}, 2);
  const DepthResult result = Estimate(bundle);
  ASSERT_EQ(result.status, DepthStatus::kEstimated) << result.reason;
  EXPECT_GE(ShareWithin(result.map.depth, scene.TrueDepth(), kDepthTolerance), 0.75);
}

TEST(DepthEstimator, IsHalfAsSureOfWhatOneSourceAloneSees) {
  const PlaneScene scene{.num_images = 3};
  const ImageBundle bundle = scene.Bundle();
  const DepthMap map = Estimate(bundle, FullResolution()).map;
  const cv::Mat views = FindSingleViews(SweepGeometry(bundle), map.depth);
  const cv::Mat is_single = views == kSingle;
  ASSERT_GT(cv::countNonZero(is_single), 500) << "some columns on either side";
  double most = 0;
  cv::minMaxLoc(map.confidence, nullptr, &most, nullptr, nullptr, is_single);
  EXPECT_GT(most, 0.2);
  EXPECT_LE(most, 0.5);
  const cv::Mat is_confirmed = (views == kNotSingle) & (map.depth > 0);
  EXPECT_GT(cv::mean(map.confidence, is_confirmed)[0],
            1.5 * cv::mean(map.confidence, is_single)[0]);
}

TEST(DepthEstimator, FindsItOnEachLevel) {
  const PlaneScene scene;
  for (const int level : {0, 1}) {
    DepthEstimatorOptions options;
    options.pyramid.level = level;
    const DepthResult result = Estimate(scene.Bundle(), options);
    ASSERT_EQ(result.status, DepthStatus::kEstimated) << result.reason;
    EXPECT_EQ(result.level, level);
    // Half the resolution, twice the error.
    EXPECT_GE(ShareWithin(result.map.depth, scene.TrueDepth(), kDepthTolerance * float(1 + level)),
              kShareWithinTolerance);
  }
}

TEST(DepthEstimator, InfersASurfaceWithoutTexture) {
  PlaneScene scene;
  scene.blank_px = 46;
  DepthEstimatorOptions off;
  off.inference.enabled = false;
  const DepthMap matched = Estimate(scene.Bundle(), off).map;
  const DepthMap map = Estimate(scene.Bundle()).map;
  Validate(map);
  ASSERT_FALSE(map.inferred.empty());
  // A quarter of the blank square has no window with texture in it.
  const int num_pixels = int(map.depth.total());
  EXPECT_LE(CountEstimates(matched), num_pixels - 46 * 46 / 4);
  EXPECT_GE(CountEstimates(map), int(0.98 * num_pixels));
  EXPECT_EQ(cv::countNonZero(WithoutInferred(map).depth != matched.depth), 0);
  const cv::Mat truth = scene.TrueDepth();
  int num_inferred = 0;
  int num_near = 0;
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      if (map.inferred.at<std::uint8_t>(y, x) == 0) continue;
      ++num_inferred;
      EXPECT_EQ(matched.depth.at<float>(y, x), 0);
      EXPECT_LE(map.confidence.at<float>(y, x), 0.125F);
      const float error = std::abs(map.depth.at<float>(y, x) / truth.at<float>(y, x) - 1);
      num_near += error <= 2 * kDepthTolerance ? 1 : 0;
    }
  }
  EXPECT_GE(num_near, int(0.9 * num_inferred));
}

// Leaves that no two images show alike, on branches that all of them show: the left half of each
// image has noise of its own, in every pixel.
TEST(DepthEstimator, MatchesWhatIsRoughOnACoarserLevel) {
  PlaneScene scene;
  scene.camera = scene.camera.Resized(640, 384);
  ImageBundle bundle = scene.Bundle();
  std::mt19937 random = SeededByTestName();
  std::normal_distribution<double> noise(0, 30);
  for (Keyframe& keyframe : bundle.keyframes) {
    cv::Mat image = keyframe.frame.bgr.clone();
    for (int y = 0; y < image.rows; ++y) {
      for (int x = 0; x < image.cols / 2; ++x) {
        const double grey = image.at<cv::Vec3b>(y, x)[0] + noise(random);
        image.at<cv::Vec3b>(y, x) = cv::Vec3b::all(cv::saturate_cast<std::uint8_t>(grey));
      }
    }
    keyframe.frame.bgr = image;
  }
  const DepthMap map = Estimate(bundle, FullResolution()).map;
  Validate(map);
  const cv::Mat truth = scene.TrueDepth();
  ASSERT_FALSE(map.inferred.empty());
  const cv::Mat coarsely = map.inferred == kCoarselyMatched;
  const int num_coarse = cv::countNonZero(coarsely.colRange(0, 320));
  EXPECT_GE(num_coarse, 320 * 384 / 4);
  EXPECT_EQ(cv::countNonZero(coarsely.colRange(360, 640)), 0);
  const cv::Mat error = cv::abs(map.depth / truth - 1);
  const cv::Mat is_near = (error < 0.02) & coarsely;
  EXPECT_GE(cv::countNonZero(is_near), 0.9 * cv::countNonZero(coarsely));
}

TEST(DepthEstimator, DoesNotDependOnScale) {
  PlaneScene scene;
  const DepthResult one = Estimate(scene.Bundle());
  scene.scale = 1024;  // a power of two, so that not even rounding differs
  const DepthResult other = Estimate(scene.Bundle());
  ASSERT_EQ(other.status, DepthStatus::kEstimated) << other.reason;
  EXPECT_EQ(other.num_planes, one.num_planes);
  const cv::Mat difference = cv::abs(other.map.depth / scene.scale - one.map.depth);
  // Poses are normalised in double, whose last bits differ.
  EXPECT_LE(cv::countNonZero(difference > 1e-4), int(0.002 * double(one.map.depth.total())));
}

TEST(DepthEstimator, FillsTheMap) {
  const PlaneScene scene;
  ImageBundle bundle = scene.Bundle();
  bundle.keyframes[1].patch_noise = 2;
  const DepthMap map = Estimate(bundle).map;
  Validate(map);
  ASSERT_EQ(map.views.size(), bundle.keyframes.size() - 1);
  EXPECT_EQ(map.views[0].keyframe_id, bundle.keyframes[0].id);
  EXPECT_EQ(map.views[2].keyframe_id, bundle.keyframes[3].id);
  EXPECT_EQ(map.views[2].T_ref_cam.translation(), bundle.T_ref_cam[3].translation());
  EXPECT_NEAR(map.patch_noise, 1 + 1.0 / double(bundle.keyframes.size()), 1e-12);
  EXPECT_EQ(map.keyframe_id, 12);
  EXPECT_EQ(map.frame_index, 22);
  EXPECT_EQ(map.timestamp_s, 1.0);
  EXPECT_EQ(map.camera, scene.camera);
  EXPECT_EQ(map.bgr.data, bundle.reference().frame.bgr.data);
  EXPECT_NEAR(map.depth_sigma_per_square_depth, 1 / (150 * 0.4 * std::hypot(1, 0.02)), 1e-9);
}

// A saved model refuses less than 1, which a seventh, seven times, is less than.
TEST(DepthEstimator, HasNoNoiseOfClearImages) {
  PlaneScene scene;
  scene.num_images = 7;
  EXPECT_EQ(Estimate(scene.Bundle()).map.patch_noise, 1);
}

TEST(DepthEstimator, GivesNormalsAndConfidenceWhereItGivesDepth) {
  const PlaneScene scene;
  const DepthMap map = Estimate(scene.Bundle()).map;
  const Eigen::Vector3f n = Eigen::Vector3f(0.3f, 0.2f, -1).normalized();
  int num_near = 0;
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      const float depth = map.depth.at<float>(y, x);
      const auto& normal = map.normal.at<cv::Vec3f>(y, x);
      const float confidence = map.confidence.at<float>(y, x);
      ASSERT_TRUE(std::isfinite(depth) && depth >= 0);
      ASSERT_EQ(depth > 0, confidence > 0);
      ASSERT_LE(confidence, 1);
      const double length = cv::norm(normal);
      ASSERT_TRUE(length == 0 || (depth > 0 && std::abs(length - 1) < 1e-5 && normal[2] < 0));
      num_near += n.dot(Eigen::Vector3f(normal[0], normal[1], normal[2])) > 0.9 ? 1 : 0;
    }
  }
  // Within 26 degrees: a third of a pixel of noise over a window of seven pixels.
  EXPECT_GE(num_near, int(0.9 * double(map.depth.total())));
}

TEST(DepthEstimator, GivesTheSameBytesAgain) {
  const PlaneScene scene;
  const auto estimator = CreateDepthEstimator(TestDevice());
  const DepthMap first = estimator->Estimate(scene.Bundle()).map;
  PlaneScene other;  // something else in between, larger and without sparse points
  other.camera = other.camera.Resized(200, 120);
  other.with_sparse_depths = false;
  (void)estimator->Estimate(other.Bundle());
  const DepthMap second = estimator->Estimate(scene.Bundle()).map;
  EXPECT_EQ(std::memcmp(first.depth.data, second.depth.data, 4 * first.depth.total()), 0);
  EXPECT_EQ(std::memcmp(first.normal.data, second.normal.data, 12 * first.depth.total()), 0);
  EXPECT_EQ(std::memcmp(first.confidence.data, second.confidence.data, 4 * first.depth.total()), 0);
}

TEST(DepthEstimator, AddsItsStagesToTheTimes) {
  StageTimes times;
  const auto estimator = CreateDepthEstimator(TestDevice(), {}, &times);
  (void)estimator->Estimate(PlaneScene().Bundle());
  std::vector<std::string> stages;
  for (const StageTime& time : times.Snapshot()) stages.push_back(time.stage);
  EXPECT_THAT(stages,
              ::testing::IsSupersetOf({"depth/census", "depth/plane_sweep", "depth/sgm",
                                       "depth/winner_takes_all", "depth/median", "depth/normals",
                                       "depth/dog", "depth/texture_filter", "depth/estimate"}));
}

TEST(DepthEstimatorOptions, AreNamedWhenWrong) {
  const auto message = [](const DepthEstimatorOptions& options) {
    try {
      options.Validate();
    } catch (const UsageError& error) {
      return std::string(error.what());
    }
    return std::string();
  };
  EXPECT_EQ(message({}), "");
  DepthEstimatorOptions options;
  options.sgm.p2 = 200;
  EXPECT_THAT(message(options), HasSubstr("sgm.p2"));
  options = {};
  options.plane_sweep.min_depth_su = 3;
  options.plane_sweep.max_depth_su = 2;
  EXPECT_THAT(message(options), HasSubstr("plane_sweep.max_depth_su"));
  options = {};
  options.dog.min_response = std::nan("");
  EXPECT_THAT(message(options), HasSubstr("dog.min_response"));
  options = {};
  options.sgm.finest_paths = 5;
  EXPECT_THAT(message(options), HasSubstr("sgm.finest_paths"));
}

}  // namespace
}  // namespace mono3d
