// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/frame_source.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

constexpr int kWidth = 64;
constexpr int kHeight = 48;

CameraModel TestCamera() { return {kWidth, kHeight, 60, 60, 31.5, 23.5, {}}; }

class FrameSourceTest : public TemporaryFolderTest {
 protected:
  FrameSourceTest() {
    SetLogSink([this](LogLevel level, std::string_view message) {
      if (level == LogLevel::kWarning) warnings_.emplace_back(message);
    });
  }
  ~FrameSourceTest() override { SetLogSink({}); }

  // Its number is its grey value.
  void WriteImage(const std::string& name, int value, int width = kWidth,
                  int height = kHeight) const {
    std::filesystem::create_directories((folder_ / name).parent_path());
    cv::imwrite(folder_ / name, cv::Mat(height, width, CV_8UC3, cv::Scalar::all(value)));
  }
  void WriteImages(int count) const {
    for (int i = 0; i < count; ++i) WriteImage("img" + std::to_string(i) + ".png", i);
  }

  static std::vector<Frame> ReadAll(FrameSource& source) {
    std::vector<Frame> frames;
    while (auto frame = source.Next()) frames.push_back(*frame);
    return frames;
  }
  std::vector<Frame> ReadAll(const FrameSourceOptions& options = {}) const {
    return ReadAll(*OpenFrameSource(folder_, TestCamera(), options));
  }
  static std::vector<std::int64_t> Indices(const std::vector<Frame>& frames) {
    std::vector<std::int64_t> indices;
    for (const Frame& frame : frames) indices.push_back(frame.index);
    return indices;
  }

  std::vector<std::string> warnings_;
};

TEST_F(FrameSourceTest, GivesTheImagesOfAFolderInNaturalOrder) {
  WriteImages(12);
  const auto source = OpenFrameSource(folder_, TestCamera());
  EXPECT_EQ(source->num_frames(), 12);
  const std::vector<Frame> frames = ReadAll(*source);
  ASSERT_EQ(frames.size(), 12U);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    EXPECT_NO_THROW(Validate(frames[i]));
    EXPECT_EQ(frames[i].index, static_cast<std::int64_t>(i));
    EXPECT_EQ(frames[i].name, "img" + std::to_string(i) + ".png");
    EXPECT_EQ(frames[i].bgr.at<cv::Vec3b>(0, 0)[0], i);
    EXPECT_DOUBLE_EQ(frames[i].timestamp_s, static_cast<double>(i) / 30);
    EXPECT_EQ(frames[i].camera, TestCamera());
  }
  EXPECT_FALSE(source->Next());
}

TEST_F(FrameSourceTest, GivesTheImagesOfAGlob) {
  WriteImages(4);
  const auto source = OpenFrameSource(folder_ / "img[13].png", TestCamera());
  EXPECT_EQ(ReadAll(*source).size(), 2U);
}

TEST_F(FrameSourceTest, GivesNamedImagesInTheOrderOfTheirNaming) {
  WriteImages(3);
  const auto source = OpenFrameSource(
      std::vector<std::string>{folder_ / "img2.png", folder_ / "img0.png"}, TestCamera());
  const std::vector<Frame> frames = ReadAll(*source);
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames[0].name, "img2.png");
  EXPECT_EQ(frames[1].name, "img0.png");
}

TEST_F(FrameSourceTest, TakesStartStrideAndNumberIntoAccount) {
  WriteImages(10);
  EXPECT_THAT(Indices(ReadAll({.stride = 3})), ElementsAre(0, 3, 6, 9));
  EXPECT_THAT(Indices(ReadAll({.start = 7})), ElementsAre(7, 8, 9));
  EXPECT_THAT(Indices(ReadAll({.stride = 2, .start = 3, .max_frames = 3})), ElementsAre(3, 5, 7));
  EXPECT_EQ(OpenFrameSource(folder_, TestCamera(), {.stride = 3})->num_frames(), 4);
  EXPECT_EQ(OpenFrameSource(folder_, TestCamera(), {.stride = 4, .max_frames = 9})->num_frames(),
            3);
}

TEST_F(FrameSourceTest, HasTheTimesOfTheOriginalRate) {
  WriteImages(5);
  const std::vector<Frame> frames = ReadAll({.fps = 10, .stride = 2});
  ASSERT_EQ(frames.size(), 3U);
  EXPECT_DOUBLE_EQ(frames[2].timestamp_s, 0.4);
}

