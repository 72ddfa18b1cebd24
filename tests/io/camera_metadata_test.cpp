// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/camera_metadata.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <string>
#include <utility>
#include <vector>

#include "io/photo_file.h"
#include "io/temporary_folder.h"
#include "io/video_prior.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/io/frame_source.h"

namespace mono3d {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::ThrowsMessage;

class CameraMetadata : public TemporaryFolderTest {
 protected:
  CameraMetadata() {
    SetLogSink([this](LogLevel level, std::string_view message) {
      if (level == LogLevel::kWarning) warnings_.emplace_back(message);
    });
  }
  ~CameraMetadata() override { SetLogSink({}); }

  std::string WritePhoto(const std::string& name, const ExifWriter& exif, int width = 90) const {
    return WriteText(name, JpegPhoto(width, width * 2 / 3, exif.Block()));
  }
  std::string WritePlain(const std::string& name, int width = 90) const {
    return WriteText(name, JpegPhoto(width, width * 2 / 3, {}));
  }
  std::string WriteVideo(const std::string& name) const {
    const std::string path = folder_ / name;
    cv::VideoWriter writer(path, cv::CAP_OPENCV_MJPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'),
                           20, cv::Size(96, 54));
    for (int i = 0; i < 3; ++i)
      writer.write(cv::Mat(54, 96, CV_8UC3, cv::Scalar::all(20 + 30 * i)));
    return path;
  }

