// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// A tracker that is saved and restored after each frame does, to the bit, what one does that is
// not: a member that were forgotten, or came back rounded, would show.

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <set>
#include <string>
#include <vector>

#include "core/state_sections.h"
#include "image/image_state.h"
#include "image/state_archive.h"
#include "mono3d/core/error.h"
#include "mono3d/tracking/tracker.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr const char* kStateWhere = "run.state";

// What happens to a tracker before the frame of that number.
using Events = std::function<void(Tracker&, std::size_t)>;

struct StateScene {
  std::vector<Frame> frames;
  TrackerOptions options = {};
  Events events = [](Tracker&, std::size_t) {};
};

void WritePoses(StateWriter& writer, std::vector<FramePose> poses) {
  writer.List(poses, [&](FramePose& pose) {
    writer.Number(pose.frame_index);
    writer.Number(pose.timestamp_s);
    writer.Number(pose.keyframe_id);
    ExchangeState(writer, pose.T_kf_cam);
  });
}

void WriteKeyframes(StateWriter& writer, std::vector<Keyframe> keyframes) {
  writer.List(keyframes, [&](Keyframe& keyframe) { ExchangeState(writer, keyframe); });
}

void WriteTrajectory(StateWriter& writer, std::vector<TrajectoryEntry> entries) {
  writer.List(entries, [&](TrajectoryEntry& entry) {
    writer.Number(entry.frame_index);
    writer.Number(entry.timestamp_s);
    writer.Number(entry.map_id);
    ExchangeState(writer, entry.T_world_cam);
  });
}

void WriteSnapshot(StateWriter& writer, const KeyframePoses& poses) {
  std::uint64_t version = poses.version();
  writer.Number(version);
  for (KeyframePose pose : poses.poses()) ExchangeState(writer, pose);
}

// Everything that a call of Track returns and changes for others.
std::string StateBytesOf(TrackingResult result, const Tracker& tracker) {
  StateWriter writer("result", 1, SavedImages::kIncluded);
  auto status = static_cast<int>(result.status);
  auto loss = static_cast<int>(result.loss);
  for (int* number : {&status, &loss, &result.map_id, &result.num_inliers}) writer.Number(*number);
  writer.Number(result.is_pending);
  writer.Number(result.is_keyframe);
  writer.Text(result.reason);
  WritePoses(writer, result.pose ? std::vector{*result.pose} : std::vector<FramePose>());
  writer.Optional(result.T_world_cam, [&](Pose& pose) { ExchangeState(writer, pose); });
  writer.Number(result.reprojection_px);
  WritePoses(writer, result.recovered);
  WritePoses(writer, result.refined);
  WriteKeyframes(writer, result.finalised_keyframes);
  WriteSnapshot(writer, *tracker.Poses());
  return writer.TakeState();
}

// Everything that a tracker has at the end.
std::string BytesAtEnd(Tracker& tracker) {
  StateWriter writer("end", 1, SavedImages::kIncluded);
  tracker.WaitForMapping();
  WriteKeyframes(writer, tracker.Finish());
  WriteTrajectory(writer, tracker.Trajectory());
  WriteTrajectory(writer, tracker.KeyframeTrajectory());
  WriteSnapshot(writer, *tracker.Poses());
  for (PositionFit fit : tracker.PositionFits()) ExchangeState(writer, fit);
  std::string map = tracker.SaveMap();
  writer.Text(map);
  std::int64_t num_without = tracker.num_keyframes_without_image();
  writer.Number(num_without);
  SparseModel sparse = tracker.Sparse(0);
  for (SparsePoint& point : sparse.points) ExchangeElements(writer, point.p_world);
  return writer.TakeState() + tracker.SaveState(SavedImages::kByIndex);
}

ImageOfFrame ImagesOf(const StateScene& scene) {
  return [&scene](std::int64_t index) {
    for (const Frame& frame : scene.frames) {
      if (frame.index == index) return frame.bgr;
    }
    return cv::Mat();
  };
}

// None but those that the state says it needs.
ImageOfFrame NamedImagesOf(const StateScene& scene, const std::string& state) {
  return [images = ImagesOf(scene), named = FramesOfState(state, kStateWhere)](std::int64_t index) {
    return std::ranges::find(named, index) == named.end() ? cv::Mat() : images(index);
  };
}

void Damage(std::string& bytes, std::size_t place) {
  char& damaged = bytes[place % bytes.size()];
  damaged = static_cast<char>(damaged ^ 0x55);
}

struct StateRun {
  std::vector<TrackingResult> results;
  std::vector<std::string> bytes;
};