TEST_F(FrameSourceTest, ReadsTimestampsBesideTheImagesOrTheirFolder) {
  WriteImage("images/1.png", 1);
  WriteImage("images/2.png", 2);
  WriteText("timestamps.txt", "# s\n100.25\n100.5\n");
  for (const auto& input : {folder_, folder_ / "images", folder_ / "images/"}) {
    const std::vector<Frame> frames = ReadAll(*OpenFrameSource(input, TestCamera()));
    ASSERT_EQ(frames.size(), 2U);
    EXPECT_EQ(frames[1].timestamp_s, 100.5) << input;
  }
  WriteText("images/timestamps.txt", "1\n2\n");
  EXPECT_EQ(ReadAll().at(1).timestamp_s, 2);
  EXPECT_EQ(ReadAll({.fps = 10}).at(1).timestamp_s, 0.1);
}

TEST_F(FrameSourceTest, RefusesBadTimestamps) {
  WriteImages(2);
  WriteText("timestamps.txt", "1\n2\n3\n");
  EXPECT_THAT([&] { ReadAll(); },
              ThrowsMessage<Error>(HasSubstr(
                  "timestamps.txt: wrong number of timestamps (expected 2, one for each image, "
                  "found 3)")));
  WriteText("timestamps.txt", "2\n1\n");
  EXPECT_THAT([&] { ReadAll(); }, ThrowsMessage<Error>(HasSubstr("timestamps.txt:2: bad")));
  WriteText("timestamps.txt", "1\nnan\n");
  EXPECT_THAT([&] { ReadAll(); }, ThrowsMessage<Error>(HasSubstr("found nan")));
}

TEST_F(FrameSourceTest, SkipsATruncatedJpegWithAWarning) {
  for (int i = 0; i < 3; ++i) WriteImage("img" + std::to_string(i) + ".jpg", 50 * i);
  std::filesystem::resize_file(folder_ / "img1.jpg",
                               std::filesystem::file_size(folder_ / "img1.jpg") / 2);
  const auto source = OpenFrameSource(folder_, TestCamera());
  EXPECT_THAT(Indices(ReadAll(*source)), ElementsAre(0, 2));
  EXPECT_EQ(source->num_skipped(), 1);
  EXPECT_THAT(warnings_, ElementsAre(AllOf(HasSubstr("img1.jpg"), HasSubstr("truncated"))));
}

TEST_F(FrameSourceTest, SkipsATextFileAndAnEmptyFileWithAWarning) {
  WriteImages(2);
  WriteText("img2.jpg", "These are not the pixels you are looking for.\n");
  WriteText("img3.jpg", "");
  const auto source = OpenFrameSource(folder_, TestCamera());
  EXPECT_THAT(Indices(ReadAll(*source)), ElementsAre(0, 1));
  EXPECT_EQ(source->num_skipped(), 2);
  EXPECT_THAT(warnings_, ElementsAre(HasSubstr("img2.jpg: not an image"),
                                     HasSubstr("img3.jpg: the file is empty")));
}

TEST_F(FrameSourceTest, RefusesInputOfWhichNothingCanBeRead) {
  WriteText("img1.jpg", "text");
  WriteText("img2.jpg", "text");
  EXPECT_THAT([&] { ReadAll(); },
              ThrowsMessage<Error>(HasSubstr("not one image can be read (found 2 unreadable)")));
}

TEST_F(FrameSourceTest, RefusesNamedImagesThatCannotBeRead) {
  const auto path = WriteText("img1.jpg", "text");
  const auto source = OpenFrameSource(std::vector<std::string>{path}, TestCamera());
  EXPECT_THAT([&] { (void)source->Next(); },
              ThrowsMessage<Error>(HasSubstr("img1.jpg: not an image")));
  EXPECT_THAT(warnings_, IsEmpty());
}

TEST_F(FrameSourceTest, RefusesWhatIsNotThere) {
  EXPECT_THAT([&] { ReadAll(); }, ThrowsMessage<Error>(HasSubstr("there are no images")));
  EXPECT_THAT([&] { OpenFrameSource(folder_ / "none", TestCamera()); },
              ThrowsMessage<Error>(HasSubstr("none: there is no such file or folder")));
  WriteImages(2);
  EXPECT_THAT(
      [&] { ReadAll({.start = 2}); },
      ThrowsMessage<Error>(HasSubstr("no image is left to read (expected a start below 2")));
}

TEST_F(FrameSourceTest, SkipsAndCountsImagesOfAnotherSize) {
  WriteImages(4);
  WriteImage("img0.png", 0, kWidth / 2, kHeight / 2);
  WriteImage("img2.png", 2, 2 * kWidth, 2 * kHeight);
  const auto source = OpenFrameSource(folder_, TestCamera());
  std::vector<std::int64_t> indices;
  while (const std::optional<Frame> frame = source->Next()) indices.push_back(frame->index);
  EXPECT_EQ(indices, (std::vector<std::int64_t>{1, 3}));
  EXPECT_EQ(source->num_skipped(), 2);
}

