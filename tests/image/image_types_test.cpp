// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>

#include <cmath>
#include <opencv2/core.hpp>
#include <string>

#include "mono3d/core/error.h"
#include "mono3d/image/depth_map.h"
#include "mono3d/image/frame.h"
#include "mono3d/image/image_bundle.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

CameraModel TestCamera() { return {6, 4, 5, 5, 2.5, 1.5, {}}; }

Frame TestFrame() {
  return {0, 0, "a.jpg", cv::Mat(4, 6, CV_8UC3, cv::Scalar(1, 2, 3)), TestCamera()};
}

ImageBundle TestBundle() {
  ImageBundle bundle;
  bundle.keyframes.resize(kBundleSize);
  for (Keyframe& keyframe : bundle.keyframes) keyframe.frame = TestFrame();
  bundle.T_ref_cam.resize(kBundleSize);
  return bundle;
}

DepthMap TestMap() {
  DepthMap map;
  map.camera = TestCamera();
  map.depth = cv::Mat(4, 6, CV_32FC1, cv::Scalar(0));
  return map;
}

TEST(Frame, IsValidAsMade) { EXPECT_NO_THROW(Validate(TestFrame())); }

TEST(Frame, RefusesAnotherTypeSizeOrDistortion) {
  Frame grey = TestFrame();
  grey.bgr = ToGrey(grey.bgr);
  EXPECT_THAT([&] { Validate(grey); },
              ThrowsMessage<Error>(HasSubstr("a.jpg: wrong image type (expected 8-bit colour")));
  Frame large = TestFrame();
  large.bgr = cv::Mat(8, 12, CV_8UC3);
  EXPECT_THAT([&] { Validate(large); },
              ThrowsMessage<Error>(HasSubstr("(expected 6x4, found 12x8)")));
  Frame distorted = TestFrame();
  distorted.camera.distortion[0] = 0.1;
  EXPECT_THAT([&] { Validate(distorted); }, ThrowsMessage<Error>(HasSubstr("image is distorted")));
}

TEST(ImageBundle, HasItsReferenceInTheMiddle) {
  ImageBundle bundle = TestBundle();
  bundle.keyframes[2].id = 42;
  EXPECT_EQ(bundle.reference().id, 42);
  EXPECT_NO_THROW(Validate(bundle));
}

ImageBundle BundleOf(std::size_t num_images) {
  ImageBundle bundle = TestBundle();
  bundle.keyframes.resize(num_images, bundle.keyframes[0]);
  bundle.T_ref_cam.resize(num_images);
  return bundle;
}

TEST(ImageBundle, HasThreeToNineImages) {
  for (std::size_t num_images = 0; num_images < 12; ++num_images) {
    const ImageBundle bundle = BundleOf(num_images);
    if (num_images >= 3 && num_images <= 9) {
      EXPECT_NO_THROW(Validate(bundle));
      EXPECT_EQ(bundle.reference_index(), num_images / 2);
      continue;
    }
    EXPECT_THAT([&] { Validate(bundle); },
                ThrowsMessage<Error>(HasSubstr(
                    "wrong number of images in a bundle (expected 3 to 9, 1 to 4 of them on each "
                    "side of the reference, found " +
                    std::to_string(num_images) + ", ")));
  }
}

TEST(ImageBundle, HasOneToFourImagesOnEachSide) {
  for (std::size_t before = 0; before < 8; ++before) {
    ImageBundle bundle = BundleOf(6);
    bundle.num_first_side = before;
    if (before >= 1 && before <= 4) {
      EXPECT_NO_THROW(Validate(bundle)) << before;
      EXPECT_EQ(&bundle.reference(), &bundle.keyframes[before]);
    } else {
      EXPECT_THAT(
          [&] { Validate(bundle); },
          ThrowsMessage<Error>(HasSubstr(std::to_string(before) + " of them before the reference")))
          << before;
    }
  }
}

