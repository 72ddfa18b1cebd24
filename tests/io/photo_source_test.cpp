// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <string_view>
#include <vector>

#include "io/photo_file.h"
#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/io/camera_metadata.h"
#include "mono3d/io/frame_source.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

const CameraModel kWideCamera{64, 48, 60, 60, 31.5, 23.5, {}};
const CameraModel kUprightCamera{40, 60, 60, 60, 19.5, 29.5, {}};

class PhotoSource : public TemporaryFolderTest {
 protected:
  PhotoSource() {
    Write("1.png", kWideCamera, 10);
    Write("2.png", kUprightCamera, 20);
    Write("3.png", kWideCamera, 30);
  }

  void Write(const std::string& name, const CameraModel& camera, int value) const {
    cv::imwrite(folder_ / name,
                cv::Mat(camera.height, camera.width, CV_8UC3, cv::Scalar::all(value)));
  }
};

TEST_F(PhotoSource, BringsPhotosOfSeveralCamerasIntoTheImagesOfOne) {
  const auto source =
      OpenFrameSource(folder_, CamerasOfImages{{kWideCamera, kUprightCamera}, {0, 1, 0}});
  EXPECT_EQ(source->camera().width, 64);
  EXPECT_EQ(source->camera().height, 60);
  EXPECT_EQ(source->num_frames(), 3);
  for (int i = 0; i < 3; ++i) {
    const auto frame = source->Next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->index, i);
    EXPECT_EQ(frame->camera, source->camera());
    EXPECT_NO_THROW(Validate(*frame));
    EXPECT_EQ(frame->bgr.at<cv::Vec3b>(0, 0)[0], 10 * (i + 1));
    EXPECT_EQ(frame->content, i == 1 ? cv::Rect(12, 0, 40, 60) : cv::Rect(0, 6, 64, 48));
  }
  EXPECT_FALSE(source->Next());
}

TEST_F(PhotoSource, KeepsToTheSizeThatIsAskedFor) {
  FrameSourceOptions of_size, of_side;
  of_size.resize = "32x32";
  of_side.max_side_px = 32;
  for (const FrameSourceOptions& options : {of_size, of_side}) {
    const auto source = OpenFrameSource(
        folder_, CamerasOfImages{{kWideCamera, kUprightCamera}, {0, 1, 0}}, options);
    EXPECT_LE(source->camera().width, 32);
    EXPECT_LE(source->camera().height, 32);
    const auto frame = source->Next();
    ASSERT_TRUE(frame);
    EXPECT_EQ(frame->bgr.cols, source->camera().width);
  }
}

TEST_F(PhotoSource, OfOneCameraIsAsEver) {
  Write("2.png", kWideCamera, 20);
  const auto source = OpenFrameSource(folder_, CamerasOfImages{{kWideCamera}});
  EXPECT_EQ(source->camera(), kWideCamera);
  EXPECT_TRUE(source->Next()->content.empty());
}

TEST_F(PhotoSource, RefusesPhotosOfAnotherSizeThanTheirCameras) {
  const auto source =
      OpenFrameSource(folder_, CamerasOfImages{{kWideCamera, kUprightCamera}, {0, 0, 1}});
  EXPECT_TRUE(source->Next());
  EXPECT_THAT([&] { (void)source->Next(); },
              ThrowsMessage<Error>(HasSubstr("image has another size than its camera")));
  EXPECT_THROW(
      (void)OpenFrameSource(folder_, CamerasOfImages{{kWideCamera, kUprightCamera}, {0, 2, 1}}),
      Error);
  EXPECT_THROW((void)OpenFrameSource(folder_, CamerasOfImages{}), Error);
}

// As one calls the tool with a folder of several sizes and --video.
TEST_F(PhotoSource, OfOneCameraNamesTheWayOut) {
  const auto source = OpenFrameSource(folder_, kWideCamera);
  EXPECT_TRUE(source->Next());
  std::vector<std::string> warnings;
  SetLogSink([&](LogLevel, std::string_view message) { warnings.emplace_back(message); });
  while (source->Next()) continue;
  SetLogSink({});
  EXPECT_GT(source->num_skipped(), 0);
  ASSERT_FALSE(warnings.empty());
  EXPECT_THAT(warnings[0], HasSubstr("--photos"));
}

constexpr int kOrientation = 0x112;
constexpr int kLensModel = 0xA434;
constexpr auto kImageDirectory = ExifWriter::Directory::kImage;
constexpr auto kExifDirectory = ExifWriter::Directory::kExif;

class PhotoGroups : public TemporaryFolderTest {
 protected:
  std::string Photo(const std::string& name, const ExifWriter& exif) const {
    return WriteText(name, JpegPhoto(90, 60, exif.Block()));
  }
  static ExifWriter Phone() {
    return ExifWriter().Camera("Phone", "P").FocalLength(4.2).FocalLength35(26);
  }
};

// The pixels are stored as the sensor has them: the calibration is the same.
TEST_F(PhotoGroups, HeldUprightAndLengthwiseAreOne) {
  const auto groups =
      GroupByCamera({Photo("1.jpg", Phone().Short(kImageDirectory, kOrientation, 1)),
                     Photo("2.jpg", Phone().Short(kImageDirectory, kOrientation, 6)),
                     Photo("3.jpg", Phone().Short(kImageDirectory, kOrientation, 8))});
  ASSERT_EQ(groups.size(), 1U);
  EXPECT_EQ(groups[0].images.size(), 3U);
  EXPECT_EQ(groups[0].prior.camera.width, 90);
}

TEST_F(PhotoGroups, OfAnotherLensAreOthers) {
  const auto groups =
      GroupByCamera({Photo("1.jpg", Phone().Ascii(kExifDirectory, kLensModel, "35 mm f/1.4")),
                     Photo("2.jpg", Phone().Ascii(kExifDirectory, kLensModel, "35 mm f/2")),
                     Photo("3.jpg", Phone().Ascii(kExifDirectory, kLensModel, "35 mm f/1.4"))});
  ASSERT_EQ(groups.size(), 2U);
  EXPECT_EQ(groups[0].images.size(), 2U);
  EXPECT_EQ(groups[1].lens, "35 mm f/2");
}

}  // namespace
}  // namespace mono3d