TEST_F(FrameSourceTest, RefusesImagesThatAreAllOfAnotherSize) {
  WriteImage("img1.png", 1, 2 * kWidth, 2 * kHeight);
  EXPECT_THAT([&] { ReadAll(); },
              ThrowsMessage<Error>(HasSubstr("img1.png: image has another size than the "
                                             "calibration; see --resize, or --photos for those "
                                             "of several cameras (expected 64x48, found 128x96)")));
}

TEST_F(FrameSourceTest, ResizesToTheCalibration) {
  WriteImage("img0.png", 9, 2 * kWidth, 2 * kHeight);
  WriteImage("img1.png", 9);
  const std::vector<Frame> frames = ReadAll({.resize = "calibration"});
  ASSERT_EQ(frames.size(), 2U);
  for (const Frame& frame : frames) {
    EXPECT_NO_THROW(Validate(frame));
    EXPECT_EQ(frame.camera, TestCamera());
  }
}

TEST_F(FrameSourceTest, ResizesTheCalibrationWithTheImages) {
  // A square between the edges of the pixels 16 to 31 and 8 to 23.
  cv::Mat image(kHeight, kWidth, CV_8UC3, cv::Scalar::all(0));
  image(cv::Rect(16, 8, 16, 16)).setTo(cv::Scalar::all(200));
  cv::imwrite(folder_ / "img0.png", image);
  CameraModel camera = TestCamera();
  camera.cx = 23.5;  // the centre of the square
  camera.cy = 15.5;
  const auto source = OpenFrameSource(folder_, camera, {.resize = "32x24"});
  const std::vector<Frame> frames = ReadAll(*source);
  ASSERT_EQ(frames.size(), 1U);
  const CameraModel& resized = frames[0].camera;
  EXPECT_EQ(source->camera(), resized);
  EXPECT_EQ(resized.width, 32);
  EXPECT_EQ(resized.height, 24);
  EXPECT_DOUBLE_EQ(resized.fx, 30);
  // c' = (c + 0.5) s - 0.5: the principal point stays in the middle of the square.
  const cv::Moments moments = cv::moments(ToGrey(frames[0].bgr));
  EXPECT_DOUBLE_EQ(resized.cx, 11.5);
  EXPECT_NEAR(moments.m10 / moments.m00, resized.cx, 1e-9);
  EXPECT_NEAR(moments.m01 / moments.m00, resized.cy, 1e-9);
}

TEST_F(FrameSourceTest, MakesLargeImagesSmallerAndSaysWhatTheyWere) {
  WriteImages(1);
  cv::Mat as_taken;
  FrameSourceOptions options;
  options.max_side_px = 32;
  options.on_image = [&](std::int64_t index, const cv::Mat& bgr) {
    EXPECT_EQ(index, 0);
    as_taken = bgr;
  };
  const std::vector<Frame> frames = ReadAll(options);
  ASSERT_EQ(frames.size(), 1U);
  EXPECT_EQ(frames[0].bgr.size(), cv::Size(32, 24));
  EXPECT_EQ(frames[0].camera, TestCamera().Resized(32, 24));
  EXPECT_EQ(as_taken.size(), cv::Size(kWidth, kHeight));

  options.max_side_px = kWidth;
  EXPECT_EQ(ReadAll(options).at(0).camera, TestCamera());
  // A size that is asked for counts alone.
  options.max_side_px = 32;
  options.resize = "48x36";
  EXPECT_EQ(ReadAll(options).at(0).camera.width, 48);
}

// The calibration is still that of the images as they are.
TEST_F(FrameSourceTest, RefusesImagesOfAnotherSizeThanTheCalibrationAlsoWhereTheyAreMadeSmaller) {
  WriteImage("img0.png", 9, 2 * kWidth, 2 * kHeight);
  FrameSourceOptions options;
  options.max_side_px = 32;
  EXPECT_THROW((void)ReadAll(options), Error);
}

TEST_F(FrameSourceTest, RefusesImagesOfAnotherShape) {
  WriteImage("img0.png", 9, kWidth, kHeight + 4);
  for (const char* resize : {"calibration", "32x24"}) {
    EXPECT_THAT([&] { ReadAll({.resize = resize}); },
                ThrowsMessage<Error>(HasSubstr("image has another shape than the calibration")));
  }
}

