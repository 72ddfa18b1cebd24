// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Videos of mono3d-simulate: what the encoder was asked for, and what comes out of it.

extern "C" {
#include <libavcodec/avcodec.h>
#include <libavformat/avformat.h>
}

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/io/camera_file.h"
#include "simulate/exposure_log.h"
#include "simulate/video_file.h"
#include "tools/command.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::UnorderedElementsAre;
namespace fs = std::filesystem;

class SimulateVideo : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("mono3d_video_") + test->name());
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  CommandResult Simulate(const std::string& arguments) const {
    return RunCommand(std::string(MONO3D_SIMULATE_TOOL) + " " + arguments, folder_);
  }

  fs::path folder_;
};

constexpr double kFps = 10;
constexpr int kNumImages = 120;

// Windows that move by three pixels from image to image over a texture of many sizes, with noise
// that no encoder can predict. Grey: colours at half the resolution would limit what a high bit
// rate can do.
const std::vector<cv::Mat>& Film() {
  static const std::vector<cv::Mat> film = [] {
    cv::RNG random(7);
    cv::Mat texture = cv::Mat::zeros(440, 700, CV_32FC1);
    for (const int cell : {4, 16, 64}) {
      cv::Mat noise(440 / cell + 1, 700 / cell + 1, CV_32FC1);
      random.fill(noise, cv::RNG::UNIFORM, 0, 255.0 / 3);
      cv::resize(noise, noise, texture.size(), 0, 0, cv::INTER_CUBIC);
      texture += noise;
    }
    std::vector<cv::Mat> images;
    for (int i = 0; i < kNumImages; ++i) {
      cv::Mat noise(192, 320, CV_32FC1);
      random.fill(noise, cv::RNG::NORMAL, 0, 4);
      cv::Mat image;
      cv::Mat(texture(cv::Rect(3 * i, 2 * i, 320, 192)) + noise).convertTo(image, CV_8UC1);
      cv::cvtColor(image, image, cv::COLOR_GRAY2BGR);
      images.push_back(image);
    }
    return images;
  }();
  return film;
}

// Returns the bits of all images.
std::int64_t Write(const fs::path& path, const synthetic::VideoOptions& options) {
  tools::VideoFile video(path, {.size = {320, 192}, .frames_per_s = kFps, .options = options});
  for (const cv::Mat& image : Film()) video.Add(image);
  return video.Finish();
}

// What each frame was coded as: 'I', 'P' or 'B'.
std::string FrameTypes(const fs::path& path) {
  AVFormatContext* file = nullptr;
  EXPECT_EQ(avformat_open_input(&file, path.c_str(), nullptr, nullptr), 0);
  EXPECT_GE(avformat_find_stream_info(file, nullptr), 0);
  const AVCodecParameters* parameters = file->streams[0]->codecpar;
  const AVCodec* codec = avcodec_find_decoder(parameters->codec_id);
  AVCodecContext* decoder = avcodec_alloc_context3(codec);
  avcodec_parameters_to_context(decoder, parameters);
  EXPECT_EQ(avcodec_open2(decoder, codec, nullptr), 0);
  AVPacket* packet = av_packet_alloc();
  AVFrame* frame = av_frame_alloc();
  std::string types;
  const auto decode = [&](const AVPacket* data) {
    EXPECT_EQ(avcodec_send_packet(decoder, data), 0);
    while (avcodec_receive_frame(decoder, frame) == 0) {
      types += av_get_picture_type_char(frame->pict_type);
    }
  };
  for (; av_read_frame(file, packet) == 0; av_packet_unref(packet)) decode(packet);
  decode(nullptr);
  av_frame_free(&frame);
  av_packet_free(&packet);
  avcodec_free_context(&decoder);
  avformat_close_input(&file);
  return types;
}

