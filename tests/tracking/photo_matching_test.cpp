// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/photos/photo_matching.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"

namespace mono3d::tracking {
namespace {

using SiftVector = Eigen::Matrix<float, 1, 128>;

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
  for (PhotoFeatures& photo : photos) photo.descriptors.resize(kNumSingle + kNumTwins, 128);
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
          (of_structure[i] + 0.1F * descriptor()).normalized();
    }
  }
  return photos;
}

// Matches of structures that are there twice.
std::size_t NumOfTwins(const std::vector<FeatureMatch>& matches) {
  return static_cast<std::size_t>(std::ranges::count_if(
      matches, [](const FeatureMatch& match) { return match.feature_a >= kNumSingle; }));
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
