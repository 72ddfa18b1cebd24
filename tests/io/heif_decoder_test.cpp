// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/heif_decoder.h"

#include <gtest/gtest.h>
#include <libheif/heif.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <random>
#include <stdexcept>
#include <string>

#include "io/heif_file.h"
#include "io/image_file.h"
#include "io/image_metadata.h"
#include "io/photo_file.h"
#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/camera_metadata.h"

namespace mono3d {
namespace {

void Require(const heif_error& error) {
  if (error.code != heif_error_Ok) throw std::runtime_error(error.message);
}

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

// By libheif's encoder of HEVC, as a phone writes it; empty where it has none.
std::string HeicPhoto(const cv::Mat& bgr, const std::string& tiff) {
  const std::unique_ptr<heif_context, decltype(&heif_context_free)> context(heif_context_alloc(),
                                                                            heif_context_free);
  heif_encoder* encoder = nullptr;
  if (heif_context_get_encoder_for_format(context.get(), heif_compression_HEVC, &encoder).code !=
      heif_error_Ok) {
    return {};
  }
  Require(heif_encoder_set_lossy_quality(encoder, 95));
  heif_image* image = nullptr;
  Require(heif_image_create(bgr.cols, bgr.rows, heif_colorspace_RGB, heif_chroma_interleaved_RGB,
                            &image));
  Require(heif_image_add_plane(image, heif_channel_interleaved, bgr.cols, bgr.rows, 8));
  int stride = 0;
  std::uint8_t* rows = heif_image_get_plane(image, heif_channel_interleaved, &stride);
  cv::Mat rgb(bgr.rows, bgr.cols, CV_8UC3, rows, static_cast<std::size_t>(stride));
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  heif_image_handle* handle = nullptr;
  Require(heif_context_encode_image(context.get(), image, encoder, nullptr, &handle));
  if (!tiff.empty()) {
    Require(heif_context_add_exif_metadata(context.get(), handle, tiff.data(),
                                           static_cast<int>(tiff.size())));
  }
  heif_image_handle_release(handle);
  heif_image_release(image);
  heif_encoder_release(encoder);
  std::string bytes;
  heif_writer writer = {
      1, [](heif_context*, const void* data, std::size_t size, void* to) -> heif_error {
        static_cast<std::string*>(to)->assign(static_cast<const char*>(data), size);
        return {heif_error_Ok, heif_suberror_Unspecified, ""};
      }};
  Require(heif_context_write(context.get(), &writer, &bytes));
  return bytes;
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