StateRun RunThrough(const StateScene& scene) {
  const std::unique_ptr<Tracker> tracker = CreateTracker(scene.options);
  StateRun run;
  for (std::size_t i = 0; i < scene.frames.size(); ++i) {
    scene.events(*tracker, i);
    run.results.push_back(tracker->Track(scene.frames[i]));
    run.bytes.push_back(StateBytesOf(run.results.back(), *tracker));
  }
  run.bytes.push_back(BytesAtEnd(*tracker));
  return run;
}

// After each `step` frames another tracker goes on, which has nothing but the state.
void ExpectTheSameInRelay(const StateScene& scene, const StateRun& whole, std::size_t step,
                          SavedImages images) {
  std::unique_ptr<Tracker> tracker = CreateTracker(scene.options);
  for (std::size_t i = 0; i < scene.frames.size(); ++i) {
    scene.events(*tracker, i);
    const std::string bytes = StateBytesOf(tracker->Track(scene.frames[i]), *tracker);
    ASSERT_TRUE(bytes == whole.bytes[i]) << "frame " << i;
    if (i % step != 0) continue;
    const std::string state = tracker->SaveState(images);
    std::unique_ptr<Tracker> next = CreateTracker(scene.options);
    ASSERT_NO_THROW(next->RestoreState(
        state, kStateWhere,
        images == SavedImages::kByIndex ? NamedImagesOf(scene, state) : ImageOfFrame()))
        << "frame " << i;
    ASSERT_TRUE(next->SaveState(images) == state) << "frame " << i;
    tracker = std::move(next);
  }
  EXPECT_TRUE(BytesAtEnd(*tracker) == whole.bytes.back());
}

// Rendered once for all tests.
const Sequence& StateFlight() {
  static const Sequence sequence = FlyOver(TexturedGround(false), 60);
  return sequence;
}

const Sequence& StateVillage() {
  static const Sequence sequence = FlyOver(TexturedGround(true), 24);
  return sequence;
}

StateScene StateFilm(const std::vector<cv::Mat>& images) {
  StateScene scene;
  for (const cv::Mat& image : images) {
    scene.frames.push_back(BlackFrame(static_cast<std::int64_t>(scene.frames.size())));
    scene.frames.back().bgr = image;
  }
  return scene;
}

std::vector<cv::Mat> FlightImages(std::size_t begin, std::size_t end) {
  std::vector<cv::Mat> images;
  for (std::size_t i = begin; i < end; ++i) images.push_back(StateFlight().frames[i].bgr);
  return images;
}

TEST(TrackerState, GoesOnAfterEachFrameOfAFlightAndItsStart) {
  StateScene scene;
  scene.frames = StateVillage().frames;
  const StateRun whole = RunThrough(scene);
  EXPECT_EQ(whole.results[0].status, TrackingStatus::kNotInitialised);
  EXPECT_EQ(whole.results.back().status, TrackingStatus::kTracking);
  ExpectTheSameInRelay(scene, whole, 1, SavedImages::kIncluded);
}

TEST(TrackerState, GoesOnInALossInANewMapAndWhereTwoMapsMeet) {
  std::vector<cv::Mat> images = FlightImages(0, 12);
  images.insert(images.end(), 12, BlackFrame(0).bgr);
  for (std::size_t i = 59; i > 8; i -= 3) images.push_back(StateFlight().frames[i].bgr);
  const StateScene scene = StateFilm(images);
  const StateRun whole = RunThrough(scene);
  std::set<int> maps;
  for (const TrackingResult& result : whole.results) {
    if (result.status == TrackingStatus::kTracking) maps.insert(result.map_id);
  }
  EXPECT_EQ(maps, (std::set<int>{0, 1}));
  EXPECT_EQ(whole.results.back().map_id, 0);  // joined
  EXPECT_EQ(whole.results[14].status, TrackingStatus::kLost);
  ExpectTheSameInRelay(scene, whole, 2, SavedImages::kByIndex);
}

TEST(TrackerState, GoesOnInATurnOnTheSpot) {
  std::vector<cv::Mat> images = FlightImages(0, 12);
  const TexturedGround ground(false);
  for (int i = 1; i <= 10; ++i) {
    const double yaw = 5.0 * i * std::numbers::pi / 180;
    images.push_back(ground.Render(
        SmallCamera(),
        StateFlight().T_world_cam[12] * Pose(RotationExp({0, yaw, 0}), Eigen::Vector3d::Zero())));
  }
  const StateScene scene = StateFilm(images);
  const StateRun whole = RunThrough(scene);
  // Not judged yet: keyframes come, and none is final.
  std::size_t num_keyframes = 0;
  for (std::size_t i = scene.frames.size() - 5; i < scene.frames.size(); ++i) {
    num_keyframes += whole.results[i].is_keyframe ? 1 : 0;
    EXPECT_TRUE(whole.results[i].finalised_keyframes.empty()) << i;
  }
  EXPECT_GT(num_keyframes, 2U);
  ExpectTheSameInRelay(scene, whole, 1, SavedImages::kIncluded);
}

