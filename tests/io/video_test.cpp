// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <opencv2/core.hpp>
#include <opencv2/videoio.hpp>
#include <optional>
#include <string>
#include <vector>

#include "io/mp4_file.h"
#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/io/camera_metadata.h"
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

TEST_F(VideoTest, WithoutItsLastFrameSaysSo) {
  std::vector<std::string> messages;
  SetLogSink([&](LogLevel, std::string_view message) { messages.emplace_back(message); });
  EXPECT_EQ(ReadAll().size(), static_cast<std::size_t>(kNumFrames));
  EXPECT_EQ(ReadAll({.stride = 5}).size(), 3U);
  EXPECT_THAT(messages, testing::IsEmpty());

  std::ifstream file(path_, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), {});
  const std::size_t index = bytes.rfind("idx1");
  ASSERT_NE(index, std::string::npos);
  std::filesystem::resize_file(path_, bytes.rfind("00dc", index));
  EXPECT_EQ(ReadAll().size(), static_cast<std::size_t>(kNumFrames) - 1);
  SetLogSink({});
  EXPECT_THAT(messages, ElementsAre(HasSubstr("flight.avi: the video ends after 11 of 12 frames")));
}

// MPEG-4 in an MP4 file, whose index can be changed.
class Mp4Test : public TemporaryFolderTest {
 protected:
  Mp4Test() : path_(folder_ / "flight.mp4") {
    cv::VideoWriter writer(path_, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), kFps,
                           cv::Size(64, 48));
    for (int i = 0; i < kNumFrames; ++i) {
      writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(kFirst + kStep * i)));
    }
  }

  std::vector<double> Times(const FrameSourceOptions& options = {}) const {
    const auto source = OpenFrameSource(path_, VideoCamera(), options);
    std::vector<double> times_s;
    while (auto frame = source->Next()) times_s.push_back(frame->timestamp_s);
    return times_s;
  }

  // Of all frames, each later than the one before; what was said meanwhile goes to `messages`.
  std::vector<double> RisingTimes(std::vector<std::string>& messages) const {
    SetLogSink([&](LogLevel, std::string_view message) { messages.emplace_back(message); });
    std::vector<double> times_s = Times();
    SetLogSink({});
    EXPECT_EQ(times_s.size(), static_cast<std::size_t>(kNumFrames));
    for (std::size_t i = 1; i < times_s.size(); ++i) EXPECT_GT(times_s[i], times_s[i - 1]);
    return times_s;
  }

  std::filesystem::path path_;
};

TEST_F(Mp4Test, FramesOfAVariableRateHaveTheirOwnTimes) {
  const std::uint32_t total = TotalDuration(path_);
  const std::uint32_t unit = total / (2 * kNumFrames);
  std::vector<std::uint32_t> durations;
  std::vector<double> expected_s = {0};
  for (int i = 0; i < kNumFrames; ++i) {
    durations.push_back(i % 3 == 0 ? 4 * unit : unit);  // as often as 1/20 s in all
    expected_s.push_back(expected_s.back() + durations.back() * kNumFrames / kFps / total);
  }
  expected_s.pop_back();
  SetFrameDurations(path_, durations);
  EXPECT_THAT(Times(), testing::Pointwise(testing::DoubleNear(1e-3), expected_s));
  const std::vector<double> every_fourth = Times({.stride = 4, .start = 1});
  ASSERT_EQ(every_fourth.size(), 3U);
  EXPECT_NEAR(every_fourth[1], expected_s[5], 1e-3) << "frames are not counted but timed";
  EXPECT_THAT(Times({.fps = 10}), testing::Contains(0.7)) << "--fps stands";
}

TEST_F(Mp4Test, FramesWithoutTimesFollowAtTheMeanRateAndItIsSaid) {
  const std::uint32_t total = TotalDuration(path_);
  std::vector<std::uint32_t> durations(kNumFrames, total / (kNumFrames - 1));
  durations[4] = 0;  // frame 5 has the time of frame 4
  SetFrameDurations(path_, durations);
  std::vector<std::string> messages;
  const std::vector<double> times_s = RisingTimes(messages);
  ASSERT_EQ(times_s.size(), static_cast<std::size_t>(kNumFrames));
  EXPECT_NEAR(times_s[5] - times_s[4], 1 / kFps, 0.1 / kFps);
  EXPECT_THAT(messages, ElementsAre(testing::AllOf(HasSubstr("flight.mp4"), HasSubstr("frame 5"),
                                                   HasSubstr("--fps"))));
}

