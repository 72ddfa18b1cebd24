// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/photo_detection.h"

#include <gtest/gtest.h>

#include <cstddef>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"
#include "tracking/tracking_world.h"

namespace mono3d {
namespace {

class ImagesInMemory final : public FrameSource {
 public:
  ImagesInMemory(const std::vector<cv::Mat>& images, int start)
      : images_(images), next_(static_cast<std::size_t>(start)) {}
  std::optional<Frame> Next() override {
    if (next_ >= images_.size()) return std::nullopt;
    Frame frame;
    frame.bgr = images_[next_++];
    return frame;
  }
  std::optional<std::int64_t> num_frames() const override { return std::nullopt; }
  std::int64_t num_skipped() const override { return 0; }
  const CameraModel& camera() const override { return camera_; }

 private:
  const std::vector<cv::Mat>& images_;
  std::size_t next_;
  CameraModel camera_;
};

bool ArePhotos(const std::vector<cv::Mat>& images) {
  return mono3d::ArePhotos(static_cast<std::int64_t>(images.size()), [&](int start) {
    return std::make_unique<ImagesInMemory>(images, start);
  });
}

std::vector<cv::Mat> FilmHouses(int num_images) {
  std::vector<cv::Mat> images;
  for (Frame& frame : tracking::FlyOver(tracking::TexturedGround(true), num_images).frames) {
    images.push_back(std::move(frame.bgr));
  }
  return images;
}

TEST(PhotoDetection, AVideoGoesOnFromFrameToFrame) { EXPECT_FALSE(ArePhotos(FilmHouses(12))); }

// Three frames a second of the same flight, in another order.
TEST(PhotoDetection, PhotographsInAnyOrderDoNot) {
  const std::vector<cv::Mat> film = FilmHouses(40);
  std::vector<cv::Mat> photos;
  for (const std::size_t i : {20U, 0U, 32U, 8U, 36U, 12U, 28U, 4U, 24U, 39U}) {
    photos.push_back(film[i]);
  }
  EXPECT_TRUE(ArePhotos(photos));
}

TEST(PhotoDetection, WhatShowsNothingIsTakenForAVideo) {
  EXPECT_FALSE(ArePhotos(std::vector<cv::Mat>(12, tracking::BlackFrame(0).bgr)));
  EXPECT_FALSE(ArePhotos(FilmHouses(2)));
  EXPECT_FALSE(mono3d::ArePhotos(
      12, [](int) -> std::unique_ptr<FrameSource> { throw Error("cannot be read"); }));
}

}  // namespace
}  // namespace mono3d
