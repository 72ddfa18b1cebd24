// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/photos/photo_matching.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"

namespace mono3d::tracking {
namespace {

constexpr std::size_t kNumSingle = 100;
constexpr std::size_t kNumTwins = 60;  // 30 structures that are there twice

// Two photos of one scene: feature i of one shows what feature i of the other does.
std::vector<PhotoFeatures> PhotosOfTwins() {
  constexpr CameraModel kCamera{
      .width = 768, .height = 576, .fx = 640, .fy = 640, .cx = 383.5, .cy = 287.5};
  std::mt19937 random(5);
  std::uniform_real_distribution<double> uniform(-1, 1);
  std::normal_distribution<double> normal;
  const auto descriptor = [&]() {
    SiftVector values;
    for (float& value : values) value = static_cast<float>(std::abs(normal(random)));
    return SiftVector(values.normalized());
  };
  std::vector<SiftVector> of_structure;
  for (std::size_t i = 0; i < kNumSingle; ++i) of_structure.push_back(descriptor());
  for (std::size_t i = 0; i < kNumTwins / 2; ++i)
    of_structure.insert(of_structure.end(), 2, descriptor());
  const std::vector<Pose> T_cam_world{
      Pose(), Pose(Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d::UnitY())),
                   Eigen::Vector3d(-1.5, 0.2, 0.1))};
  std::vector<PhotoFeatures> photos(2);
  for (PhotoFeatures& photo : photos) photo.descriptors.resize(kNumSingle + kNumTwins, kSiftSize);
  for (std::size_t i = 0; i < of_structure.size(); ++i) {
    const Eigen::Vector3d p_world(4 * uniform(random), 3 * uniform(random),
                                  10 + 2 * uniform(random));
    for (std::size_t photo = 0; photo < 2; ++photo) {
      PhotoFeatures& features = photos[photo];
      features.pixels.push_back(kCamera.Project(T_cam_world[photo] * p_world) +
                                0.3 * Eigen::Vector2d(normal(random), normal(random)));
      features.sigma_px.push_back(0.5);
      features.colours.push_back({});
      features.descriptors.row(static_cast<Eigen::Index>(i)) =
          ToDescriptor((of_structure[i] + 0.1F * descriptor()).normalized());
    }
  }
  return photos;
}

// Matches of structures that are there twice.
std::size_t NumOfTwins(const std::vector<FeatureMatch>& matches) {
  return static_cast<std::size_t>(std::ranges::count_if(
      matches, [](const FeatureMatch& match) { return match.feature_a >= kNumSingle; }));
}

// One product after the other, a feature with each.
MostSimilar MostSimilarOf(const DescriptorMatrix& a, const DescriptorMatrix& b) {
  MostSimilar similar(static_cast<std::size_t>(a.rows()));
  for (Eigen::Index i = 0; i < a.rows(); ++i) {
    for (Eigen::Index k = 0; k < b.rows(); ++k) {
      const auto product = a.row(i).cast<std::int32_t>().dot(b.row(k).cast<std::int32_t>());
      similar.Take(static_cast<std::size_t>(i), product, static_cast<std::int32_t>(k));
    }
  }
  return similar;
}

DescriptorMatrix RandomDescriptors(std::size_t size, std::mt19937* random) {
  std::normal_distribution<float> normal;
  DescriptorMatrix descriptors(static_cast<Eigen::Index>(size), kSiftSize);
  for (Eigen::Index i = 0; i < descriptors.rows(); ++i) {
    SiftVector values;
    for (float& value : values) value = std::abs(normal(*random));
    descriptors.row(i) = ToDescriptor(values.normalized());
  }
  return descriptors;
}

void ExpectSame(const MostSimilar& found, const MostSimilar& expected) {
  ASSERT_GE(found.best.size(), expected.best.size());
  for (std::size_t i = 0; i < expected.best.size(); ++i) {
    EXPECT_EQ(found.best[i], expected.best[i]) << i;
    EXPECT_EQ(found.second[i], expected.second[i]) << i;
    EXPECT_EQ(found.index[i], expected.index[i]) << i;
  }
}

// Sizes that are no multiples of the features taken at once; only the first ones are looked at.
TEST(DescriptorProducts, AreThoseOfOneAfterTheOther) {
  std::mt19937 random(3);
  for (const auto& [num_a, num_b] : std::vector<std::pair<std::size_t, std::size_t>>{
           {1, 1}, {2, 40}, {7, 16}, {16, 7}, {33, 50}, {64, 65}}) {
    SCOPED_TRACE(std::to_string(num_a) + " x " + std::to_string(num_b));
    const DescriptorMatrix a = RandomDescriptors(num_a + 3, &random);
    const DescriptorMatrix b = RandomDescriptors(num_b + 3, &random);
    const DescriptorMatrix first_a = a.topRows(static_cast<Eigen::Index>(num_a));
    const DescriptorMatrix first_b = b.topRows(static_cast<Eigen::Index>(num_b));
    for (const bool may_use_avx2 : {true, false}) {
      const SimilarFeatures found = FindMostSimilar(a, num_a, b, num_b, may_use_avx2);
      ExpectSame(found.of_a, MostSimilarOf(first_a, first_b));
      ExpectSame(found.of_b, MostSimilarOf(first_b, first_a));
    }
  }
}

// A descriptor with itself is 1, and cosines are exact to 1e-4.
TEST(DescriptorProducts, AreCosines) {
  std::mt19937 random(4);
  std::normal_distribution<float> normal;
  for (int i = 0; i < 100; ++i) {
    SiftVector a;
    SiftVector b;
    for (float& value : a) value = std::abs(normal(random));
    for (float& value : b) value = std::abs(normal(random));
    a.normalize();
    b.normalize();
    DescriptorMatrix rows(2, kSiftSize);
    rows << ToDescriptor(a), ToDescriptor(b);
    EXPECT_NEAR(DescriptorProduct(rows, 0, rows, 0) / kProductOfUnit, 1, 1e-4);
    EXPECT_NEAR(DescriptorProduct(rows, 0, rows, 1) / kProductOfUnit, a.dot(b), 1e-4);
  }
}

TEST(PhotoMatching, TellsTwinsByTheirEpipolarLines) {
  const std::vector<PhotoFeatures> photos = PhotosOfTwins();
  const std::vector<FeatureMatch> alike =
      MatchPhotoFeatures(photos[0], photos[1], photos[0].size());
  EXPECT_GE(alike.size(), kNumSingle - 5);
  EXPECT_LE(NumOfTwins(alike), kNumTwins / 4);
  std::vector<PhotoPair> pairs = MatchPhotos(photos, {});
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_LE(NumOfTwins(pairs[0].matches), kNumTwins / 4);
  pairs = MatchAlongEpipolarLines(photos, std::move(pairs), {});
  ASSERT_EQ(pairs.size(), 1U);
  EXPECT_GE(pairs[0].matches.size(), kNumSingle - 5);
  EXPECT_GE(NumOfTwins(pairs[0].matches), kNumTwins * 3 / 4);
  const auto num_wrong = std::ranges::count_if(pairs[0].matches, [](const FeatureMatch& match) {
    return match.feature_a != match.feature_b;
  });
  EXPECT_LE(num_wrong, 2);
}

}  // namespace
}  // namespace mono3d::tracking