TEST(ImageBundle, RefusesPosesThatAreNoRigidMotions) {
  const double nan = std::nan("");
  const Eigen::Vector3d origin = Eigen::Vector3d::Zero();
  const Eigen::Quaterniond identity = Eigen::Quaterniond::Identity();
  for (const Pose& pose : {Pose(identity, {0, nan, 0}), Pose(identity, {0, HUGE_VAL, 0}),
                           Pose(Eigen::Quaterniond(nan, 0, 0, 1), origin),
                           Pose(Eigen::Quaterniond(0, 0, 0, 0), origin)}) {
    ImageBundle bundle = TestBundle();
    bundle.T_ref_cam[3] = pose;
    EXPECT_THAT([&] { Validate(bundle); },
                ThrowsMessage<Error>(HasSubstr("a.jpg: pose is no rigid motion (expected a unit "
                                               "quaternion and a finite translation, found ")));
  }
}

TEST(ImageBundle, RefusesACameraWithoutFocalLength) {
  ImageBundle bundle = TestBundle();
  bundle.keyframes[1].frame.camera.fx = 0;
  EXPECT_THAT([&] { Validate(bundle); }, ThrowsMessage<Error>(HasSubstr("focal length fx")));
}

TEST(ImageBundle, RefusesImagesOfTwoSizesOrWithoutAPose) {
  ImageBundle sizes = TestBundle();
  sizes.keyframes[1].frame.bgr = cv::Mat(2, 3, CV_8UC3);
  sizes.keyframes[1].frame.camera = TestCamera().Resized(3, 2);
  EXPECT_THAT([&] { Validate(sizes); },
              ThrowsMessage<Error>(HasSubstr("images of a bundle differ in size")));
  ImageBundle poses = TestBundle();
  poses.T_ref_cam.pop_back();
  EXPECT_THAT([&] { Validate(poses); },
              ThrowsMessage<Error>(HasSubstr("wrong number of poses in a bundle")));
}

TEST(DepthMap, BecomesAPointCloudInTheWorld) {
  DepthMap map = TestMap();
  map.depth.at<float>(1, 5) = 10;
  map.normal = cv::Mat(4, 6, CV_32FC3, cv::Scalar(0, 0, -1));
  map.bgr = cv::Mat(4, 6, CV_8UC3, cv::Scalar(1, 2, 3));
  // The camera looks along the world's x: a quarter turn about y.
  const Pose T_world_cam(Eigen::Quaterniond(Eigen::AngleAxisd(M_PI / 2, Eigen::Vector3d::UnitY())),
                         Eigen::Vector3d(100, 0, 0));
  EXPECT_EQ(CountEstimates(map), 1);
  const PointCloud cloud = ToPointCloud(map, {2, T_world_cam});
  ASSERT_EQ(cloud.size(), 1U);
  // p_cam = 10 * ((5 - 2.5) / 5, (1 - 1.5) / 5, 1) = (5, -1, 10), in a unit of 2
  EXPECT_TRUE(cloud.points[0].isApprox(Eigen::Vector3f(120, -2, -10), 1e-6F))
      << cloud.points[0].transpose();
  EXPECT_TRUE(cloud.normals[0].isApprox(Eigen::Vector3f(-1, 0, 0), 1e-6F));
  EXPECT_EQ(cloud.colours[0], (std::array<std::uint8_t, 3>{3, 2, 1}));
  EXPECT_THAT(cloud.confidences, IsEmpty());
}

TEST(DepthMap, LeavesOutWhatIsInferred) {
  DepthMap map = TestMap();
  map.depth = cv::Scalar(3);
  map.confidence = cv::Mat(4, 6, CV_32FC1, cv::Scalar(0.5));
  EXPECT_EQ(CountEstimates(WithoutInferred(map)), 24);
  map.inferred = cv::Mat::zeros(4, 6, CV_8UC1);
  map.inferred.row(1) = cv::Scalar(255);
  const DepthMap matched = WithoutInferred(map);
  EXPECT_EQ(CountEstimates(matched), 18);
  EXPECT_EQ(cv::countNonZero(matched.confidence), 18);
  EXPECT_EQ(matched.depth.at<float>(1, 2), 0);
  EXPECT_TRUE(matched.inferred.empty());
  EXPECT_EQ(CountEstimates(map), 24);  // which stays as it is
  map.inferred = cv::Mat::zeros(4, 5, CV_8UC1);
  EXPECT_THAT([&] { Validate(map); }, ThrowsMessage<Error>(HasSubstr("inferred")));
}

