// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Bundles without depth in them, or in parts of them: an Error, a reason, or no estimate there.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <memory>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "depth/plane_scene.h"
#include "gpu/test_device.h"
#include "mono3d/core/error.h"
#include "mono3d/depth/depth_estimator.h"

namespace mono3d {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

DepthEstimatorOptions OptionsOfRange(double min_depth_su, double max_depth_su) {
  DepthEstimatorOptions options;
  options.plane_sweep.min_depth_su = min_depth_su;
  options.plane_sweep.max_depth_su = max_depth_su;
  return options;
}

class BadBundle : public testing::Test {
 protected:
  static void SetUpTestSuite() { estimator_ = CreateDepthEstimator(TestDevice()); }
  static void TearDownTestSuite() { estimator_.reset(); }

  static DepthResult Estimate(const ImageBundle& bundle) { return estimator_->Estimate(bundle); }
  static DepthResult Estimate(const ImageBundle& bundle, const DepthEstimatorOptions& options) {
    return CreateDepthEstimator(TestDevice(), options)->Estimate(bundle);
  }
  static void ExpectRejected(const ImageBundle& bundle, DepthRejection rejection,
                             const std::string& reason) {
    const DepthResult result = Estimate(bundle);
    EXPECT_EQ(result.status, DepthStatus::kRejected);
    EXPECT_EQ(result.rejection, rejection);
    EXPECT_THAT(result.reason, HasSubstr(reason));
    EXPECT_TRUE(result.map.depth.empty());
  }

