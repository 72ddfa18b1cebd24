// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/heif_decoder.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <filesystem>
#include <opencv2/core.hpp>
#include <random>
#include <string>

#include "io/heic_photo.h"
#include "io/heif_file.h"
#include "io/image_file.h"
#include "io/image_metadata.h"
#include "io/photo_file.h"
#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/camera_metadata.h"

namespace mono3d {
namespace {

cv::Mat SmoothPicture() {
  cv::Mat image(96, 160, CV_8UC3);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      image.at<cv::Vec3b>(y, x) =
          cv::Vec3b(static_cast<std::uint8_t>(40 + x), static_cast<std::uint8_t>(60 + y),
                    static_cast<std::uint8_t>(220 - x));
    }
  }
  return image;
}

class HeifDecoderTest : public TemporaryFolderTest {
 protected:
  void SetUp() override {
    TemporaryFolderTest::SetUp();
    const std::string tiff = ExifWriter()
                                 .Camera("Maker", "Phone 7")
                                 .FocalLength35(26)
                                 .Short(ExifWriter::Directory::kImage, 0x0112, 6)
                                 .Tiff();
    bytes_ = HeicPhoto(SmoothPicture(), tiff);
    if (bytes_.empty()) GTEST_SKIP() << "libheif has no encoder of HEVC";
  }

  std::string bytes_;
};

TEST_F(HeifDecoderTest, DecodesWhatAPhoneWrites) {
  ASSERT_TRUE(IsHeif(bytes_));
  const cv::Mat found = DecodeHeif(bytes_, "a.heic");
  ASSERT_EQ(found.type(), CV_8UC3);
  ASSERT_EQ(found.size(), SmoothPicture().size());  // as stored, not turned by 90 degrees
  cv::Mat difference;
  cv::absdiff(found, SmoothPicture(), difference);
  for (int channel = 0; channel < 3; ++channel) EXPECT_LT(cv::mean(difference)[channel], 3);
}

TEST_F(HeifDecoderTest, HasSizeAndExif) {
  const ImageMetadata metadata = ReadImageMetadata(WriteText("a.heic", bytes_));
  EXPECT_EQ(metadata.width, 160);
  EXPECT_EQ(metadata.height, 96);
  EXPECT_EQ(metadata.exif.substr(0, 6), std::string("Exif\0\0", 6));
  EXPECT_NE(metadata.exif.find("Phone 7"), std::string::npos);
}

TEST_F(HeifDecoderTest, IsReadAsOtherPhotographsAre) {
  const std::filesystem::path path = WriteText("IMG_1.HEIC", bytes_);
  EXPECT_EQ(ReadImage(path).size(), cv::Size(160, 96));
  EXPECT_EQ(ReadSmallImage(path).size(), cv::Size(20, 12));
  EXPECT_EQ(ReadShownTurn(folder_), 90);
}

TEST_F(HeifDecoderTest, DamageIsAnErrorOrAPicture) {
  std::mt19937 random(1);
  for (int i = 0; i < 200; ++i) {
    std::string damaged = bytes_;
    if (i % 2 == 0) {
      damaged.resize(random() % damaged.size());
    } else {
      for (int k = 0; k < 4; ++k) damaged[random() % damaged.size()] = static_cast<char>(random());
    }
    const std::filesystem::path path = WriteText("damaged.heic", damaged);
    ReadImageMetadata(path);
    try {
      EXPECT_EQ(DecodeHeif(damaged, "damaged.heic").type(), CV_8UC3);
    } catch (const Error& error) {
      EXPECT_NE(std::string(error.what()).find("damaged.heic"), std::string::npos);
    }
  }
  EXPECT_THROW(DecodeHeif(bytes_.substr(0, bytes_.size() / 2), "cut.heic"), Error);
  EXPECT_THROW(DecodeHeif("no image", "text.heic"), Error);
}

}  // namespace
}  // namespace mono3d