  std::vector<std::string> warnings_;
};

ExifWriter Camera(const std::string& model, double focal_mm) {
  return ExifWriter()
      .Camera("Maker", model)
      .FocalLength(focal_mm)
      .FocalLength35(static_cast<int>(std::lround(focal_mm)));
}

std::vector<std::string> FileNames(const std::vector<std::string>& paths) {
  std::vector<std::string> names;
  for (const std::string& path : paths) names.push_back(std::filesystem::path(path).filename());
  return names;
}

TEST_F(CameraMetadata, OfAFolderIsThatOfTheFirstPhotoWithMetadata) {
  WriteText("0.jpg", "not a photo");
  WritePlain("1.jpg");
  WritePhoto("3.jpg", Camera("A", 36));
  WritePhoto("4.jpg", Camera("B", 72));
  const CameraPrior prior = ReadCameraPrior(folder_);
  EXPECT_EQ(prior.source, CameraPriorSource::kExif);
  EXPECT_NEAR(prior.camera.fx, 90, 0.1);
  EXPECT_THAT(warnings_, ElementsAre(HasSubstr("0.jpg")));
  EXPECT_NEAR(ReadCameraPrior(folder_ / "[14].jpg").camera.fx, 180, 0.2) << "a glob";
  EXPECT_NEAR(ReadCameraPrior(folder_ / "4.jpg").camera.fx, 180, 0.2) << "one image";
}

TEST_F(CameraMetadata, OfASequenceFolderIsThatOfItsImages) {
  WritePhoto("preview.jpg", Camera("B", 72));
  WritePhoto("images/1.jpg", Camera("A", 36));
  EXPECT_NEAR(ReadCameraPrior(folder_).camera.fx, 90, 0.1);
}

TEST_F(CameraMetadata, OfImagesWithoutMetadataIsTheDefaultOfTheirSize) {
  for (const char* extension : {".jpg", ".png", ".bmp", ".pgm", ".tif", ".webp"}) {
    const std::filesystem::path folder = folder_ / (extension + 1);
    std::filesystem::create_directory(folder);
    const cv::Mat image(48, 64, CV_8UC1, cv::Scalar(77));
    cv::imwrite(folder / ("1" + std::string(extension)), image);
    cv::imwrite(folder / ("2" + std::string(extension)), image);
    const CameraPrior prior = ReadCameraPrior(folder);
    EXPECT_EQ(prior.source, CameraPriorSource::kDefault) << extension;
    EXPECT_EQ(prior.camera, DefaultCameraPrior(64, 48).camera) << extension;
  }
  EXPECT_THAT(warnings_, IsEmpty());
}

// Photos of one camera are alike: their warnings would be.
TEST_F(CameraMetadata, WithoutUsableValuesIsGivenUpAfterSomePhotos) {
  std::vector<std::string> images;
  for (int i = 0; i < 30; ++i) {
    images.push_back(WritePlain("a" + std::to_string(i) + ".jpg"));
    images.push_back(WritePhoto("b" + std::to_string(i) + ".jpg",
                                ExifWriter().Camera("A", "B").FocalLength35(60000)));
  }
  EXPECT_EQ(ReadCameraPrior(folder_).source, CameraPriorSource::kDefault);
  EXPECT_EQ(warnings_.size(), 10U);
  warnings_.clear();
  const std::vector<CameraGroup> groups = GroupByCamera(images);
  ASSERT_EQ(groups.size(), 1U);
  EXPECT_EQ(groups[0].images, images);
  EXPECT_EQ(groups[0].prior.source, CameraPriorSource::kDefault);
  EXPECT_EQ(warnings_.size(), 10U);
}

TEST_F(CameraMetadata, OfManyPhotosWithoutMetadataIsThatOfTheOneWithMetadata) {
  std::vector<std::string> images;
  for (int i = 10; i < 40; ++i) images.push_back(WritePlain(std::to_string(i) + ".jpg"));
  images.push_back(WritePhoto("99.jpg", Camera("A", 36)));
  EXPECT_EQ(ReadCameraPrior(folder_).source, CameraPriorSource::kExif);
  const std::vector<CameraGroup> groups = GroupByCamera(images);
  ASSERT_EQ(groups.size(), 1U);
  EXPECT_EQ(groups[0].prior.source, CameraPriorSource::kExif);
}

TEST_F(CameraMetadata, OfNothingIsAnError) {
  EXPECT_THAT([&] { ReadCameraPrior(folder_ / "none"); },
              ThrowsMessage<Error>(HasSubstr("there is no such file or folder")));
  EXPECT_THROW(ReadCameraPrior(folder_), Error) << "an empty folder";
  WriteText("1.jpg", "not a photo");
  EXPECT_THAT([&] { ReadCameraPrior(folder_); },
              ThrowsMessage<Error>(HasSubstr("not one image can be read")));
  EXPECT_THROW(ReadCameraPrior(WriteText("no.mp4", "no video")), Error);
}

// What the prior is of is what is read.
TEST_F(CameraMetadata, FitsTheFramesOfItsInput) {
  WritePhoto("1.jpg", Camera("A", 36));
  EXPECT_TRUE(OpenFrameSource(folder_, ReadCameraPrior(folder_).camera)->Next());
  const std::string video = WriteVideo("flight.avi");
  EXPECT_TRUE(OpenFrameSource(video, ReadCameraPrior(video).camera)->Next());
}

TEST_F(CameraMetadata, TurnsAreThoseThatAllPhotosHave) {
  const auto turned = [](std::uint32_t orientation) {
    return Camera("A", 8).Short(ExifWriter::Directory::kImage, 0x0112, orientation);
  };
  for (const auto& [orientation, turn_deg] : {std::pair(1U, 0), {3U, 180}, {6U, 90}, {8U, 270}}) {
    WritePhoto("photos/a.jpg", turned(orientation));
    WritePhoto("photos/b.jpg", turned(orientation));
    EXPECT_EQ(ReadShownTurn(folder_ / "photos"), turn_deg) << orientation;
  }
  WritePhoto("photos/b.jpg", turned(1));
  EXPECT_EQ(ReadShownTurn(folder_ / "photos"), 0) << "some are upright, some lengthwise";
  EXPECT_EQ(ReadShownTurn(WritePlain("plain.jpg")), 0);
}

TEST_F(CameraMetadata, OfAVideoIsTheDefault) {
  const CameraPrior prior = ReadCameraPrior(WriteVideo("flight.avi"));
  EXPECT_EQ(prior.source, CameraPriorSource::kDefault);
  EXPECT_EQ(prior.camera, DefaultCameraPrior(96, 54).camera);
}

TEST_F(CameraMetadata, OfAVideoWithTelemetryIsItsFocalLength) {
  const std::string video = WriteVideo("flight.avi");
  WriteText("flight.SRT", "1\n00:00:00,000 --> 00:00:00,020\n[focal_len: 24.00] </font>\n");
  const CameraPrior prior = ReadCameraPrior(video);
  EXPECT_EQ(prior.source, CameraPriorSource::kVideo);
  EXPECT_EQ(prior.camera.fx, 64);
  EXPECT_GE(prior.focal_sigma, 0.1);
  EXPECT_EQ(prior.description, "24 mm (35 mm equivalent) in the telemetry");
  EXPECT_THAT(warnings_, IsEmpty());
  WriteText("flight.SRT", "[focal_len: 24.00]\n[focal_len: 48.00]\n");
  EXPECT_EQ(ReadCameraPrior(video).camera.fx, 64);
  EXPECT_THAT(warnings_, ElementsAre(HasSubstr("flight.avi: the focal length changes")));
}

TEST(TelemetryFocal, IsReadInEachDialect) {
  const auto focal = [](const char* text) {
    const auto found = ParseTelemetryFocal(text);
    return found ? found->focal_35mm : 0;
  };
  EXPECT_EQ(focal("[fnum: 3.2] [color_md : default] [focal_len: 24.00] [latitude: 3.4]"), 24);
  EXPECT_EQ(focal("[fnum : 280] [focal_len : 240] [latitude : 31.45]"), 24);
  EXPECT_EQ(focal("\xEF\xBB\xBF[focal_len:166.50]"), 166.5);
  EXPECT_EQ(focal("[focal_len : 0] [focal_len : 280]"), 28) << "the first plausible one";
  for (const char* text :
       {"", "1\n", "GPS(149.0251,-20.2533,16) ISO:100", "[focal_len",
        "[focal_len :", "[focal_len : ]", "[focal_len : -24]", "[focal_len : 1.2.3]",
        "[focal_len : 99999999999999999999]", "[focal_len: nan]"}) {
    EXPECT_EQ(focal(text), 0) << text;
  }
  EXPECT_FALSE(ParseTelemetryFocal("focal_len: 24.00 focal_len: 24.1")->is_changing);
  EXPECT_TRUE(ParseTelemetryFocal("focal_len: 24.00 focal_len: 28.00")->is_changing);
}

TEST_F(CameraMetadata, GroupsPhotosByCameraZoomAndSize) {
  const std::vector<std::string> images = {
      WritePhoto("1.jpg", Camera("A", 36)),
      WritePhoto("2.jpg", Camera("B", 36)),
      WritePhoto("3.jpg", Camera("A", 36.1)),  // the same zoom, as near as it is read off
      WritePhoto("4.jpg", Camera("A", 72)),
      WritePhoto("5.jpg", Camera("A", 36), 60),
      WritePhoto("6.jpg", Camera("A", 36).Serial("S1")),
      WritePhoto("7.jpg", Camera("B", 36))};
  const std::vector<CameraGroup> groups = GroupByCamera(images);
  ASSERT_EQ(groups.size(), 5U);
  EXPECT_THAT(FileNames(groups[0].images), ElementsAre("1.jpg", "3.jpg"));
  EXPECT_THAT(FileNames(groups[1].images), ElementsAre("2.jpg", "7.jpg"));
  EXPECT_THAT(FileNames(groups[2].images), ElementsAre("4.jpg"));
  EXPECT_THAT(FileNames(groups[3].images), ElementsAre("5.jpg"));
  EXPECT_THAT(FileNames(groups[4].images), ElementsAre("6.jpg"));
  EXPECT_EQ(groups[0].make, "Maker");
  EXPECT_EQ(groups[1].model, "B");
  EXPECT_EQ(groups[4].serial, "S1");
  EXPECT_EQ(groups[2].focal_length_mm, 72);
  EXPECT_NEAR(groups[0].prior.camera.fx, 90, 0.1);
  EXPECT_NEAR(groups[2].prior.camera.fx, 180, 0.2);
  EXPECT_NEAR(groups[3].prior.camera.fx, 60, 0.1);
  EXPECT_THAT(warnings_, IsEmpty());
}

TEST_F(CameraMetadata, GroupsByTheSerialNumberOfXmp) {
  const auto photo = [&](const std::string& name, const std::string& serial) -> std::string {
    return WriteText(
        name, JpegPhoto(90, 60, {}, DjiPacket("drone-dji:CameraSerialNumber=\"" + serial + "\"")));
  };
  const auto groups =
      GroupByCamera({photo("1.jpg", "S1"), photo("2.jpg", "S2"), photo("3.jpg", "S1")});
  ASSERT_EQ(groups.size(), 2U);
  EXPECT_EQ(groups[0].images.size(), 2U);
  EXPECT_EQ(groups[0].serial, "S1");
}

TEST_F(CameraMetadata, GroupsByTheFocalLengthIn35mmFilmWhereThereIsNoOther) {
  const auto photo = [&](const std::string& name, int focal_mm) {
    return WritePhoto(name, ExifWriter().Camera("Phone", "P").FocalLength35(focal_mm));
  };
  EXPECT_EQ(GroupByCamera({photo("1.jpg", 26), photo("2.jpg", 52), photo("3.jpg", 26)}).size(), 2U);
}

TEST_F(CameraMetadata, GivesPhotosWithoutMetadataToTheOnlyCameraOfTheirSize) {
  const std::vector<std::string> images = {
      WritePlain("0.jpg"), WritePhoto("1.jpg", Camera("A", 36)), WritePlain("2.jpg", 60)};
  const std::vector<CameraGroup> groups = GroupByCamera(images);
  ASSERT_EQ(groups.size(), 2U);
  EXPECT_THAT(FileNames(groups[0].images), ElementsAre("0.jpg", "1.jpg"));
  EXPECT_EQ(groups[0].prior.source, CameraPriorSource::kExif);
  EXPECT_EQ(groups[0].model, "A");
  EXPECT_THAT(FileNames(groups[1].images), ElementsAre("2.jpg"));
  EXPECT_EQ(groups[1].prior.source, CameraPriorSource::kDefault);
}

TEST_F(CameraMetadata, LeavesPhotosWithoutMetadataAloneWhereTwoCamerasMayHaveTakenThem) {
  const std::vector<CameraGroup> groups =
      GroupByCamera({WritePhoto("1.jpg", Camera("A", 36)), WritePlain("2.jpg"),
                     WritePhoto("3.jpg", Camera("B", 36)), WritePlain("4.jpg")});
  ASSERT_EQ(groups.size(), 3U);
  EXPECT_THAT(FileNames(groups[1].images), ElementsAre("2.jpg", "4.jpg"));
  EXPECT_EQ(groups[1].prior.source, CameraPriorSource::kDefault);
}

TEST_F(CameraMetadata, GroupsWithoutFilesThatCannotBeRead) {
  EXPECT_THAT(GroupByCamera({}), IsEmpty());
  const std::vector<CameraGroup> groups =
      GroupByCamera({WriteText("0.jpg", "no photo"), WritePlain("1.jpg"), folder_ / "none.jpg"});
  ASSERT_EQ(groups.size(), 1U);
  EXPECT_THAT(FileNames(groups[0].images), ElementsAre("1.jpg"));
  EXPECT_THAT(warnings_, Contains(HasSubstr("0.jpg")));
  EXPECT_THAT(warnings_, Contains(HasSubstr("none.jpg")));
}

}  // namespace
}  // namespace mono3d