 private:
  static std::unique_ptr<DepthEstimator> estimator_;  // made once for all tests
};

std::unique_ptr<DepthEstimator> BadBundle::estimator_;

// No NaN and no infinity; normal and confidence where there is depth.
void ExpectFinite(const DepthMap& map) {
  constexpr double kMax = std::numeric_limits<float>::max();
  EXPECT_TRUE(cv::checkRange(map.depth, true, nullptr, 0, kMax));
  EXPECT_TRUE(cv::checkRange(map.normal.reshape(1), true, nullptr, -1.001, 1.001));
  EXPECT_TRUE(cv::checkRange(map.confidence, true, nullptr, 0, 1.001));
  EXPECT_EQ(cv::countNonZero((map.depth > 0) != (map.confidence > 0)), 0);
}

// Share of `part` of the image with depth, and share of these that are within 1 % of the truth:
// a third of a pixel in the farthest camera of the default scene.
struct Found {
  double density = 0;
  double share_true = 0;
};

Found FoundIn(const DepthResult& result, const PlaneScene& scene, const cv::Rect& part,
              double tolerance = 0.01) {
  const cv::Mat depth = result.map.depth(part);
  const cv::Mat truth = scene.TrueDepth()(part);
  const int num_found = cv::countNonZero(depth > 0);
  const int num_true = cv::countNonZero(cv::abs(depth - truth) < tolerance * truth);
  return {double(num_found) / double(depth.total()), double(num_true) / std::max(1, num_found)};
}

cv::Rect WholeOf(const PlaneScene& scene) {
  return {0, 0, scene.camera.width, scene.camera.height};
}

TEST_F(BadBundle, OfFewerThanThreeImagesOrMoreThanNineIsRefused) {
  PlaneScene scene;
  for (const int num_images : {0, 1, 2, 10, 11}) {
    scene.num_images = num_images;
    EXPECT_THAT(
        [&] { (void)Estimate(scene.Bundle()); },
        ThrowsMessage<Error>(HasSubstr("number of images in a bundle (expected 3 to 9, 1 "
                                       "to 4 of them on each side of the reference, found " +
                                       std::to_string(num_images) + ", ")));
  }
}

TEST_F(BadBundle, OfImagesOnOneSideOnlyOrMoreThanFourOnASideIsRefused) {
  for (const std::size_t num_first_side : {0, 2, 4, 5, 6}) {
    PlaneScene scene;
    scene.num_images = 7;
    ImageBundle bundle = scene.Bundle();
    bundle.num_first_side = num_first_side;
    const auto estimate = [&] { (void)Estimate(bundle); };
    if (num_first_side == 2 || num_first_side == 4) {
      EXPECT_NO_THROW(estimate());
    } else {
      EXPECT_THAT(estimate, ThrowsMessage<Error>(HasSubstr("1 to 4 of them on each side")));
    }
  }
}

// The choice of images takes what there is, be it less than was asked for.
TEST_F(BadBundle, OfFewerImagesThanAPointMustBeSeenByIsRejected) {
  PlaneScene scene;
  scene.num_images = 3;
  DepthEstimatorOptions options;
  options.refinement.min_views = 3;
  const DepthResult result = Estimate(scene.Bundle(), options);
  EXPECT_EQ(result.status, DepthStatus::kRejected);
  EXPECT_EQ(result.rejection, DepthRejection::kOther);
  EXPECT_EQ(result.reason, "fewer matching images than refinement.min_views");
  EXPECT_TRUE(result.map.depth.empty());
}

TEST_F(BadBundle, OfImagesOfTwoSizesIsRefused) {
  ImageBundle bundle = PlaneScene().Bundle();
  PlaneScene other;
  other.camera = other.camera.Resized(120, 96);
  bundle.keyframes[3] = other.Bundle().keyframes[3];
  EXPECT_THAT([&] { (void)Estimate(bundle); },
              ThrowsMessage<Error>(AllOf(HasSubstr("images of a bundle differ in size"),
                                         HasSubstr("(expected 160x96, found 120x96)"))));
}

TEST_F(BadBundle, OfImagesTooSmallOrTooLargeForTheDeviceIsRefused) {
  PlaneScene scene;
  scene.camera = scene.camera.Resized(63, 64);
  EXPECT_THAT([&] { (void)Estimate(scene.Bundle()); },
              ThrowsMessage<Error>(AllOf(HasSubstr("image is too small for depth"),
                                         HasSubstr("(expected at least 64x64, found 63x64)"))));
  ImageBundle huge = PlaneScene().Bundle();
  for (Keyframe& keyframe : huge.keyframes) {  // one byte of memory for all
    keyframe.frame.camera = keyframe.frame.camera.Resized(1 << 20, 1 << 20);
    keyframe.frame.bgr = cv::Mat(1 << 20, 1 << 20, CV_8UC3, keyframe.frame.bgr.data, 0);
  }
  EXPECT_THAT([&] { (void)Estimate(huge); },
              ThrowsMessage<Error>(AllOf(HasSubstr("image is too large for depth on "),
                                         HasSubstr("pixels, as a buffer may have "),
                                         HasSubstr("found 1048576x1048576"))));
}

TEST_F(BadBundle, OfTheSmallestAndOddSizesHasDepth) {
  for (const cv::Size size : {cv::Size(64, 64), cv::Size(65, 67)}) {
    PlaneScene scene;
    scene.camera = {size.width, size.height, 150, 150, 32, 32, {}};
    scene.baseline = 0.05;
    const DepthResult result = Estimate(scene.Bundle());
    ASSERT_EQ(result.status, DepthStatus::kEstimated) << result.reason;
    ExpectFinite(result.map);
    // A pixel in the farthest camera is 13 % of the depth here.
    const Found found = FoundIn(result, scene, WholeOf(scene), 0.04);
    EXPECT_GT(found.density, 0.7);
    EXPECT_GT(found.share_true, 0.9);
  }
}

TEST_F(BadBundle, OfPosesOrCamerasWithBadNumbersIsRefused) {
  const double nan = std::nan("");
  ImageBundle bundle = PlaneScene().Bundle();
  const Keyframe good = bundle.keyframes[1];
  const Pose good_pose = bundle.T_ref_cam[1];
  const auto refusal = [&] {
    std::string message;
    try {
      (void)Estimate(bundle);
    } catch (const Error& error) {
      message = error.what();
    }
    bundle.keyframes[1] = good;
    bundle.T_ref_cam[1] = good_pose;
    return message;
  };
  bundle.T_ref_cam[1] = Pose(good_pose.rotation(), {nan, 0, 0});
  EXPECT_THAT(refusal(), HasSubstr("plane: pose is no rigid motion"));
  bundle.T_ref_cam[1] = Pose(good_pose.rotation(), {0, HUGE_VAL, 0});
  EXPECT_THAT(refusal(), HasSubstr("pose is no rigid motion"));
  bundle.T_ref_cam[1] = Pose(Eigen::Quaterniond(nan, 0, 0, 0), {0, 0, 0});
  EXPECT_THAT(refusal(), HasSubstr("pose is no rigid motion"));
  bundle.keyframes[1].frame.camera.fx = 0;
  EXPECT_THAT(refusal(), HasSubstr("focal length fx"));
  bundle.keyframes[1].frame.camera.cy = nan;
  EXPECT_THAT(refusal(), HasSubstr("principal point cy"));
  EXPECT_EQ(refusal(), "");
}

TEST_F(BadBundle, WithIdenticalPosesIsRejected) {
  ImageBundle bundle = PlaneScene().Bundle();
  const Pose T_world_cam(RotationExp({0.3, -0.2, 1}), {1e6, -3e5, 70});
  SetPoses(std::vector<Pose>(bundle.keyframes.size(), T_world_cam), bundle);
  ExpectRejected(bundle, DepthRejection::kNoBaseline, "no baseline");
}

TEST_F(BadBundle, WithABaselineTooSmallForTheDepthIsRejected) {
  PlaneScene scene;
  scene.baseline = 1e-5;
  ExpectRejected(scene.Bundle(), DepthRejection::kNoBaseline, "baseline is too small");
}

class PosesAsFarApartAsNumbersGo : public BadBundle {
 protected:
  static ImageBundle BundleOf(const PlaneScene& scene) {
    ImageBundle bundle = scene.Bundle();
    bundle.T_ref_cam[0] = Pose(Eigen::Quaterniond::Identity(), {1e300, 0, 0});
    bundle.T_ref_cam[4] = Pose(Eigen::Quaterniond::Identity(), {-1e300, 0, 1e300});
    return bundle;
  }
};

// The sparse depths say where to look, and the three cameras left see it.
TEST_F(PosesAsFarApartAsNumbersGo, HaveDepthFromTheOthers) {
  const PlaneScene scene;
  const DepthResult result = Estimate(BundleOf(scene));
  ASSERT_EQ(result.status, DepthStatus::kEstimated) << result.reason;
  ExpectFinite(result.map);
  EXPECT_GT(FoundIn(result, scene, WholeOf(scene)).share_true, 0.9);
}

TEST_F(PosesAsFarApartAsNumbersGo, AreRejectedWithoutSparseDepths) {
  PlaneScene scene;
  scene.with_sparse_depths = false;
  ExpectRejected(BundleOf(scene), DepthRejection::kNoMatch, "do not overlap or do not match");
}

TEST_F(BadBundle, OfCamerasThatLookAwayFromEachOtherIsRejected) {
  for (const bool with_sparse_depths : {true, false}) {
    PlaneScene scene;
    scene.with_sparse_depths = with_sparse_depths;
    ImageBundle bundle = scene.Bundle();
    for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
      if (i == bundle.reference_index()) continue;
      Pose& pose = bundle.T_ref_cam[i];
      pose = Pose(RotationExp({0, 3, 0}), pose.translation());
    }
    // Without a range of depths from the tracker nothing tells the one from the other.
    ExpectRejected(bundle,
                   with_sparse_depths ? DepthRejection::kNoOverlap : DepthRejection::kNoMatch,
                   "do not overlap");
  }
}

