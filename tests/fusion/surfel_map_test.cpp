// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/fusion/surfel_map.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/core.hpp>

#include "fusion/fusion_scene.h"
#include "gpu/test_device.h"

namespace mono3d {
namespace {

constexpr int kWidth = 96;
constexpr int kHeight = 64;

// Maps of noise in random colours: there is nothing to register.
std::unique_ptr<TrackedModel> EmptyMap(SurfelMapOptions options = {}) {
  options.registration.enabled = false;
  return CreateTrackedModel(options);
}

Pose Sideways(double x_su) { return {Eigen::Quaterniond::Identity(), Eigen::Vector3d(x_su, 0, 0)}; }

// A wall 10 su away with a tenth of a pixel of noise, from a camera at x; `scale` enlarges the
// world.
TrackedMap WallMap(double x_su, unsigned seed, double scale = 1) {
  constexpr double kNoise = 0.01;  // sigma of inverse depth is half a pixel of 1/96 of it 10 times
  TrackedMap map =
      PlaneMap(TestCamera(kWidth, kHeight), Sideways(x_su * scale), Plane{{0, 0, -1}, -10 * scale});
  map.depth_sigma_per_square_depth = 1 / (kWidth * scale);
  Disturb(map, kNoise, 0, seed);
  return map;
}

double MeanObservations(const PointCloud& cloud) {
  const auto sum = std::accumulate(cloud.observations.begin(), cloud.observations.end(), 0U);
  return static_cast<double>(sum) / static_cast<double>(cloud.size());
}

TEST(SurfelMap, MakesASurfelOfEveryPixelOfTheFirstMap) {
  const auto map = EmptyMap();
  TrackedMap first = WallMap(0, 1);
  first.depth.at<float>(3, 5) = 0;
  const FusionResult result = map->Integrate(first);
  EXPECT_EQ(result.status, FusionStatus::kFused);
  EXPECT_EQ(result.num_inserted, kWidth * kHeight - 1);
  EXPECT_EQ(result.num_merged, 0);
  EXPECT_EQ(result.num_removed, 0);
  EXPECT_EQ(result.num_surfels, kWidth * kHeight - 1);
  EXPECT_EQ(map->num_surfels(), result.num_surfels);
  const PointCloud cloud = map->Export(1);
  EXPECT_EQ(cloud.size(), static_cast<std::size_t>(result.num_surfels));
  EXPECT_TRUE(map->Export(2).empty());
}

TEST(SurfelMap, FusesWhatWasMatchedAlone) {
  const auto map = EmptyMap();
  TrackedMap half = WallMap(0, 1);
  half.inferred = cv::Mat::zeros(half.depth.size(), CV_8UC1);
  half.inferred.colRange(0, kWidth / 2).setTo(255);
  EXPECT_EQ(map->Integrate(half).num_inserted, kWidth / 2 * kHeight);
  half.inferred.setTo(255);
  EXPECT_EQ(map->Integrate(half).status, FusionStatus::kRejected);
}

TEST(SurfelMap, MakesOneLayerOfAWallSeenFromTwoPoses) {
  const auto map = EmptyMap();
  (void)map->Integrate(WallMap(0, 1));
  // A footprint is 10 / 96 su: 19.4 columns of 96 are new, at no whole number of pixels.
  const FusionResult result = map->Integrate(WallMap(2.02, 2));
  EXPECT_EQ(result.num_merged + result.num_inserted, kWidth * kHeight);
  EXPECT_NEAR(static_cast<double>(result.num_inserted), 19.4 * kHeight, 1.0 * kHeight);
  EXPECT_EQ(result.num_removed, 0);
  const PointCloud twice = map->Export(2);
  // All that both maps see, but for noise beyond three sigmas at most.
  EXPECT_GT(static_cast<double>(twice.size()), 0.98 * (kWidth - 20) * kHeight);
  EXPECT_EQ(MeanObservations(twice), 2);
}

TEST(SurfelMap, AveragesNoiseAway) {
  constexpr int kNumMaps = 9;
  const auto map = EmptyMap();
  const auto deviation = [&] {
    double sum = 0;
    const PointCloud cloud = map->Export(1);
    for (const auto& p : cloud.points) sum += std::pow(p.z() - 10, 2);
    return std::sqrt(sum / static_cast<double>(cloud.size()));
  };
  (void)map->Integrate(WallMap(0, 1));
  const double of_one = deviation();
  for (unsigned i = 1; i < kNumMaps; ++i) (void)map->Integrate(WallMap(0, i + 1));
  // To a third by statistics; a margin of a quarter for its own scatter.
  EXPECT_LT(deviation(), of_one / 3 * 1.25);
  EXPECT_EQ(map->num_surfels(), kWidth * kHeight);
}

TEST(SurfelMap, RemovesAFalseWallThatIsSeenThrough) {
  const auto map = EmptyMap();
  TrackedMap with_wall = WallMap(0, 1);
  with_wall.depth(cv::Rect(30, 20, 20, 10)).setTo(4);
  (void)map->Integrate(with_wall);
  const FusionResult result = map->Integrate(WallMap(0, 2));
  EXPECT_EQ(result.num_removed, 200);
  for (const auto& p : map->Export(1).points) EXPECT_GT(p.z(), 8);
  // Behind it the true wall fills in: all 20 x 10 pixels but those on the rim that lie within one
  // pixel of a true surfel.
  EXPECT_GE(result.num_inserted, 18 * 8);
  EXPECT_LE(result.num_inserted, 20 * 10);
}

TEST(SurfelMap, KeepsAWallThatOneMapMisses) {
  const auto map = EmptyMap();
  (void)map->Integrate(WallMap(0, 1));
  (void)map->Integrate(WallMap(0, 2));
  TrackedMap past_it = WallMap(0, 3);
  past_it.depth(cv::Rect(30, 20, 20, 10)).setTo(40);
  EXPECT_EQ(map->Integrate(past_it).num_removed, 0);
}

TEST(SurfelMap, KeepsItsOrderWhenGapsAreClosed) {
  const auto map = EmptyMap();
  TrackedMap mostly_false = WallMap(0, 1);
  mostly_false.depth(cv::Rect(0, 0, kWidth, kHeight / 2)).setTo(4);
  (void)map->Integrate(mostly_false);
  const PointCloud before = map->Export(1);
  const FusionResult result = map->Integrate(WallMap(0, 2));
  // More than one in four of all slots; the outermost pixels and their neighbours prove nothing.
  ASSERT_GT(result.num_removed, kWidth * kHeight * 0.4);
  const PointCloud after = map->Export(1);
  EXPECT_EQ(static_cast<std::int64_t>(after.size()), result.num_surfels);
  // The true half was there first and stays in the order of its pixels.
  const PointCloud twice = map->Export(2);
  ASSERT_EQ(twice.size(), static_cast<std::size_t>(kWidth * kHeight / 2));
  for (std::size_t i = 0; i < twice.size(); ++i) {
    const auto& old = before.points[before.size() - twice.size() + i];
    EXPECT_NEAR(twice.points[i].x() / twice.points[i].z(), old.x() / old.z(), 1e-4);
  }
}

TEST(SurfelMap, GivesTheSameBytesTwice) {
  const auto run = [] {
    const auto map = EmptyMap();
    for (unsigned i = 0; i < 4; ++i) (void)map->Integrate(WallMap(0.7 * i, i + 1));
    return map->Export(1);
  };
  const PointCloud first = run();
  const PointCloud second = run();
  EXPECT_EQ(first.points, second.points);
  EXPECT_EQ(first.normals, second.normals);
  EXPECT_EQ(first.colours, second.colours);
  EXPECT_EQ(first.radii, second.radii);
  EXPECT_EQ(first.confidences, second.confidences);
  EXPECT_EQ(first.observations, second.observations);
  EXPECT_EQ(first.first_frames, second.first_frames);
}

TEST(SurfelMap, TellsWhichFrameSawASurfelFirst) {
  const auto map = EmptyMap();
  for (unsigned i = 0; i < 2; ++i) {
    TrackedMap seen = WallMap(11.0 * i, i + 1);  // side by side
    seen.frame_index = 30 + 10 * i;
    ASSERT_EQ(map->Integrate(seen).status, FusionStatus::kFused);
    seen.frame_index = 35 + 10 * i;  // once more the same
    ASSERT_EQ(map->Integrate(seen).status, FusionStatus::kFused);
  }
  const std::vector<std::uint32_t> frames = map->Export(1).first_frames;
  const auto num_of = [&frames](std::uint32_t frame) { return std::ranges::count(frames, frame); };
  EXPECT_EQ(num_of(30), kWidth * kHeight);
  EXPECT_EQ(num_of(40), kWidth * kHeight);
  // What rounding keeps apart from what was seen before is new.
  EXPECT_LT(num_of(35) + num_of(45), kWidth * kHeight / 50);
}

TEST(SurfelMap, DoesNotDependOnTheScaleOfTheWorld) {
  constexpr double kScale = 1000;
  // Decisions on the border may fall the other way by rounding.
  constexpr double kMaxDifferenceOfCounts = 5;
  const auto map = EmptyMap();
  const auto large = EmptyMap();
  for (unsigned i = 0; i < 3; ++i) {
    const FusionResult a = map->Integrate(WallMap(0.7 * i, i + 1));
    const FusionResult b = large->Integrate(WallMap(0.7 * i, i + 1, kScale));
    EXPECT_NEAR(static_cast<double>(a.num_inserted), static_cast<double>(b.num_inserted),
                kMaxDifferenceOfCounts);
    EXPECT_EQ(a.num_removed, b.num_removed);
  }
  const PointCloud one = map->Export(1);
  const PointCloud other = large->Export(1);
  // The first map's surfels have the same places in both.
  for (std::size_t i = 0; i < static_cast<std::size_t>(kWidth * kHeight); i += 7) {
    EXPECT_LT((one.points[i] * kScale - other.points[i]).norm(), 1e-3 * kScale);
    EXPECT_NEAR(one.radii[i] * kScale, other.radii[i], 1e-3 * kScale);
    EXPECT_EQ(one.observations[i], other.observations[i]);
  }
}

TEST(SurfelMap, GrowsBeyondItsFirstBuffers) {
  const auto map = EmptyMap();
  // Side by side, without overlap: 13 times 6144 surfels are more than the 65536 of the first step.
  constexpr int kNumMaps = 13;
  for (unsigned i = 0; i < kNumMaps; ++i) {
    EXPECT_EQ(map->Integrate(WallMap(11.0 * i, i + 1)).num_inserted, kWidth * kHeight);
  }
  const PointCloud cloud = map->Export(1);
  ASSERT_EQ(cloud.size(), static_cast<std::size_t>(kNumMaps * kWidth * kHeight));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const double camera_x = 11.0 * static_cast<double>(i / (kWidth * kHeight));
    ASSERT_NEAR(cloud.points[i].x(), camera_x, 6) << i;
  }
}

TEST(SurfelMap, EqualsTheReferenceAfterSeveralMaps) {
  constexpr double kMaxDifferingShare = 0.002;  // decisions that rounding tips over
  const auto map = EmptyMap();
  Surfels expected;
  std::vector<Similarity> S_world_anchor;
  for (unsigned i = 0; i < 3; ++i) {
    const TrackedMap depth_map = WallMap(0.7 * i, i + 1);
    (void)map->Integrate(depth_map);
    const auto num_surfels = static_cast<std::uint32_t>(expected.size());
    const Similarity S_world_kf(1, depth_map.T_world_cam);
    reference::Integrate(MakeViewParams(depth_map, {}, num_surfels, i),
                         AnchorTransforms(S_world_kf, S_world_anchor), Pack(depth_map), expected);
    S_world_anchor.push_back(S_world_kf);
  }
  const PointCloud cloud = map->Export(1);
  EXPECT_NEAR(static_cast<double>(cloud.size()), static_cast<double>(expected.size()),
              kMaxDifferingShare * static_cast<double>(expected.size()));
  std::vector<std::uint32_t> observations;
  for (std::size_t i = 0; i < static_cast<std::size_t>(kWidth * kHeight); ++i) {
    observations.push_back(Low16(expected.history[i][1]));
  }
  const std::vector<std::uint32_t> found(cloud.observations.begin(),
                                         cloud.observations.begin() + kWidth * kHeight);
  EXPECT_LE(DifferingShare(found, observations), kMaxDifferingShare);
}

}  // namespace
}  // namespace mono3d
