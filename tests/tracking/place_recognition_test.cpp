// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/tracking/place_recognition.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <opencv2/core.hpp>

#include "mono3d/core/error.h"
#include "tracking/places/relocaliser.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr std::size_t kNumFramesOfPlaces = 22;
constexpr std::size_t kNumFirst = 14;   // frames of the first map
constexpr std::size_t kSecondFrom = 6;  // first frame of the second one

const Sequence& PlacesVillage() {
  static const Sequence sequence = FlyOver(TexturedGround(true), kNumFramesOfPlaces);
  return sequence;
}

struct TrackedMap {
  std::string bytes;
  std::vector<TrajectoryEntry> trajectory;
};

TrackedMap TrackPart(std::size_t begin, std::size_t end) {
  const std::unique_ptr<Tracker> tracker = CreateTracker();
  for (std::size_t i = begin; i < end; ++i) {
    static_cast<void>(tracker->Track(PlacesVillage().frames[i]));
  }
  return {tracker->SaveMap(), tracker->Trajectory()};
}

// Each is tracked once for all tests.
const TrackedMap& First() {
  static const TrackedMap map = TrackPart(0, kNumFirst);
  return map;
}
const TrackedMap& Second() {
  static const TrackedMap map = TrackPart(kSecondFrom, kNumFramesOfPlaces);
  return map;
}

const Pose& PoseOf(const TrackedMap& map, std::int64_t frame_index) {
  return std::find_if(map.trajectory.begin(), map.trajectory.end(),
                      [&](const auto& entry) { return entry.frame_index == frame_index; })
      ->T_world_cam;
}

double Distance(const TrackedMap& map, std::int64_t a, std::int64_t b) {
  return (PoseOf(map, a).translation() - PoseOf(map, b).translation()).norm();
}

// Another place with the same kind of texture.
Frame Mirrored(const Frame& frame) {
  Frame mirrored = frame;
  cv::flip(frame.bgr, mirrored.bgr, 1);
  return mirrored;
}

// Of the median depth, which is about 1 su: a pixel here is 0.3 %, and the maps have their own
// errors.
constexpr double kTolerance_su = 0.005;

TEST(SavedPlaces, TellFromWhereAnImageWasTaken) {
  SavedPlaces places(First().bytes, "first");
  for (const std::size_t i : {2U, 7U, 11U}) {
    const PlaceRecognition found = places.Relocalise(PlacesVillage().frames[i]);
    ASSERT_TRUE(found.T_world_cam.has_value()) << i;
    const Pose& tracked = PoseOf(First(), static_cast<std::int64_t>(i));
    EXPECT_LT((found.T_world_cam->translation() - tracked.translation()).norm(), kTolerance_su);
    EXPECT_LT((found.T_world_cam->Inverse() * tracked).RotationAngle(), kTolerance_su);
    EXPECT_GE(found.num_inliers, 50);
    ASSERT_FALSE(found.candidates.empty());
    EXPECT_LE(std::abs(found.candidates[0].frame_index - static_cast<std::int64_t>(i)), 3);
    EXPECT_FALSE(found.scale.has_value());
  }
}

TEST(SavedPlaces, FindAKeyframeOfAnotherMapWithTheScaleBetweenThem) {
  SavedPlaces places(First().bytes, "first");
  const SavedPlaces other(Second().bytes, "second");
  // The first keyframes of the second map are where both have been.
  const TrajectoryEntry keyframe = other.Keyframes().front();
  ASSERT_LT(keyframe.frame_index, static_cast<std::int64_t>(kNumFirst));
  const Frame& frame = PlacesVillage().frames[static_cast<std::size_t>(keyframe.frame_index)];
  const PlaceRecognition found = places.Recognise(other, frame);
  ASSERT_TRUE(found.T_world_cam.has_value());
  const Pose& tracked = PoseOf(First(), keyframe.frame_index);
  EXPECT_LT((found.T_world_cam->translation() - tracked.translation()).norm(), kTolerance_su);
  const double scale = Distance(First(), 7, 13) / Distance(Second(), 7, 13);
  // Of 0.16 su between the two frames, 0.003: less than kTolerance_su of each position.
  constexpr double kTolerance = 0.02;
  EXPECT_NEAR(*found.scale, scale, kTolerance * scale);
}

TEST(SavedPlaces, KnowNothingOfAnotherPlace) {
  SavedPlaces places(First().bytes, "first");
  for (const std::size_t i : {0U, 10U, 20U}) {
    const PlaceRecognition found = places.Relocalise(Mirrored(PlacesVillage().frames[i]));
    EXPECT_FALSE(found.T_world_cam.has_value()) << i;
    EXPECT_EQ(found.num_inliers, 0);
  }
}

TEST(SavedPlaces, RefuseWhatIsNotOfTheirCameraOrMap) {
  SavedPlaces places(First().bytes, "first");
  Frame frame = PlacesVillage().frames[0];
  frame.camera.fx += 1;
  EXPECT_THAT([&] { static_cast<void>(places.Relocalise(frame)); },
              ThrowsMessage<Error>(HasSubstr("camera differs")));
  // The last frame is in no keyframe of the first map.
  EXPECT_THAT([&] { static_cast<void>(places.Recognise(places, PlacesVillage().frames.back())); },
              ThrowsMessage<Error>(HasSubstr("no keyframe of this image")));
  EXPECT_THAT([] { SavedPlaces("nonsense", "some.map"); },
              ThrowsMessage<Error>(HasSubstr("some.map")));
}

}  // namespace
}  // namespace mono3d::tracking