// The nearest planes lie behind the cameras that have flown on.
TEST_F(BadBundle, WithPlanesBehindACameraHasDepthAllTheSame) {
  PlaneScene scene;
  scene.direction = {0.7, 0, 0.7};
  const DepthResult result = Estimate(scene.Bundle(), OptionsOfRange(0.2, 10));
  ASSERT_EQ(result.status, DepthStatus::kEstimated) << result.reason;
  EXPECT_LT(result.min_depth_su, 2 * scene.baseline * scene.direction.z());
  ExpectFinite(result.map);
  EXPECT_GT(FoundIn(result, scene, WholeOf(scene)).density, 0.8);
  EXPECT_GT(FoundIn(result, scene, WholeOf(scene)).share_true, 0.9);
}

TEST_F(BadBundle, WithACameraBehindTheSurfaceHasDepthFromTheOthers) {
  const PlaneScene scene;
  ImageBundle bundle = scene.Bundle();
  Pose& last = bundle.T_ref_cam[4];
  last = Pose(last.rotation(), {0.1, 0, 3});
  const DepthResult result = Estimate(bundle);
  ASSERT_EQ(result.status, DepthStatus::kEstimated) << result.reason;
  ExpectFinite(result.map);
  EXPECT_GT(FoundIn(result, scene, WholeOf(scene)).density, 0.8);
  EXPECT_GT(FoundIn(result, scene, WholeOf(scene)).share_true, 0.9);
}