TEST_F(Mp4Test, FramesThatTheDecoderHeldAtTheEndNeedNoTimes) {
  const std::uint32_t total = TotalDuration(path_);
  std::vector<std::uint32_t> durations(kNumFrames, total / (kNumFrames - 2));
  durations[kNumFrames - 3] = durations[kNumFrames - 2] = 0;
  SetFrameDurations(path_, durations);
  std::vector<std::string> messages;
  RisingTimes(messages);
  EXPECT_THAT(messages, testing::IsEmpty());
}

TEST_F(Mp4Test, AVideoThatIsShownTurnedIsReadAsItIsStored) {
  EXPECT_EQ(ReadShownTurn(path_), 0);
  SetQuarterTurn(path_);
  EXPECT_EQ(ReadShownTurn(path_), 90);
  const auto frame = OpenFrameSource(path_, VideoCamera())->Next();
  ASSERT_TRUE(frame.has_value());
  EXPECT_EQ(frame->bgr.size(), cv::Size(64, 48)) << "as the sensor has it, and its calibration";
  EXPECT_EQ(ReadCameraPrior(path_).camera.width, 64);
  const CameraModel of_turned{48, 64, 60, 60, 23.5, 31.5, {}};
  EXPECT_THAT([&] { OpenFrameSource(path_, of_turned)->Next(); },
              ThrowsMessage<Error>(
                  testing::AllOf(HasSubstr("were turned"), HasSubstr("leave out --camera"))));
}

// The frames of flight.avi over and over, in MPEG-4.
void WriteLongVideo(const std::filesystem::path& path, int num_frames) {
  cv::VideoWriter writer(path, cv::CAP_FFMPEG, cv::VideoWriter::fourcc('m', 'p', '4', 'v'), kFps,
                         cv::Size(64, 48));
  for (int i = 0; i < num_frames; ++i) {
    writer.write(cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(kFirst + kStep * (i % kNumFrames))));
  }
}

// Of a constant rate, a part of a video that is entered is the same as one that is counted to.
TEST_F(VideoTest, AVideoIsEnteredAtTheFrameThatCountingTells) {
  constexpr int kNumInLong = 400;
  const std::filesystem::path path = folder_ / "long.mp4";
  WriteLongVideo(path, kNumInLong);
  const auto read = [&](bool seeks) {
    const auto source = OpenFrameSource(
        path, VideoCamera(), {.start = kNumInLong - 90, .seeks = seeks, .max_frames = 9});
    std::vector<Frame> frames;
    while (auto frame = source->Next()) frames.push_back(*frame);
    return frames;
  };
  const std::vector<Frame> counted = read(false);
  const std::vector<Frame> entered = read(true);
  ASSERT_EQ(counted.size(), 9U);
  ASSERT_EQ(entered.size(), 9U);
  for (std::size_t i = 0; i < entered.size(); ++i) {
    EXPECT_EQ(entered[i].index, counted[i].index);
    EXPECT_DOUBLE_EQ(entered[i].timestamp_s, counted[i].timestamp_s);
    EXPECT_EQ(cv::norm(entered[i].bgr, counted[i].bgr, cv::NORM_INF), 0);
  }
}

// A stream without an index.
TEST_F(VideoTest, PassesOverFramesWhereAVideoCannotBeEntered) {
  const std::filesystem::path path = folder_ / "long.m4v";
  WriteLongVideo(path, 300);
  const auto source =
      OpenFrameSource(path, VideoCamera(), {.start = 260, .seeks = true, .max_frames = 9});
  int num_frames = 0;
  while (const std::optional<Frame> frame = source->Next()) {
    EXPECT_EQ(frame->index, 260 + num_frames++);
  }
  EXPECT_EQ(num_frames, 9);
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
