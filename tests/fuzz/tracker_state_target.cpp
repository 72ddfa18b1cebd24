// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <cmath>
#include <memory>
#include <opencv2/core.hpp>
#include <stdexcept>
#include <string>

#include "fuzz/edits.h"
#include "fuzz/fuzz_targets.h"
#include "fuzz/input_folder.h"
#include "mono3d/keyframes/keyframe_selector.h"
#include "mono3d/tracking/tracker.h"

namespace mono3d::fuzz {
namespace {

constexpr int kNumFrames = 24;
constexpr const char* kWhere = "input";

CameraModel SmallCamera() {
  return {.width = 320, .height = 240, .fx = 280, .fy = 280, .cx = 159.5, .cy = 119.5};
}

// A camera that flies sideways over ground with walls on it, all of it noise.
cv::Mat ImageOfGround(std::int64_t frame_index) {
  constexpr double kStep_su = 0.08, kGround_su = 4, kWall_su = 3, kCell_su = 0.2;
  const CameraModel camera = SmallCamera();
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
      double world_x = kStep_su * static_cast<double>(frame_index) + across * kWall_su;
      double depth = kWall_su;
      if (static_cast<int>(std::floor(world_x)) % 2 != 0) {
        depth = kGround_su;
        world_x = kStep_su * static_cast<double>(frame_index) + across * kGround_su;
      }
      const int column = static_cast<int>(std::floor(world_x / kCell_su)) & 255;
      const int row = static_cast<int>(std::floor(down * depth / kCell_su)) & 255;
      image.at<cv::Vec3b>(y, x) = texture.at<cv::Vec3b>(row, column);
    }
  }
  return image;
}

Frame FrameOfGround(std::int64_t index) {
  return {.index = index,
          .timestamp_s = 0.1 * static_cast<double>(index),
          .name = std::to_string(index),
          .bgr = ImageOfGround(index),
          .camera = SmallCamera()};
}

std::unique_ptr<Tracker> SmallTracker() {
  TrackerOptions options;
  options.features.num_features = 400;
  return CreateTracker(options);
}

// Of a run of a few keyframes.
struct SavedRun {
  std::string tracker;
  std::string selector;
};

SavedRun MakeSavedRun() {
  const std::unique_ptr<Tracker> tracker = SmallTracker();
  const std::unique_ptr<KeyframeSelector> selector = CreateKeyframeSelector({});
  for (std::int64_t i = 0; i < kNumFrames; ++i) {
    for (const Keyframe& keyframe : tracker->Track(FrameOfGround(i)).finalised_keyframes) {
      static_cast<void>(selector->Add(keyframe, *tracker->Poses()));
    }
  }
  constexpr std::size_t kFewestKeyframes = 3;
  if (tracker->Poses()->poses().size() < kFewestKeyframes) {
    throw std::logic_error("a run that has nothing to save");
  }
  return {tracker->SaveState(SavedImages::kByIndex), selector->SaveState(SavedImages::kByIndex)};
}

const SavedRun& Saved() {
  static const SavedRun saved = MakeSavedRun();
  return saved;
}

}  // namespace

// What is restored can be gone on with.
void TrackerState(std::string_view input) {
  const std::string state = EditedState(input, Saved().tracker);
  static_cast<void>(ReadOrRefuse([&] {
    const std::unique_ptr<Tracker> tracker = SmallTracker();
    tracker->RestoreState(state, kWhere, ImageOfGround);
    static_cast<void>(tracker->Track(FrameOfGround(kNumFrames)));
    static_cast<void>(tracker->Track(FrameOfGround(kNumFrames + 1)));
    static_cast<void>(tracker->Finish());
    return tracker->SaveState(SavedImages::kByIndex);
  }));
}

void SelectorState(std::string_view input) {
  const std::string state = EditedState(input, Saved().selector);
  static_cast<void>(ReadOrRefuse([&] {
    const std::unique_ptr<KeyframeSelector> selector = CreateKeyframeSelector({});
    selector->RestoreState(state, kWhere, ImageOfGround);
    static_cast<void>(selector->Finish({}));
    return selector->SaveState(SavedImages::kByIndex);
  }));
}

}  // namespace mono3d::fuzz