TEST(TrackerState, GoesOnWithARollingShutter) {
  CameraModel sensor = SmallCamera();
  sensor.shutter = {0.03, false};
  StateScene scene;
  scene.frames = FlyUnsteadily(TexturedGround(true), sensor, 24).frames;
  const StateRun whole = RunThrough(scene);
  EXPECT_EQ(whole.results.back().status, TrackingStatus::kTracking);
  ExpectTheSameInRelay(scene, whole, 2, SavedImages::kIncluded);
}

// By the keyframes as they are then, in each of the two runs.
void TellOfAConstraint(Tracker& tracker) {
  const KeyframePosesPtr poses = tracker.Poses();
  ASSERT_GE(poses->poses().size(), 4U);
  const KeyframePose& first = poses->poses().front();
  const KeyframePose& later = poses->poses()[3];
  KeyframeConstraint constraint;
  constraint.id = later.keyframe_id;
  constraint.anchor_id = first.keyframe_id;
  constraint.T_cam_anchor = Pose(RotationExp({0.0006, -0.0003, 0.0009}), {0.0012, 0.0006, 0}) *
                            later.T_world_cam().Inverse() * first.T_world_cam();
  constraint.information.setIdentity();
  constraint.information *= 1e9;
  tracker.Constrain(std::vector<KeyframeConstraint>{constraint});
}

void TellOfPositions(Tracker& tracker) {
  CameraPositions positions;
  positions.S_metric_map = {10, Pose()};
  for (const TrajectoryEntry& entry : tracker.Trajectory()) {
    CameraPosition position;
    position.time_s = entry.timestamp_s;
    // Off by some centimetres of a flight of several metres, each by its own.
    const auto number = static_cast<double>(entry.frame_index);
    position.p_m = positions.S_metric_map * entry.T_world_cam.translation() +
                   0.03 * Eigen::Vector3d(std::sin(number), std::cos(3 * number), 0.1 * number);
    positions.positions.push_back(position);
  }
  positions.typical_horizontal_m = 0.05;
  positions.typical_vertical_m = 0.05;
  tracker.FollowPositions(positions);
}

TEST(TrackerState, GoesOnWithConstraintsAndPositions) {
  StateScene scene;
  scene.frames = StateVillage().frames;
  scene.events = [](Tracker& tracker, std::size_t frame) {
    if (frame == 16) TellOfAConstraint(tracker);
    if (frame == 18) TellOfPositions(tracker);
  };
  const StateRun whole = RunThrough(scene);
  StateScene alone = scene;
  alone.events = [](Tracker&, std::size_t) {};
  EXPECT_FALSE(RunThrough(alone).bytes.back() == whole.bytes.back());
  ExpectTheSameInRelay(scene, whole, 1, SavedImages::kIncluded);
}

TEST(TrackerState, HasTheLargeImagesOfASmallerTrack) {
  StateScene scene;
  scene.frames.assign(StateVillage().frames.begin(), StateVillage().frames.begin() + 14);
  for (Frame& frame : scene.frames) {
    frame.camera = frame.camera.Resized(2 * frame.camera.width, 2 * frame.camera.height);
    cv::Mat large;
    cv::resize(frame.bgr, large, cv::Size(frame.camera.width, frame.camera.height), 0, 0,
               cv::INTER_CUBIC);
    frame.bgr = large;
  }
  scene.options.max_side_px = SmallCamera().width;
  const StateRun whole = RunThrough(scene);
  ExpectTheSameInRelay(scene, whole, 3, SavedImages::kIncluded);
  ExpectTheSameInRelay(scene, whole, 3, SavedImages::kByIndex);
}

TEST(TrackerState, LiveGoesOnFromWhereItWas) {
  TrackerOptions options;
  options.mode = "live";
  std::unique_ptr<Tracker> tracker = CreateTracker(options);
  for (std::size_t i = 0; i < StateVillage().frames.size(); ++i) {
    static_cast<void>(tracker->Track(StateVillage().frames[i]));
    if (i % 4 != 3) continue;
    const std::string state = tracker->SaveState();
    tracker = CreateTracker(options);
    tracker->RestoreState(state, kStateWhere);
  }
  tracker->WaitForMapping();
  EXPECT_GE(tracker->Trajectory().size(), StateVillage().frames.size() - 2);
  for (const TrajectoryEntry& entry : tracker->Trajectory()) EXPECT_EQ(entry.map_id, 0);
}

// A tracker in the middle of the village, made once for all tests.
const std::string& StateBytes() {
  static const std::string bytes = [] {
    const std::unique_ptr<Tracker> tracker = CreateTracker();
    for (std::size_t i = 0; i < 10; ++i) {
      static_cast<void>(tracker->Track(StateVillage().frames[i]));
    }
    return tracker->SaveState(SavedImages::kByIndex);
  }();
  return bytes;
}

