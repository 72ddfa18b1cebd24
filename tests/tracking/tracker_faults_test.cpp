// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// What goes wrong with real footage, on a rendered flight over flat ground: tracked, or recovered.

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <set>

#include "mono3d/geometry/similarity.h"
#include "mono3d/tracking/tracker.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

// Of the flying height of 10, as for the flights without faults over the same ground.
constexpr double kMaxErrorOfFaults = 0.01;
constexpr std::size_t kAt = 12;  // the frame at which faults begin: the map stands by then
constexpr std::size_t kNumFramesOfFaults = 24;

// Rendered once for all tests.
const Sequence& Flight() {
  static const Sequence sequence = FlyOver(TexturedGround(false), 60);
  return sequence;
}

// A film and where each of its frames was taken, nothing for those that show nothing.
struct Film {
  std::vector<cv::Mat> images;
  std::vector<std::optional<Pose>> T_world_cam;

  void Add(std::size_t frame) { Add(Flight().frames[frame].bgr, Flight().T_world_cam[frame]); }
  void Add(const cv::Mat& image, const std::optional<Pose>& T) {
    images.push_back(image);
    T_world_cam.push_back(T);
  }
  void AddFlight(std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) Add(i);
  }
  void AddBlack(int count) {
    for (int i = 0; i < count; ++i) Add(BlackFrame(0).bgr, std::nullopt);
  }
};

struct TrackOfFaults {
  std::vector<TrackingResult> results;
  std::vector<KeyframePosesPtr> poses;  // after each frame
  std::vector<TrajectoryEntry> trajectory;
  std::vector<Keyframe> keyframes;
};

TrackOfFaults TrackFilm(const Film& film) {
  const std::unique_ptr<Tracker> tracker = CreateTracker();
  TrackOfFaults run;
  for (std::size_t i = 0; i < film.images.size(); ++i) {
    Frame frame = BlackFrame(static_cast<std::int64_t>(i));
    frame.bgr = film.images[i];
    run.results.push_back(tracker->Track(frame));
    run.poses.push_back(tracker->Poses());
    const auto& finalised = run.results.back().finalised_keyframes;
    run.keyframes.insert(run.keyframes.end(), finalised.begin(), finalised.end());
  }
  run.trajectory = tracker->Trajectory();
  return run;
}

// All in one map, so many frames of it at least, and where they were.
void ExpectOneGoodMap(const TrackOfFaults& run, const Film& film, std::size_t min_frames) {
  EXPECT_GE(run.trajectory.size(), min_frames);
  std::vector<Eigen::Vector3d> found;
  std::vector<Eigen::Vector3d> truth;
  for (const TrajectoryEntry& entry : run.trajectory) {
    EXPECT_EQ(entry.map_id, 0);
    const auto& T_world_cam = film.T_world_cam[static_cast<std::size_t>(entry.frame_index)];
    ASSERT_TRUE(T_world_cam.has_value()) << "frame " << entry.frame_index << " shows nothing";
    found.push_back(entry.T_world_cam.translation());
    truth.push_back(T_world_cam->translation());
  }
  ASSERT_GE(found.size(), 3U);
  const Similarity fit = FitSimilarity(found, truth);
  double sum = 0;
  for (std::size_t i = 0; i < found.size(); ++i) sum += (fit * found[i] - truth[i]).squaredNorm();
  EXPECT_LT(std::sqrt(sum / static_cast<double>(found.size())) / 10, kMaxErrorOfFaults);
}

TEST(TrackerFaults, ThirtyBlackFrames) {
  Film film;
  film.AddFlight(0, kAt);
  film.AddBlack(30);
  film.AddFlight(kAt + 2, kNumFramesOfFaults);  // the camera has moved on
  const TrackOfFaults run = TrackFilm(film);
  // Within a tenth of a second of seeing known ground.
  EXPECT_EQ(run.results[kAt + 31].status, TrackingStatus::kTracking);
  ExpectOneGoodMap(run, film, kNumFramesOfFaults - 2);
}

TEST(TrackerFaults, ATenthOfTheFramesDropped) {
  Film film;
  for (std::size_t i = 0; i < kNumFramesOfFaults; ++i) {
    if (i % 10 != 4) film.Add(i);
  }
  ExpectOneGoodMap(TrackFilm(film), film, film.images.size());
}

TEST(TrackerFaults, ASwappedPair) {
  Film film;
  film.AddFlight(0, kAt);
  film.Add(kAt + 1);
  film.Add(kAt);
  film.AddFlight(kAt + 2, kNumFramesOfFaults);
  ExpectOneGoodMap(TrackFilm(film), film, kNumFramesOfFaults);
}