TEST_F(BadBundle, WhoseRangeLiesWhollyBehindTheCamerasIsRejected) {
  PlaneScene scene;
  scene.direction = {0, 0, 1};
  // The sources after the reference have flown past these depths; those before look at them from
  // far behind, where nothing of the reference's image is.
  const DepthResult result = Estimate(scene.Bundle(), OptionsOfRange(1e-6, 2e-6));
  EXPECT_EQ(result.status, DepthStatus::kRejected);
  EXPECT_FALSE(result.reason.empty());
}

TEST_F(BadBundle, OfImagesWithoutTextureIsRejected) {
  for (const bool with_sparse_depths : {true, false}) {
    PlaneScene scene;
    scene.contrast = 0;
    scene.with_sparse_depths = with_sparse_depths;
    ExpectRejected(scene.Bundle(), DepthRejection::kNoTexture, "no texture in the middle image");
  }
}

TEST_F(BadBundle, OfImagesThatAreBlackOrSaturatedIsRejected) {
  for (const double grey : {0, 255}) {
    ImageBundle bundle = PlaneScene().Bundle();
    for (Keyframe& keyframe : bundle.keyframes) keyframe.frame.bgr.setTo(cv::Scalar::all(grey));
    ExpectRejected(bundle, DepthRejection::kNoTexture, "the middle image is black or saturated");
  }
}

TEST_F(BadBundle, WhoseOtherImagesAreBlankIsRejected) {
  ImageBundle bundle = PlaneScene().Bundle();
  for (std::size_t i = 0; i < bundle.keyframes.size(); ++i) {
    if (i != 2) bundle.keyframes[i].frame.bgr.setTo(cv::Scalar::all(100));
  }
  ExpectRejected(bundle, DepthRejection::kNoTexture,
                 "no texture in the images around the middle one");
}

// The sky burns out above the horizon: no depth there, the right one below.
TEST_F(BadBundle, OfHalfSaturatedImagesHasDepthInTheOtherHalf) {
  const PlaneScene scene;
  ImageBundle bundle = scene.Bundle();
  for (Keyframe& keyframe : bundle.keyframes) {
    keyframe.frame.bgr.rowRange(0, 48).setTo(cv::Scalar::all(255));
  }
  const DepthResult result = Estimate(bundle);
  ASSERT_EQ(result.status, DepthStatus::kEstimated) << result.reason;
  ExpectFinite(result.map);
  // Beyond the windows' reach of the border.
  EXPECT_EQ(FoundIn(result, scene, {0, 0, 160, 40}).density, 0);
  EXPECT_GT(FoundIn(result, scene, {0, 56, 160, 40}).density, 0.8);
  EXPECT_GT(FoundIn(result, scene, {0, 56, 160, 40}).share_true, 0.9);
}

// Each image shows a scene of its own.
TEST_F(BadBundle, OfImagesThatHaveNothingInCommonIsRejected) {
  ImageBundle bundle = PlaneScene().Bundle();
  cv::RNG random(7);
  for (Keyframe& keyframe : bundle.keyframes) {
    random.fill(keyframe.frame.bgr, cv::RNG::UNIFORM, 0, 256);
  }
  ExpectRejected(bundle, DepthRejection::kNoMatch, "the images do not match");
  // Coarse patterns match by chance over large areas.
  for (Keyframe& keyframe : bundle.keyframes) {
    cv::GaussianBlur(keyframe.frame.bgr, keyframe.frame.bgr, {}, 3);
    keyframe.frame.bgr.convertTo(keyframe.frame.bgr, -1, 6, -5 * 128);  // its contrast again
  }
  ExpectRejected(bundle, DepthRejection::kNoMatch,
                 "the images do not match: those before and after the middle one disagree");
}

}  // namespace
}  // namespace mono3d
