// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "image/image_state.h"

#include <gmock/gmock.h>

#include <cstdint>
#include <functional>
#include <limits>
#include <opencv2/core.hpp>
#include <string>

#include "image/state_archive.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr const char* kKind = "part of a state";

// What is written is not checked: only who reads it does not know where it comes from.
template <typename T>
std::string RefusalOf(T value) {
  StateWriter writer(kKind, 1, SavedImages::kIncluded);
  ExchangeState(writer, value);
  const std::string state = writer.TakeState();
  try {
    StateReader reader(state, kKind, 1, "test", {});
    T read;
    ExchangeState(reader, read);
    reader.CheckEnd();
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

Frame SmallFrame() {
  return {.index = 3,
          .timestamp_s = 1.5,
          .name = "a.jpg",
          .bgr = cv::Mat(4, 6, CV_8UC3, cv::Scalar(1, 2, 3)),
          .camera = {6, 4, 5, 5, 2.5, 1.5, {}},
          .content = {1, 1, 5, 3}};
}

std::string RefusalOfFrame(const std::function<void(Frame&)>& change) {
  Frame with_image = SmallFrame();
  Frame without_image = SmallFrame();
  without_image.bgr.release();
  change(with_image);
  change(without_image);
  const std::string refusal = RefusalOf(with_image);
  EXPECT_EQ(refusal.empty(), RefusalOf(without_image).empty());
  return refusal;
}

TEST(ImageState, TakesAFrameAsItIs) {
  EXPECT_EQ(RefusalOfFrame([](Frame&) {}), "");
}

TEST(ImageState, RefusesFramesThatNoSourceHas) {
  constexpr int kMax = std::numeric_limits<int>::max();
  EXPECT_NE(RefusalOfFrame([](Frame& frame) { frame.index = -1; }), "");
  EXPECT_NE(RefusalOfFrame([](Frame& frame) { frame.index = std::int64_t{1} << 60; }), "");
  EXPECT_NE(RefusalOfFrame([](Frame& frame) { frame.timestamp_s = 1e31; }), "");
  EXPECT_NE(RefusalOfFrame([](Frame& frame) { frame.camera.fx = 1e31; }), "");
  // The sum with the first column is more than an int holds.
  EXPECT_NE(RefusalOfFrame([](Frame& frame) { frame.content.width = kMax; }), "");
  EXPECT_NE(RefusalOfFrame([](Frame& frame) { frame.content.height = 4; }), "");
  EXPECT_NE(RefusalOfFrame([](Frame& frame) { frame.content.x = -1; }), "");
}

TEST(ImageState, RefusesPosesBeyondWhatCanBeCalculatedWith) {
  const Eigen::Vector3d far(0, 1e31, 0);
  EXPECT_EQ(RefusalOf(Pose(Eigen::Quaterniond::Identity(), far * 1e-2)), "");
  EXPECT_NE(RefusalOf(Pose(Eigen::Quaterniond::Identity(), far)), "");
  EXPECT_EQ(RefusalOf(Similarity(1e-29, Pose())), "");
  EXPECT_NE(RefusalOf(Similarity(1e-31, Pose())), "");
  EXPECT_NE(RefusalOf(Similarity(1e31, Pose())), "");
}

TEST(ImageState, RefusesKeyframesWithFewerPixelsThanDepths) {
  Keyframe keyframe;
  keyframe.frame = SmallFrame();
  keyframe.sparse_depths_su = {1, 2};
  EXPECT_EQ(RefusalOf(keyframe), "");
  keyframe.sparse_pixels = {{1, 1}, {2, 2}};
  EXPECT_EQ(RefusalOf(keyframe), "");
  keyframe.sparse_pixels.pop_back();
  EXPECT_NE(RefusalOf(keyframe), "");
}

TEST(ImageState, RefusesKeyframesWithoutNoise) {
  Keyframe keyframe;
  keyframe.frame = SmallFrame();
  keyframe.patch_noise = 2;
  EXPECT_EQ(RefusalOf(keyframe), "");
  keyframe.patch_noise = 0.5;
  EXPECT_NE(RefusalOf(keyframe), "");
}

TEST(ImageState, RefusesPositionsWithNegativeErrors) {
  CameraPositions positions;
  EXPECT_EQ(RefusalOf(positions), "");
  positions.typical_horizontal_m = -1;
  EXPECT_NE(RefusalOf(positions), "");
}

}  // namespace
}  // namespace mono3d