TEST(TrackerFaults, AFrozenSecond) {
  Film film;
  film.AddFlight(0, kAt);
  for (int i = 0; i < 10; ++i) film.Add(kAt);
  film.AddFlight(kAt + 1, kNumFramesOfFaults);
  ExpectOneGoodMap(TrackFilm(film), film, film.images.size());
}

TEST(TrackerFaults, AJumpOfTheExposure) {
  Film film;
  film.AddFlight(0, kAt);
  for (std::size_t i = kAt; i < kNumFramesOfFaults; ++i) {
    cv::Mat darker;
    Flight().frames[i].bgr.convertTo(darker, -1, 0.45, 10);
    film.Add(darker, Flight().T_world_cam[i]);
  }
  ExpectOneGoodMap(TrackFilm(film), film, kNumFramesOfFaults);
}

TEST(TrackerFaults, APureRotationOfThirtyDegreesAndBack) {
  const TexturedGround ground(false);
  constexpr int kSteps = 10;
  Film film;
  film.AddFlight(0, kAt);
  const Pose& T_at = Flight().T_world_cam[kAt];
  for (int i = 1; i < 2 * kSteps; ++i) {
    const int step = i <= kSteps ? i : 2 * kSteps - i;
    const double yaw = 30.0 * step / kSteps * std::numbers::pi / 180;
    const Pose turned = T_at * Pose(RotationExp({0, yaw, 0}), Eigen::Vector3d::Zero());
    film.Add(ground.Render(SmallCamera(), turned), turned);
  }
  film.AddFlight(kAt, kNumFramesOfFaults);
  const TrackOfFaults run = TrackFilm(film);
  // A point seen from one place has no depth: what comes into view by the rotation alone may be
  // lost, but not what was known.
  EXPECT_EQ(run.results.back().status, TrackingStatus::kTracking);
  ExpectOneGoodMap(run, film, kNumFramesOfFaults + kSteps);
}

TEST(TrackerFaults, MotionBlur) {
  Film film;
  film.AddFlight(0, kAt);
  for (std::size_t i = kAt; i < kAt + 3; ++i) {
    cv::Mat blurred;
    cv::blur(Flight().frames[i].bgr, blurred, cv::Size(11, 1));
    film.Add(blurred, Flight().T_world_cam[i]);
  }
  film.AddFlight(kAt + 3, kNumFramesOfFaults);
  const TrackOfFaults run = TrackFilm(film);
  EXPECT_EQ(run.results[kAt + 3].status, TrackingStatus::kTracking);
  ExpectOneGoodMap(run, film, kNumFramesOfFaults - 3);
}

TEST(TrackerFaults, TwoMapsBecomeOneWhenTheyMeet) {
  Film film;
  film.AddFlight(0, kAt);
  film.AddBlack(12);
  // Far away, then back to where the first map was made.
  for (std::size_t i = 59; i > kAt - 4; i -= 2) film.Add(i);
  const TrackOfFaults run = TrackFilm(film);
  std::set<int> maps_used;
  std::size_t joining = 0;  // the frame after which there is one map
  for (std::size_t i = 0; i < run.results.size(); ++i) {
    const TrackingResult& result = run.results[i];
    if (result.status == TrackingStatus::kTracking) maps_used.insert(result.map_id);
    if (i > 0 && !FindMapJoins(*run.poses[i - 1], *run.poses[i]).empty()) joining = i;
  }
  EXPECT_EQ(maps_used, (std::set<int>{0, 1}));
  ASSERT_GT(joining, 0U);
  EXPECT_EQ(run.results[joining].map_id, 0);
  // It is told of every keyframe handed out until then where it is now, of the second map too.
  const KeyframePoses& before = *run.poses[joining - 1];
  const KeyframePoses& after = *run.poses[joining];
  int num_of_second = 0;
  for (std::size_t i = 0; i < joining; ++i) {
    for (const Keyframe& keyframe : run.results[i].finalised_keyframes) {
      EXPECT_EQ(after.At(keyframe.id).map_id, 0);
      if (before.At(keyframe.id).map_id == 0) continue;
      ++num_of_second;
      EXPECT_EQ(before.At(keyframe.id).S_world_kf.scale(), 1);
      EXPECT_NE(after.At(keyframe.id).S_world_kf.scale(), 1);
    }
  }
  EXPECT_GT(num_of_second, 0);
  const MapJoin join = FindMapJoins(before, after).at(0);
  EXPECT_EQ(join.from, 1);
  EXPECT_EQ(join.into, 0);
  ExpectOneGoodMap(run, film, film.images.size() - 12);
}

}  // namespace
}  // namespace mono3d::tracking