TEST_F(FrameSourceTest, GivesFramesFreeOfDistortion) {
  WriteImages(1);
  CameraModel camera = TestCamera();
  camera.distortion = {-0.1, 0.01, 0, 0, 0};
  for (const char* resize : {"", "32x24"}) {
    const auto source = OpenFrameSource(folder_, camera, {.resize = resize});
    const std::vector<Frame> frames = ReadAll(*source);
    ASSERT_EQ(frames.size(), 1U);
    EXPECT_NO_THROW(Validate(frames[0]));
    EXPECT_EQ(frames[0].camera, source->camera());
  }
}

TEST_F(FrameSourceTest, FillsWhatDoesNotShowTheScene) {
  cv::Mat image(kHeight, kWidth, CV_8UC3, cv::Scalar::all(100));
  image({16, 8, 12, 6}).setTo(cv::Scalar::all(255));
  cv::imwrite(folder_ / "a.png", image);
  FrameSourceOptions options;
  options.hidden = cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(0));
  options.hidden({16, 8, 12, 6}).setTo(255);
  cv::Mat as_taken;
  options.on_image = [&](std::int64_t, const cv::Mat& bgr) { as_taken = bgr.clone(); };
  const cv::Mat flat(kHeight, kWidth, CV_8UC3, cv::Scalar::all(100));
  EXPECT_EQ(cv::norm(ReadAll(options).at(0).bgr, flat, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(as_taken, image, cv::NORM_INF), 0) << "as taken it is left";
  options.resize = "32x24";
  EXPECT_EQ(cv::norm(ReadAll(options).at(0).bgr, flat({0, 0, 32, 24}), cv::NORM_INF), 0);
  // A mask made of a smaller copy does as well, one of another shape does not.
  cv::resize(options.hidden, options.hidden, {32, 24}, 0, 0, cv::INTER_NEAREST);
  EXPECT_EQ(cv::norm(ReadAll(options).at(0).bgr, flat({0, 0, 32, 24}), cv::NORM_INF), 0);
  options.hidden = cv::Mat(kWidth, kHeight, CV_8UC1, cv::Scalar(0));
  EXPECT_THAT([&] { ReadAll(options); },
              ThrowsMessage<Error>(AllOf(HasSubstr("mask has another shape"), HasSubstr("64x48"),
                                         HasSubstr("48x64"))));
}

// Where the frames have it: without distortion, at their size.
TEST_F(FrameSourceTest, TellsWhereItHasFilledFrames) {
  const cv::Rect mark(4, 4, 12, 10);
  cv::Mat image(kHeight, kWidth, CV_8UC3, cv::Scalar::all(0));
  image(mark).setTo(cv::Scalar::all(255));
  cv::imwrite(folder_ / "a.png", image);
  CameraModel camera = TestCamera();
  camera.distortion = {-0.1, 0.01, 0, 0, 0};
  FrameSourceOptions options;
  EXPECT_TRUE(OpenFrameSource(folder_, camera, options)->hidden().empty());
  const Frame as_taken = ReadAll(*OpenFrameSource(folder_, camera, options)).at(0);
  options.hidden = cv::Mat(kHeight, kWidth, CV_8UC1, cv::Scalar(0));
  options.hidden(mark).setTo(255);
  const cv::Mat hidden = OpenFrameSource(folder_, camera, options)->hidden();
  ASSERT_EQ(hidden.size(), as_taken.bgr.size());
  cv::Mat shows_mark;
  cv::extractChannel(as_taken.bgr, shows_mark, 0);
  EXPECT_EQ(cv::norm(hidden, shows_mark != 0, cv::NORM_INF), 0);
  options.resize = "32x24";
  EXPECT_EQ(OpenFrameSource(folder_, camera, options)->hidden().size(), cv::Size(32, 24));
}

TEST_F(FrameSourceTest, RefusesBadOptions) {
  WriteImages(1);
  const std::pair<FrameSourceOptions, const char*> cases[] = {
      {{.fps = -1}, "--fps: option out of range (expected 0 or more, found -1)"},
      {{.stride = 0}, "--stride: option out of range (expected 1 or more, or auto, found 0)"},
      {{.start = -1}, "--start: option out of range"},
      {{.max_frames = -1}, "--max-frames: option out of range"},
      {{.resize = "640"}, "--resize: bad size (expected WIDTHxHEIGHT or calibration, found 640)"},
      {{.resize = "640x"}, "--resize: bad size"},
      {{.resize = "0x480"}, "--resize: bad size"},
      {{.resize = "640x480x3"}, "--resize: bad size"}};
  for (const auto& [options, message] : cases) {
    EXPECT_THAT([&] { ReadAll(options); }, ThrowsMessage<UsageError>(HasSubstr(message)));
  }
}

}  // namespace
}  // namespace mono3d