double Psnr(const fs::path& path) {
  cv::VideoCapture capture(path.string(), cv::CAP_FFMPEG);
  double square = 0;
  for (const cv::Mat& image : Film()) {
    cv::Mat decoded;
    EXPECT_TRUE(capture.read(decoded));
    square += cv::norm(decoded, image, cv::NORM_L2SQR) / (3.0 * 320 * 192 * kNumImages);
  }
  EXPECT_FALSE(capture.grab()) << "more images than were written";
  return 10 * std::log10(255 * 255 / square);
}

TEST_F(SimulateVideo, HasTheBitRateAskedFor) {
  for (const char* codec : {"h264", "h265"}) {
    double last_psnr_db = 0;
    for (const double mbit_per_s : {0.1, 0.3, 1.0}) {
      const fs::path path = folder_ / "film.mp4";
      const auto bits =
          static_cast<double>(Write(path, {.codec = codec, .bit_rate_mbit_per_s = mbit_per_s}));
      // A tenth: twelve seconds are short for the control of the rate.
      EXPECT_NEAR(1e-6 * bits * kFps / kNumImages, mbit_per_s, 0.1 * mbit_per_s) << codec;
      // The file holds them, and besides tables and headers of a few kB.
      const auto file_bits = 8 * static_cast<double>(fs::file_size(path));
      EXPECT_GT(file_bits, bits);
      EXPECT_LT(file_bits, bits + 8 * 8192) << codec;
      const double psnr_db = Psnr(path);
      EXPECT_GT(psnr_db, last_psnr_db + 1) << codec << " at " << mbit_per_s;
      last_psnr_db = psnr_db;
    }
    EXPECT_GT(last_psnr_db, 30) << codec;
  }
}

TEST_F(SimulateVideo, HasTheKeyFramesAndTheBFramesAskedFor) {
  const fs::path path = folder_ / "film.mp4";
  Write(path, {.codec = "h264", .keyframe_interval = 12, .b_frames = 0});
  std::string expected;
  for (int i = 0; i < kNumImages; ++i) expected += i % 12 == 0 ? 'I' : 'P';
  EXPECT_EQ(FrameTypes(path), expected);
  Write(path, {.codec = "h264", .keyframe_interval = 20, .b_frames = 2});
  const std::string types = FrameTypes(path);
  EXPECT_EQ(std::count(types.begin(), types.end(), 'I'), 6);
  EXPECT_GT(std::count(types.begin(), types.end(), 'B'), 10);
  EXPECT_EQ(types.find("BBB"), std::string::npos);
}

TEST_F(SimulateVideo, HasTheRateAndTheSameBytesEachTime) {
  for (const char* codec : {"h264", "h265"}) {
    Write(folder_ / "a.mp4", {.codec = codec});
    Write(folder_ / "b.mp4", {.codec = codec});
    EXPECT_TRUE(ReadText(folder_ / "a.mp4") == ReadText(folder_ / "b.mp4")) << codec;
    const cv::VideoCapture capture((folder_ / "a.mp4").string(), cv::CAP_FFMPEG);
    EXPECT_DOUBLE_EQ(capture.get(cv::CAP_PROP_FPS), kFps);
    EXPECT_EQ(capture.get(cv::CAP_PROP_FRAME_COUNT), kNumImages);
  }
}

TEST_F(SimulateVideo, RefusesOddSizesAndFoldersThatAreNotThere) {
  const synthetic::VideoOptions options{.codec = "h264"};
  EXPECT_THROW(tools::VideoFile(folder_ / "a.mp4", {.size = {321, 192}, .options = options}),
               Error);
  EXPECT_THROW(tools::VideoFile(folder_ / "none/a.mp4", {.size = {320, 192}, .options = options}),
               Error);
}

const std::string kSmallVideo =
    " --camera.width 96 --camera.height 56 --flight.duration_s 8 --fps 1 --depth-stride 3"
    " --scene.kind fields --video.codec h264 --video.bit_rate_mbit_per_s 0.05 --uncalibrated true";
