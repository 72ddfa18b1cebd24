// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/footage.h"

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

Footage JudgeFootage(const std::vector<cv::Mat>& images) {
  return mono3d::JudgeFootage(static_cast<std::int64_t>(images.size()), [&](int start) {
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

TEST(JudgeFootage, AVideoGoesOnFromFrameToFrame) {
  EXPECT_EQ(JudgeFootage(FilmHouses(12)), Footage::kVideo);
}

// A street of houses with equal windows, from which a camera that looks along it moves on: which
// window is which cannot be told, however little it has moved.
TEST(JudgeFootage, AVideoOfEqualWindowsIsOne) {
  cv::RNG random(7);
  cv::Mat street(240, 400, CV_8UC3, cv::Scalar::all(150));
  for (int row = 0; row < 7; ++row) {
    for (int column = 0; column < 15; ++column) {
      const cv::Rect window(8 + 26 * column, 12 + 32 * row, 14, 20);
      street(window).setTo(cv::Scalar(60, 40, 40));
      street(cv::Rect(window.x + 2, window.y + 2, 4, 16)).setTo(cv::Scalar(190, 170, 160));
      if (!random.uniform(0, 3)) random.fill(street(window), cv::RNG::UNIFORM, 0, 255);
    }
  }
  std::vector<cv::Mat> images;
  for (int i = 0; i < 12; ++i) images.push_back(street(cv::Rect(5 * i, 0, 320, 240)).clone());
  EXPECT_EQ(JudgeFootage(images), Footage::kVideo);
}

// Three frames a second of the same flight, in another order.
TEST(JudgeFootage, PhotographsInAnyOrderDoNot) {
  const std::vector<cv::Mat> film = FilmHouses(40);
  std::vector<cv::Mat> photos;
  for (const std::size_t i : {20U, 0U, 32U, 8U, 36U, 12U, 28U, 4U, 24U, 39U}) {
    photos.push_back(film[i]);
  }
  EXPECT_EQ(JudgeFootage(photos), Footage::kPhotographs);
}

// A frame and a half a second.
TEST(JudgeFootage, ASparseVideoSharesLittleFromFrameToFrame) {
  const std::vector<cv::Mat> film = FilmHouses(60);
  std::vector<cv::Mat> sparse;
  for (std::size_t i = 0; i < film.size(); i += 6) sparse.push_back(film[i]);
  EXPECT_EQ(JudgeFootage(sparse), Footage::kSparseVideo);
}

TEST(JudgeFootage, WhatShowsNothingIsTakenForAVideo) {
  EXPECT_EQ(JudgeFootage(std::vector<cv::Mat>(12, tracking::BlackFrame(0).bgr)), Footage::kVideo);
  EXPECT_EQ(JudgeFootage(FilmHouses(2)), Footage::kVideo);
  const auto cannot = [](int) -> std::unique_ptr<FrameSource> { throw Error("cannot be read"); };
  EXPECT_EQ(mono3d::JudgeFootage(12, cannot), Footage::kVideo);
}

}  // namespace
}  // namespace mono3d
