// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <cmath>
#include <cstddef>
#include <memory>
#include <opencv2/core.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <vector>

#include "fuzz/edits.h"
#include "fuzz/fuzz_targets.h"
#include "fuzz/input_folder.h"
#include "mono3d/keyframes/keyframe_selector.h"
#include "mono3d/tracking/tracker.h"

namespace mono3d::fuzz {
namespace {

// As small as a scene can be that a track starts in: what is restored is gone on with, and that is
// what an input costs.
constexpr int kWidth = 160, kHeight = 120;
constexpr int kNumFeatures = 150;
constexpr int kNumInFlight = 14;
constexpr int kNumFrames = kNumInFlight + 2;  // tracked at most
constexpr double kFrame_s = 0.1;
constexpr const char* kWhere = "input";

// What the saved run is like where the state is taken. The first byte of an input chooses.
enum class Moment {
  kFlight,          // with positions, which the map follows
  kStart,           // two views too close together, frames that wait for a pose
  kLoss,            // the last frames show something else
  kRollingShutter,  // velocities, the frame before the last one
  kCount,
};

CameraModel CameraAt(Moment moment) {
  CameraModel camera{.width = kWidth,
                     .height = kHeight,
                     .fx = 140,
                     .fy = 140,
                     .cx = (kWidth - 1) / 2.0,
                     .cy = (kHeight - 1) / 2.0};
  if (moment == Moment::kRollingShutter) camera.shutter.readout_s = 0.02;
  return camera;
}

// A camera that flies sideways over ground with walls on it, all of it noise.
cv::Mat RenderGround(int frame_index) {
  constexpr double kStep_su = 0.08, kGround_su = 4, kWall_su = 3, kCell_su = 0.2;
  const CameraModel camera = CameraAt(Moment::kFlight);
  static const cv::Mat texture = [] {
    cv::Mat noise(256, 256, CV_8UC3);
    cv::RNG random(1);
    random.fill(noise, cv::RNG::UNIFORM, 0, 255);
    return noise;
  }();
  cv::Mat image(camera.height, camera.width, CV_8UC3);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const double across = (x - camera.cx) / camera.fx, down = (y - camera.cy) / camera.fy;
      double world_x = kStep_su * frame_index + across * kWall_su;
      double depth = kWall_su;
      if (static_cast<int>(std::floor(world_x)) % 2 != 0) {
        depth = kGround_su;
        world_x = kStep_su * frame_index + across * kGround_su;
      }
      const int column = static_cast<int>(std::floor(world_x / kCell_su)) & 255;
      const int row = static_cast<int>(std::floor(down * depth / kCell_su)) & 255;
      image.at<cv::Vec3b>(y, x) = texture.at<cv::Vec3b>(row, column);
    }
  }
  return image;
}

// None where there is no such frame, as in a run.
cv::Mat ImageAt(Moment moment, std::int64_t index) {
  static const std::vector<cv::Mat> images = [] {
    std::vector<cv::Mat> rendered;
    for (int i = 0; i < kNumFrames; ++i) rendered.push_back(RenderGround(i));
    return rendered;
  }();
  if (index < 0 || index >= kNumFrames) return {};
  const cv::Mat& image = images[static_cast<std::size_t>(index)];
  constexpr int kNumLost = 2;
  if (moment != Moment::kLoss || index < kNumInFlight - kNumLost || index >= kNumInFlight) {
    return image;
  }
  cv::Mat mirrored;
  cv::flip(image, mirrored, 0);
  return mirrored;
}

Frame FrameOfGround(Moment moment, std::int64_t index) {
  Frame frame{.index = index,
              .timestamp_s = kFrame_s * static_cast<double>(index),
              .name = std::to_string(index),
              .bgr = ImageAt(moment, index),
              .camera = CameraAt(moment)};
  if (moment == Moment::kRollingShutter) {
    frame.sensor = frame.camera;
    frame.camera.shutter = {};
  }
  return frame;
}

std::unique_ptr<Tracker> SmallTracker() {
  TrackerOptions options;
  options.features.num_features = kNumFeatures;
  options.initialisation.min_matches = 40;
  options.min_inliers = 15;
  return CreateTracker(options);
}

// Along the flight, a metre and a half per unit.
CameraPositions PositionsOfFlight() {
  constexpr double kSpeed_m_per_s = 1.2;
  CameraPositions positions;
  positions.typical_horizontal_m = 0.1;
  positions.typical_vertical_m = 0.1;
  constexpr int kStep = 4;  // the fit takes most of the time of an input
  for (int i = 0; i < kNumFrames; i += kStep) {
    const double time_s = kFrame_s * i;
    positions.positions.push_back({.time_s = time_s, .p_m = {kSpeed_m_per_s * time_s, 0, 0}});
  }
  return positions;
}