constexpr int kNumVideoFrames = 9;

std::map<std::string, std::string> Files(const fs::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files[fs::relative(entry.path(), folder)] = ReadText(entry.path());
  }
  return files;
}

TEST_F(SimulateVideo, ASequencesImagesAreThoseOfItsVideo) {
  const fs::path a = folder_ / "a";
  const CommandResult result = Simulate(kSmallVideo + " -o " + a.string());
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  cv::VideoCapture capture((a / "video.mp4").string(), cv::CAP_FFMPEG);
  for (int i = 0; i < kNumVideoFrames; ++i) {
    cv::Mat decoded;
    ASSERT_TRUE(capture.read(decoded));
    const cv::Mat image = cv::imread((a / "images" / ("00000" + std::to_string(i) + ".png")));
    EXPECT_EQ(cv::norm(image, decoded, cv::NORM_INF), 0) << i;
  }
  const auto record = nlohmann::json::parse(std::ifstream(a / "sequence.json"));
  // Nine images are too few for the control of the rate: what is told is what is there.
  const double told = record["video"]["bit_rate_mbit_per_s"].get<double>();
  const double in_file =
      8e-6 * static_cast<double>(fs::file_size(a / "video.mp4")) / kNumVideoFrames;
  EXPECT_LT(told, in_file);
  EXPECT_GT(told, in_file - 8e-6 * 2048 / kNumVideoFrames);
  EXPECT_GT(record["video"]["psnr_db"].get<double>(), 20);
  EXPECT_LT(record["video"]["psnr_db"].get<double>(), 45);
  EXPECT_FALSE(fs::exists(a / "frames")) << "those before the compression";
  // The same again, without anything that tells the camera.
  const auto files = Files(a);
  std::vector<std::string> names;
  for (const auto& [name, content] : Files(a / "uncalibrated")) {
    EXPECT_TRUE(content == files.at(name)) << name;
    if (!name.starts_with("images/")) names.push_back(name);
  }
  EXPECT_THAT(names, UnorderedElementsAre("timestamps.txt", "video.mp4"));
  EXPECT_FALSE(fs::is_symlink(a / "uncalibrated/images"));
}

TEST_F(SimulateVideo, ARunThatGoesOnMakesTheSameBytes) {
  ASSERT_EQ(Simulate(kSmallVideo + " -o " + (folder_ / "a").string()).exit_status, 0);
  // Ended by the limit of a file's size while the clouds and videos are to come, then let go on.
  const fs::path b = folder_ / "b";
  const std::string command = std::string(MONO3D_SIMULATE_TOOL) + kSmallVideo + " -o " + b.string();
  EXPECT_EQ(RunCommand("trap '' XFSZ; ulimit -f 32; " + command, folder_).exit_status, 1);
  ASSERT_TRUE(fs::exists(b / "frames/000008.png")) << "it did not come as far as the video";
  const CommandResult again = RunCommand(command, folder_);
  ASSERT_EQ(again.exit_status, 0) << again.errors;
  EXPECT_THAT(again.output, HasSubstr("(0 made now)"));
  EXPECT_TRUE(Files(folder_ / "a") == Files(b));
}

TEST_F(SimulateVideo, KeepsWhatItIsAskedToKeep) {
  for (const char* keep : {"images", "video"}) {
    const fs::path folder = folder_ / keep;
    const CommandResult result =
        Simulate(kSmallVideo + " --video.keep " + keep + " -o " + folder.string());
    ASSERT_EQ(result.exit_status, 0) << result.errors;
    for (const fs::path& place : {folder, folder / "uncalibrated"}) {
      EXPECT_EQ(fs::exists(place / "video.mp4"), keep == std::string("video")) << place;
      EXPECT_EQ(fs::exists(place / "images"), keep == std::string("images")) << place;
    }
  }
}

