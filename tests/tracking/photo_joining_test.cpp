// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <numeric>
#include <random>
#include <vector>

#include "mono3d/geometry/similarity.h"
#include "tracking/photos/photo_mapping.h"

namespace mono3d::tracking {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr std::size_t kNumStreetPhotos = 8;  // the first and the last four see much of each other
constexpr std::size_t kLastOfLeft = 3;
constexpr std::size_t kFirstOfRight = 4;

// Photos of a street with fronts 8 to 12 su away; the two in the middle see much of each other that
// hardly another one sees.
class Street {
 public:
  // The last four stand `back_su` farther away, from where they see other fronts.
  explicit Street(double back_su = 0, unsigned seed = 5)
      : random_(seed), photos_(kNumStreetPhotos) {
    for (std::size_t i = 0; i < kNumStreetPhotos; ++i) {
      T_cam_world_.push_back(
          Pose(Eigen::Quaterniond::Identity(),
               Vector3d(-1.2 * static_cast<double>(i), 0, i < kFirstOfRight ? 0 : back_su)));
    }
    AddPoints(300, {0, 1, 2, 3}, -2);
    AddPoints(200, {4, 5, 6, 7}, 10, 10 - back_su);
  }

  // A new one for each of `count` points around x_su, z_su.
  void AddPoints(int count, const std::vector<std::size_t>& seen_by, double x_su,
                 double z_su = 10) {
    for (int i = 0; i < count; ++i) {
      AddPoint({x_su + 4 * uniform_(random_), 4 * uniform_(random_), z_su + 2 * uniform_(random_)},
               seen_by);
    }
  }

  // On a board that stands at an angle in front of the first photos.
  void AddPointsOfBoard(int count, const std::vector<std::size_t>& seen_by) {
    for (int i = 0; i < count; ++i) {
      const double along_su = 0.6 * uniform_(random_);
      AddPoint({4 + along_su, 0.6 * uniform_(random_), 10 + along_su}, seen_by);
    }
  }

  // The last `count` features of one photo with those of the other, anyhow.
  void MatchByChance(std::size_t a, std::size_t b, std::size_t count) {
    std::vector<std::size_t> other(count);
    std::iota(other.begin(), other.end(), photos_[b].size() - count);
    std::ranges::shuffle(other, random_);
    for (std::size_t i = 0; i < count; ++i) {
      PairOf(a, b).matches.push_back({photos_[a].size() - count + i, other[i]});
    }
  }

  PhotoMaps Map() const { return MapPhotos(photos_, pairs_, kCamera, {}); }

  // Largest distance of a photo from where it was, after the best similarity.
  double LargestError_su(const PhotoMap& map) const {
    std::vector<Vector3d> found;
    std::vector<Vector3d> truth;
    for (const PlacedPhoto& placed : map.photos) {
      found.push_back(placed.T_world_cam.translation());
      truth.push_back(T_cam_world_[placed.photo].Inverse().translation());
    }
    // On a line, a similarity turns about it freely: a point ahead of each photo holds it.
    for (const PlacedPhoto& placed : map.photos) {
      found.push_back(placed.T_world_cam * Vector3d(0, 0, Scale(found, truth)));
      truth.push_back(T_cam_world_[placed.photo].Inverse() * Vector3d(0, 0, 1));
    }
    const Similarity S = FitSimilarity(found, truth);
    double largest = 0;
    for (std::size_t i = 0; i < map.photos.size(); ++i) {
      largest = std::max(largest, (S * found[i] - truth[i]).norm());
    }
    return largest;
  }

 private:
  void AddPoint(const Vector3d& p_world, const std::vector<std::size_t>& seen_by) {
    std::vector<std::size_t> feature(kNumStreetPhotos);
    for (const std::size_t photo : seen_by) {
      PhotoFeatures& features = photos_[photo];
      feature[photo] = features.size();
      features.pixels.push_back(kCamera.Project(T_cam_world_[photo] * p_world) +
                                Vector2d(noise_px_(random_), noise_px_(random_)));
      features.sigma_px.push_back(0.5);
      features.colours.push_back({});
    }
    for (std::size_t a = 0; a < seen_by.size(); ++a) {
      for (std::size_t b = a + 1; b < seen_by.size(); ++b) {
        PairOf(seen_by[a], seen_by[b])
            .matches.push_back({feature[seen_by[a]], feature[seen_by[b]]});
      }
    }
  }