cv::Mat ImageOfVillage(std::int64_t index) {
  return StateVillage().frames.at(static_cast<std::size_t>(index)).bgr;
}

TEST(TrackerState, IsMadeOfSectionsMostOfWhichTheNextOneHasAsWell) {
  const std::unique_ptr<Tracker> tracker = CreateTracker();
  std::set<std::uint64_t> known;
  std::size_t num_new_bytes = 0;
  std::size_t num_bytes = 0;
  for (std::size_t i = 0; i < StateVillage().frames.size(); ++i) {
    static_cast<void>(tracker->Track(StateVillage().frames[i]));
    if (i + 2 < StateVillage().frames.size()) continue;
    const std::string state = tracker->SaveState(SavedImages::kByIndex);
    num_new_bytes = 0;
    num_bytes = 0;
    std::string joined;
    for (const StateSection& section : SectionsOf(state, "tracker state", kStateWhere)) {
      joined += section.bytes;
      num_bytes += section.bytes.size();
      if (known.insert(section.checksum).second) num_new_bytes += section.bytes.size();
    }
    EXPECT_TRUE(joined == state);
  }
  // Of a flight this short, which all images show; each image counts how often points are found.
  EXPECT_LT(num_new_bytes, num_bytes / 3 * 2);
}

TEST(TrackerState, IsRefusedWhenForeignOrDamaged) {
  const auto restore = [](std::string bytes) {
    return [bytes = std::move(bytes)] {
      CreateTracker()->RestoreState(bytes, kStateWhere, ImageOfVillage);
    };
  };
  EXPECT_NO_THROW(restore(StateBytes())());
  for (const std::string& foreign : {std::string(), std::string("ply\nformat ascii 1.0\n")}) {
    EXPECT_THAT(restore(foreign), ThrowsMessage<Error>(HasSubstr("not one of mono3d")));
  }
  for (std::size_t size = 1; size < StateBytes().size(); size += StateBytes().size() / 40) {
    EXPECT_THROW(restore(StateBytes().substr(0, size))(), Error) << size;
    std::string changed = StateBytes();
    changed[size] = static_cast<char>(changed[size] ^ 4);
    EXPECT_THROW(restore(changed)(), Error) << size;
  }
  EXPECT_THROW(restore(StateBytes() + "x")(), Error);
}

// A section that was changed with its checksum gets to where what it says is checked.
TEST(TrackerState, NeverLeadsOutOfTheMap) {
  const std::vector<StateSection> sections = SectionsOf(StateBytes(), "tracker state", kStateWhere);
  std::size_t num_refused = 0;
  std::size_t num_tried = 0;
  for (std::size_t changed = 2; changed < sections.size(); ++changed) {
    std::string bytes;
    for (std::size_t i = 0; i < sections.size(); ++i) {
      std::string content(sections[i].bytes.substr(2 * sizeof(std::uint64_t)));
      // Numbers lie at any place: each section is changed at another one.
      if (i == changed && !content.empty()) Damage(content, 37 * changed);
      bytes += ToSection(content);
    }
    ++num_tried;
    const std::unique_ptr<Tracker> tracker = CreateTracker();
    try {
      tracker->RestoreState(bytes, kStateWhere, ImageOfVillage);
    } catch (const Error&) {
      ++num_refused;
    }
  }
  EXPECT_GT(num_tried, 20U);
  EXPECT_GT(num_refused, 0U);
}

TEST(TrackerState, NeedsANewTrackerOfTheSameOptionsAndTheImages) {
  const std::unique_ptr<Tracker> begun = CreateTracker();
  static_cast<void>(begun->Track(BlackFrame(0)));
  EXPECT_THAT([&] { begun->RestoreState(StateBytes(), kStateWhere, ImageOfVillage); },
              ThrowsMessage<UsageError>(HasSubstr("before the first frame")));
  TrackerOptions options;
  options.insertion.max_rotation_deg = 5;
  EXPECT_THAT(
      [&] { CreateTracker(options)->RestoreState(StateBytes(), kStateWhere, ImageOfVillage); },
      ThrowsMessage<UsageError>(HasSubstr("(expected tracking.insertion.max_rotation_deg 4, "
                                          "found tracking.insertion.max_rotation_deg 5)")));
  EXPECT_THAT([&] { CreateTracker()->RestoreState(StateBytes(), kStateWhere); },
              ThrowsMessage<UsageError>(HasSubstr("saved without its images")));
  EXPECT_THAT(
      [&] {
        CreateTracker()->RestoreState(StateBytes(), kStateWhere, [](auto) { return cv::Mat(); });
      },
      ThrowsMessage<Error>(HasSubstr("the image of a frame that it needs is not there")));
}

}  // namespace
}  // namespace mono3d::tracking