TEST_F(SimulateVideo, BadArgumentsAreOneLine) {
  for (const char* arguments : {"--video.codec divx", "--video.bit_rate_mbit_per_s 0",
                                "--video.keep nothing", "--video.codec h264 --jpeg-quality 90"}) {
    const CommandResult result = Simulate(std::string("-o x ") + arguments);
    EXPECT_EQ(result.exit_status, kWrongUsage) << arguments;
    EXPECT_EQ(std::count(result.errors.begin(), result.errors.end(), '\n'), 1) << result.errors;
  }
  // Known only when the video is opened, after the images: still one line.
  const CommandResult odd =
      Simulate("--camera.width 97 --camera.height 56 --max-frames 1 --video.codec h264 -o " +
               (folder_ / "odd").string());
  EXPECT_EQ(odd.exit_status, kFailure);
  EXPECT_THAT(odd.errors, HasSubstr("an even width and height"));
}

TEST_F(SimulateVideo, TheRecordTellsTheTrueCameraAndItsExposures) {
  const std::string arguments =
      " --camera.width 96 --camera.height 56 --flight.duration_s 8 --fps 1 --scene.kind fields"
      " --camera.focal_px 80 --camera.offset_x_px 1.5 --camera.k1 -0.1 --sensor.readout_s 0.0275"
      " --sensor.readout_direction up --sensor.exposure 0.8 --sensor.exposure_step 0.3"
      " --sensor.exposure_step_interval_s 2 -o ";
  const CommandResult result = Simulate(arguments + (folder_ / "a").string());
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  const auto record = nlohmann::json::parse(std::ifstream(folder_ / "a/sequence.json"));
  const auto& camera = record["camera"];
  EXPECT_EQ(camera["fx"], 80);
  EXPECT_EQ(camera["cx"], 49);
  EXPECT_EQ(camera["distortion"][0], -0.1);
  EXPECT_EQ(camera["readout_direction"], "up");
  EXPECT_NEAR(camera["line_delay_s"].get<double>(), -0.0275 / 55, 1e-12);
  const RollingShutter shutter = ReadCameraFile(folder_ / "a/camera.yaml").shutter;
  EXPECT_DOUBLE_EQ(shutter.readout_s, -0.0275);
  EXPECT_FALSE(shutter.reads_columns);
  std::istringstream lines(ReadText(folder_ / "a/exposures.txt"));
  int num_lines = 0;
  std::vector<double> levels;  // steps from the exposure of the options
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with('#')) continue;
    double t_s = 0;
    double exposure = 0;
    std::istringstream(line) >> t_s >> exposure;
    EXPECT_NEAR(t_s, num_lines, 1e-6);
    levels.push_back(std::abs(std::log(exposure / 0.8) / std::log(1.3)));
    ++num_lines;
  }
  EXPECT_EQ(num_lines, kNumVideoFrames);
  for (const double level : levels) EXPECT_NEAR(level, std::round(level), 1e-6);
  EXPECT_GT(*std::max_element(levels.begin(), levels.end()), 0.5) << "it jumped";
}

TEST_F(SimulateVideo, ExposuresOfARunThatWasKilledAreKept) {
  const fs::path path = folder_ / "exposures.txt";
  {
    tools::ExposureLog log(path, {0, 0.5, 1});
    log.Add(1, 0.75);
    log.Add(0, 1.25);
  }
  WriteText(path, ReadText(path) + "1.0000");  // in the middle of a line
  tools::ExposureLog log(path, {0, 0.5, 1});
  EXPECT_TRUE(log.Has(0));
  EXPECT_TRUE(log.Has(1));
  EXPECT_FALSE(log.Has(2));
  log.Add(2, 2);
  log.Finish();
  EXPECT_THAT(ReadText(path), HasSubstr("\n0.000000 1.25\n0.500000 0.75\n1.000000 2\n"));
}

}  // namespace
}  // namespace mono3d
