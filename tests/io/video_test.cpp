// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <string>
#include <vector>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/frame_source.h"

namespace mono3d {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

constexpr int kNumFrames = 12;
constexpr double kFps = 20;
// The grey values of the frames are 16 apart, and JPEG keeps a constant image within one.
// None is 128: OpenCV's writer cuts the end of an image in which there is nothing to code.
constexpr int kFirst = 10;
constexpr int kStep = 16;
constexpr double kMaxGreyError = 2;

CameraModel VideoCamera() { return {64, 48, 60, 60, 31.5, 23.5, {}}; }

class VideoTest : public TemporaryFolderTest {
 protected:
  VideoTest() : path_(folder_ / "flight.avi") {
    cv::VideoWriter writer(path_, cv::CAP_OPENCV_MJPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'),
                           kFps, cv::Size(64, 48));
    for (int i = 0; i < kNumFrames; ++i) {
      writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(kFirst + kStep * i)));
    }
  }

  std::vector<Frame> ReadAll(const FrameSourceOptions& options = {}) const {
    const auto source = OpenFrameSource(path_, VideoCamera(), options);
    std::vector<Frame> frames;
    while (auto frame = source->Next()) frames.push_back(*frame);
    return frames;
  }

  std::filesystem::path path_;
};

TEST_F(VideoTest, GivesEveryFrameOnce) {
  const std::vector<Frame> frames = ReadAll();
  ASSERT_EQ(frames.size(), static_cast<std::size_t>(kNumFrames));
  for (int i = 0; i < kNumFrames; ++i) {
    const Frame& frame = frames[static_cast<std::size_t>(i)];
    EXPECT_NO_THROW(Validate(frame));
    EXPECT_EQ(frame.index, i);
    EXPECT_EQ(frame.name, "flight.avi#" + std::to_string(i));
    EXPECT_DOUBLE_EQ(frame.timestamp_s, i / kFps);
    EXPECT_NEAR(cv::mean(frame.bgr)[0], kFirst + kStep * i, kMaxGreyError);
  }
}

TEST_F(VideoTest, TakesStartStrideNumberAndRateIntoAccount) {
  const FrameSourceOptions options{.fps = 10, .stride = 4, .start = 2, .max_frames = 2};
  EXPECT_EQ(OpenFrameSource(path_, VideoCamera(), options)->num_frames(), 2);
  const std::vector<Frame> frames = ReadAll(options);
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames[1].index, 6);
  EXPECT_DOUBLE_EQ(frames[1].timestamp_s, 0.6);
  EXPECT_NEAR(cv::mean(frames[1].bgr)[0], kFirst + kStep * 6, kMaxGreyError);
  EXPECT_EQ(OpenFrameSource(path_, VideoCamera(), {.stride = 5})->num_frames(), 3);
  EXPECT_EQ(ReadAll({.stride = 5}).size(), 3U);
}

TEST_F(VideoTest, RefusesWhatIsNoVideo) {
  const auto path = WriteText("text.mp4", "not a video\n");
  EXPECT_THAT([&] { OpenFrameSource(path, VideoCamera()); },
              ThrowsMessage<Error>(HasSubstr("text.mp4: cannot open the video")));
}

TEST_F(VideoTest, RefusesAStartBehindItsEnd) {
  EXPECT_THAT([&] { ReadAll({.start = kNumFrames}); },
              ThrowsMessage<Error>(HasSubstr("no frame is left to read")));
}

}  // namespace
}  // namespace mono3d