  static constexpr CameraModel kCamera{
      .width = 768, .height = 576, .fx = 320, .fy = 320, .cx = 383.5, .cy = 287.5};

  // Of a way in the map for one of the truth.
  static double Scale(const std::vector<Vector3d>& found, const std::vector<Vector3d>& truth) {
    return (found[1] - found[0]).norm() / (truth[1] - truth[0]).norm();
  }

  PhotoPair& PairOf(std::size_t a, std::size_t b) {
    const auto found = std::ranges::find_if(
        pairs_, [&](const PhotoPair& pair) { return pair.a == a && pair.b == b; });
    return found != pairs_.end() ? *found : pairs_.emplace_back(PhotoPair{a, b, {}});
  }

  std::mt19937 random_;
  std::uniform_real_distribution<double> uniform_{-1, 1};
  std::normal_distribution<double> noise_px_{0, 0.2};
  std::vector<Pose> T_cam_world_;
  std::vector<PhotoFeatures> photos_;
  std::vector<PhotoPair> pairs_;
};

// Too few points for a pose of any photo in the other map.
TEST(PhotoJoining, JoinsMapsByPointsThatBothHave) {
  Street street;
  street.AddPoints(8, {2, kLastOfLeft, kFirstOfRight, 5}, 4);
  street.AddPoints(8, {2, kLastOfLeft, kFirstOfRight}, 4);
  street.AddPoints(8, {kLastOfLeft, kFirstOfRight, 5}, 4);
  street.AddPoints(40, {kLastOfLeft, kFirstOfRight}, 4);
  const PhotoMaps maps = street.Map();
  ASSERT_EQ(maps.maps.size(), 1U);
  EXPECT_EQ(maps.maps[0].photos.size(), kNumStreetPhotos);
  EXPECT_LT(street.LargestError_su(maps.maps[0]), 0.05);
}

// As where the camera turns: one photo of a map sees what the other one has, which the others do
// not, but for three points.
TEST(PhotoJoining, JoinsMapsByOnePhotoWithAPoseInBoth) {
  Street street;
  street.AddPoints(60, {kLastOfLeft, kFirstOfRight, 5, 6}, 6);
  street.AddPoints(3, {1, 2, kLastOfLeft, kFirstOfRight, 5}, 4);
  const PhotoMaps maps = street.Map();
  ASSERT_EQ(maps.maps.size(), 1U);
  EXPECT_EQ(maps.maps[0].photos.size(), kNumStreetPhotos);
  EXPECT_LT(street.LargestError_su(maps.maps[0]), 0.15);
}

TEST(PhotoJoining, LeavesMapsApartWhereNothingTellsTheScale) {
  Street street;
  street.AddPoints(60, {kLastOfLeft, kFirstOfRight, 5, 6}, 6);
  const PhotoMaps maps = street.Map();
  ASSERT_EQ(maps.maps.size(), 2U);
  EXPECT_EQ(maps.maps[0].photos.size() + maps.maps[1].photos.size(), kNumStreetPhotos);
}

TEST(PhotoJoining, LeavesMapsApartThatMatchByChance) {
  Street street;
  // The same features in both, at places that do not go together.
  street.AddPoints(60, {kLastOfLeft, 2}, 0);
  street.AddPoints(60, {kFirstOfRight, 5}, 9);
  street.MatchByChance(kLastOfLeft, kFirstOfRight, 60);
  const PhotoMaps maps = street.Map();
  ASSERT_EQ(maps.maps.size(), 2U);
}

// From so far the board looks nearly alike from two sides.
TEST(PhotoJoining, LeavesMapsApartWhereABoardFarAwayLeavesTwoWaysOpen) {
  constexpr double kBack_su = 60;
  int num_joined = 0;
  for (unsigned seed = 1; seed <= 8; ++seed) {
    Street street(kBack_su, seed);
    street.AddPointsOfBoard(60, {0, 1, 2, kLastOfLeft, kFirstOfRight});
    street.AddPointsOfBoard(30, {0, 1, 2, kLastOfLeft, kFirstOfRight, 7});
    const PhotoMaps maps = street.Map();
    if (maps.maps.size() > 1) continue;
    ++num_joined;
    EXPECT_LT(street.LargestError_su(maps.maps[0]), 0.2 * kBack_su) << seed;
  }
  EXPECT_LT(num_joined, 4);
}

}  // namespace
}  // namespace mono3d::tracking
