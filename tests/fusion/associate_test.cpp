// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "fusion/fusion_scene.h"

namespace mono3d {
namespace {

const Eigen::Vector3f kTowardsCamera(0, 0, -1);

// What a depth map of a wall 10 su away says of a surfel; 9x5 pixels, the middle one is number 22.
std::uint32_t AssociationWith(const TrackedMap& map, const Surfels& surfels) {
  StageScene scene(map, surfels);
  scene.RunAssociate();
  return scene.DeviceAssociation().front();
}

std::uint32_t AssociationOf(const Surfels& surfels) {
  return AssociationWith(PlaneMap(TestCamera(9, 5), Pose()), surfels);
}

// sigma(z) of the map at 10 su: half a pixel of 1/9 of 100; the surfels here are as sure.
constexpr float kSigma = 0.5F * 100 / 9;
constexpr float kWeight = 1 / (kSigma * kSigma);

TEST(Associate, FindsThePixelOntoWhichASurfelFalls) {
  EXPECT_EQ(AssociationOf(OneSurfel({0, 0, 10}, kTowardsCamera, kWeight)), 22U);
  // One pixel is 10 / 9 su wide.
  EXPECT_EQ(AssociationOf(OneSurfel({1.12F, -2.23F, 10}, kTowardsCamera, kWeight)), 5U);
  EXPECT_EQ(AssociationOf(OneSurfel({0.54F, 0, 10}, kTowardsCamera, kWeight)), 22U);
  EXPECT_EQ(AssociationOf(OneSurfel({0.57F, 0, 10}, kTowardsCamera, kWeight)), 23U);
}

TEST(Associate, LeavesOutWhatTheMapDoesNotSee) {
  EXPECT_EQ(AssociationOf(OneSurfel({0, 0, -10}, kTowardsCamera, kWeight)), kUnseen);  // behind
  EXPECT_EQ(AssociationOf(OneSurfel({9, 0, 10}, kTowardsCamera, kWeight)), kUnseen);   // beside
  EXPECT_EQ(AssociationOf(OneSurfel({0, 0, 10}, kTowardsCamera, 0)), kUnseen);         // removed
  TrackedMap empty = PlaneMap(TestCamera(9, 5), Pose());
  empty.depth.at<float>(2, 4) = 0;
  EXPECT_EQ(AssociationWith(empty, OneSurfel({0, 0, 10}, kTowardsCamera, kWeight)), kUnseen);
}

TEST(Associate, ComparesDepthInSigmas) {
  // A hundredth of the sigma above, so that inverse depth is as good as linear: three sigmas of
  // both are 0.236 su, four 0.314.
  TrackedMap map = PlaneMap(TestCamera(900, 5), Pose());
  map.depth_sigma_per_square_depth = 1.0 / 900;
  constexpr float kSmallWeight = kWeight * 1e4F;
  const auto at = [&](float z) {
    // Onto pixel (450, 2), away from the border of the image.
    return AssociationWith(map, OneSurfel({0.5F / 900 * z, 0, z}, kTowardsCamera, kSmallWeight));
  };
  constexpr std::uint32_t kMiddle = 2 * 900 + 450;
  EXPECT_EQ(at(10.22F), kMiddle);
  EXPECT_EQ(at(10.27F), kUnseen);  // too far for the wall, too close to be hidden
  EXPECT_EQ(at(10.5F), kHidden | 255U);
  EXPECT_EQ(at(20), kHidden | 255U);
  EXPECT_EQ(at(9.78F), kMiddle);
  EXPECT_EQ(at(9.74F), kUnseen);  // too near for the wall, too close for free space
  EXPECT_EQ(at(9.6F), kSeenThrough | 255U);
  EXPECT_EQ(at(2), kSeenThrough | 255U);
}

TEST(Associate, DemandsEqualNormals) {
  const auto turned = [](double degrees) {
    const double angle = degrees * std::numbers::pi / 180;
    const Eigen::Vector3d n(std::sin(angle), 0, -std::cos(angle));
    return AssociationOf(OneSurfel({0, 0, 10}, n.cast<float>(), kWeight));
  };
  EXPECT_EQ(turned(50), 22U);
  EXPECT_EQ(turned(70), kUnseen);
  EXPECT_EQ(turned(180), kUnseen);
}

TEST(Associate, TakesNoEvidenceFromOutlinesAndHoles) {
  TrackedMap map = PlaneMap(TestCamera(90, 50), Pose());
  const Surfels in_front = OneSurfel({0, 0, 1}, kTowardsCamera, kWeight * 1e4F);
  ASSERT_EQ(AssociationWith(map, in_front), kSeenThrough | 255U);
  // It falls onto pixel (45, 25); beside it something is as near.
  map.depth.at<float>(24, 44) = 1;
  EXPECT_EQ(AssociationWith(map, in_front), kUnseen);
  map.depth.at<float>(24, 44) = 0;
  EXPECT_EQ(AssociationWith(map, in_front), kUnseen);
}

TEST(Associate, CallsASurfelHiddenThatFacesTheCamera) {
  const TrackedMap map = PlaneMap(TestCamera(90, 50), Pose());
  const auto behind = [&](const Eigen::Vector3f& normal) {
    return AssociationWith(map, OneSurfel({0, 0, 30}, normal, kWeight));
  };
  EXPECT_EQ(behind(kTowardsCamera), kHidden | 255U);
  EXPECT_EQ(behind(-kTowardsCamera), kUnseen);
}

TEST(Associate, IsAsSureAsTheLeastSureOfNinePixels) {
  TrackedMap map = PlaneMap(TestCamera(90, 50), Pose());
  map.confidence = cv::Mat(50, 90, CV_32FC1, cv::Scalar(0.8));
  map.confidence.at<float>(24, 44) = 0.4F;
  EXPECT_EQ(AssociationWith(map, OneSurfel({0, 0, 1}, kTowardsCamera, 1e4F)), kSeenThrough | 102U);
  EXPECT_EQ(AssociationWith(map, OneSurfel({0, 0, 30}, kTowardsCamera, 1e4F)), kHidden | 102U);
}

TEST(Associate, EqualsReference) {
  // Decisions on sums of products; `precise` makes them alike where division is exact, as on
  // lavapipe. Vulkan allows 2.5 units in the last place: then a few surfels in 1000 sit on a
  // border.
  constexpr double kMaxDifferingShare = 0.002;
  for (const auto& [width, height] : {std::pair{1, 1}, {17, 33}, {96, 56}}) {
    StageScene scene(width, height, 2);
    scene.RunAssociate();
    const auto expected = reference::Associate(scene.view, scene.anchors, scene.packed,
                                               scene.DeviceCandidates(), scene.surfels);
    EXPECT_LE(DifferingShare(scene.DeviceAssociation(), expected), kMaxDifferingShare);
    if (width < 96) continue;
    // The scene has them all.
    const auto confirmed =
        static_cast<std::size_t>(std::count_if(expected.begin(), expected.end(), IsPixel));
    EXPECT_GT(confirmed, expected.size() / 2);
    for (const std::uint32_t what : {kSeenThrough, kHidden}) {
      EXPECT_GT(std::count_if(expected.begin(), expected.end(),
                              [&](std::uint32_t a) { return Says(a, what); }),
                0);
    }
    EXPECT_GT(std::count(expected.begin(), expected.end(), kUnseen), 0);
  }
}

}  // namespace
}  // namespace mono3d