// Of a run of a few keyframes.
struct SavedRun {
  int num_frames = 0;
  std::string tracker;
  std::string selector;
  // What comes after it.
  std::vector<Keyframe> keyframes;
  KeyframePosesPtr poses;
};

SavedRun MakeSavedRun(Moment moment) {
  const std::unique_ptr<Tracker> tracker = SmallTracker();
  const std::unique_ptr<KeyframeSelector> selector = CreateKeyframeSelector({});
  SavedRun saved;
  saved.num_frames = moment == Moment::kStart ? 2 : kNumInFlight;
  for (int i = 0; i < saved.num_frames; ++i) {
    const TrackingResult result = tracker->Track(FrameOfGround(moment, i));
    for (const Keyframe& keyframe : result.finalised_keyframes) {
      static_cast<void>(selector->Add(keyframe, *tracker->Poses()));
    }
  }
  const std::span<const KeyframePose> poses = tracker->Poses()->poses();
  constexpr std::size_t kFewestKeyframes = 3;
  if (moment != Moment::kStart && poses.size() < kFewestKeyframes) {
    throw std::logic_error("a run that has nothing to save");
  }
  if (moment == Moment::kFlight) {
    tracker->FollowPositions(PositionsOfFlight());
    const KeyframePose& first = poses.front();
    const KeyframePose& last = poses.back();
    const KeyframeConstraint constraint{
        .id = last.keyframe_id,
        .anchor_id = first.keyframe_id,
        .T_cam_anchor = last.T_world_cam().Inverse() * first.T_world_cam(),
        .information = 100 * Eigen::Matrix<double, 7, 7>::Identity()};
    tracker->Constrain({&constraint, 1});
  }
  saved.tracker = tracker->SaveState(SavedImages::kByIndex);
  saved.selector = selector->SaveState(SavedImages::kByIndex);
  saved.keyframes = tracker->Finish();
  saved.poses = tracker->Poses();
  return saved;
}

const SavedRun& Saved(Moment moment) {
  static const std::vector<SavedRun> runs = [] {
    std::vector<SavedRun> made;
    for (int i = 0; i < static_cast<int>(Moment::kCount); ++i) {
      made.push_back(MakeSavedRun(static_cast<Moment>(i)));
    }
    return made;
  }();
  return runs[static_cast<std::size_t>(moment)];
}

Moment TakeMoment(std::string_view& input) {
  if (input.empty()) return Moment::kFlight;
  const auto number = static_cast<unsigned char>(input.front());
  input.remove_prefix(1);
  return static_cast<Moment>(number % static_cast<int>(Moment::kCount));
}

}  // namespace

// What is restored can be gone on with.
void TrackerState(std::string_view input) {
  const Moment moment = TakeMoment(input);
  const SavedRun& saved = Saved(moment);
  const std::string state = EditedState(input, saved.tracker);
  static_cast<void>(ReadOrRefuse([&] {
    const std::unique_ptr<Tracker> tracker = SmallTracker();
    tracker->RestoreState(state, kWhere,
                          [&](std::int64_t index) { return ImageAt(moment, index); });
    for (int i = saved.num_frames; i < saved.num_frames + 2; ++i) {
      static_cast<void>(tracker->Track(FrameOfGround(moment, i)));
    }
    tracker->WaitForMapping();
    static_cast<void>(tracker->Finish());
    return tracker->SaveState(SavedImages::kByIndex);
  }));
}

void SelectorState(std::string_view input) {
  constexpr Moment kMoment = Moment::kFlight;
  const SavedRun& saved = Saved(kMoment);
  const std::string state = EditedState(input, saved.selector);
  static_cast<void>(ReadOrRefuse([&] {
    const std::unique_ptr<KeyframeSelector> selector = CreateKeyframeSelector({});
    selector->RestoreState(state, kWhere,
                           [](std::int64_t index) { return ImageAt(kMoment, index); });
    for (const Keyframe& keyframe : saved.keyframes) {
      static_cast<void>(selector->Add(keyframe, *saved.poses));
    }
    selector->ReportDepthQuality({saved.poses->poses().front().keyframe_id, 0.5, 0.5});
    static_cast<void>(selector->Findings());
    std::string restored = selector->SaveState(SavedImages::kByIndex);
    static_cast<void>(selector->Finish(*saved.poses));
    return restored;
  }));
}

}  // namespace mono3d::fuzz