TEST(DepthMap, RefusesImagesOfAnotherSizeOrType) {
  EXPECT_NO_THROW(Validate(TestMap()));
  DepthMap small = TestMap();
  small.depth = cv::Mat(2, 2, CV_32FC1);
  EXPECT_THAT([&] { Validate(small); }, ThrowsMessage<Error>(HasSubstr("depth")));
  DepthMap bytes = TestMap();
  bytes.confidence = cv::Mat(4, 6, CV_8UC1);
  EXPECT_THAT([&] { Validate(bytes); }, ThrowsMessage<Error>(HasSubstr("confidence")));
}

TEST(HalfSize, ShowsTheSameWithAQuarterOfThePixels) {
  ImageBundle bundle;
  bundle.keyframes.resize(3);
  bundle.T_ref_cam.resize(3);
  for (Keyframe& keyframe : bundle.keyframes) {
    Frame& frame = keyframe.frame;
    frame.camera = {.width = 8, .height = 6, .fx = 10, .fy = 10, .cx = 3.5, .cy = 2.5};
    frame.bgr = cv::Mat(6, 8, CV_8UC3, cv::Scalar::all(40));
    frame.bgr(cv::Rect(2, 4, 1, 1)).setTo(cv::Scalar::all(80));
    frame.content = cv::Rect(1, 0, 5, 6);
    keyframe.sparse_depths_su = {2};
    keyframe.sparse_pixels = {{3.5f, 2.5f}};
  }
  const ImageBundle half = HalfSize(bundle);
  Validate(half);
  const Keyframe& keyframe = half.reference();
  EXPECT_EQ(keyframe.frame.camera.width, 4);
  EXPECT_EQ(keyframe.frame.camera.height, 3);
  EXPECT_DOUBLE_EQ(keyframe.frame.camera.fx, 5);
  EXPECT_DOUBLE_EQ(keyframe.frame.camera.cx, 1.5);
  EXPECT_EQ(keyframe.frame.bgr.at<cv::Vec3b>(2, 1), cv::Vec3b(50, 50, 50));
  EXPECT_EQ(keyframe.frame.content, cv::Rect(1, 0, 2, 3));  // pixel 0 is shown in part
  EXPECT_EQ(keyframe.sparse_pixels[0], Eigen::Vector2f(1.5f, 1));
  EXPECT_EQ(bundle.reference().frame.bgr.cols, 8);
}

TEST(AtSizeOf, TakesTheNearestEstimate) {
  Frame frame;
  frame.camera = {.width = 4, .height = 2, .fx = 3, .fy = 3, .cx = 1.5, .cy = 0.5};
  frame.bgr = cv::Mat(2, 4, CV_8UC3, cv::Scalar::all(9));
  DepthMap map;
  map.camera = frame.camera.Resized(2, 1);
  map.depth = (cv::Mat_<float>(1, 2) << 5, 0);
  map.normal = cv::Mat(1, 2, CV_32FC3, cv::Scalar(0, 0, -1));
  map.confidence = (cv::Mat_<float>(1, 2) << 0.5f, 0);
  map.bgr = cv::Mat(1, 2, CV_8UC3, cv::Scalar::all(9));
  const DepthMap sized = AtSizeOf(frame, map);
  Validate(sized);
  EXPECT_EQ(cv::countNonZero(sized.depth != (cv::Mat_<float>(2, 4) << 5, 5, 0, 0, 5, 5, 0, 0)), 0);
  EXPECT_EQ(sized.confidence.at<float>(1, 1), 0.5f);
}

}  // namespace
}  // namespace mono3d
