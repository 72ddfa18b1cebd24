// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/image_file.h"

#include <gmock/gmock.h>

#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "io/image_metadata.h"
#include "io/temporary_folder.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

class ImageFile : public TemporaryFolderTest {
 protected:
  static std::string Encode(const std::string& extension, const cv::Mat& image,
                            const std::vector<int>& parameters = {}) {
    std::vector<std::uint8_t> bytes;
    cv::imencode(extension, image, bytes, parameters);
    return {bytes.begin(), bytes.end()};
  }

  // Noise keeps the coded data long.
  static cv::Mat Noise(int type) {
    cv::Mat image(40, 60, type);
    cv::RNG(5).fill(image, cv::RNG::UNIFORM, 0, image.depth() == CV_16U ? 65536 : 256);
    return image;
  }

  cv::Mat Read(const std::string& bytes) const { return ReadImage(WriteText("image", bytes)); }
};

TEST_F(ImageFile, IsReadAsColour) {
  const cv::Mat image = Noise(CV_8UC3);
  EXPECT_EQ(cv::norm(Read(Encode(".png", image)), image, cv::NORM_INF), 0);
}

TEST_F(ImageFile, OfGreyIsRepeatedInThreeChannels) {
  const cv::Mat read = Read(Encode(".png", cv::Mat(2, 2, CV_8UC1, cv::Scalar(77))));
  EXPECT_EQ(read.type(), CV_8UC3);
  EXPECT_EQ(read.at<cv::Vec3b>(1, 1), cv::Vec3b(77, 77, 77));
}

TEST_F(ImageFile, OfSixteenBitsIsCutToTheUpperEight) {
  const cv::Mat deep = Noise(CV_16UC3);
  for (const char* extension : {".png", ".tiff"}) {
    const cv::Mat read = Read(Encode(extension, deep));
    ASSERT_EQ(read.type(), CV_8UC3) << extension;
    for (int y = 0; y < deep.rows; ++y) {
      for (int x = 0; x < deep.cols; ++x) {
        for (int c = 0; c < 3; ++c) {
          ASSERT_NEAR(read.at<cv::Vec3b>(y, x)[c], deep.at<cv::Vec3w>(y, x)[c] / 256, 1)
              << extension;
        }
      }
    }
  }
}

TEST_F(ImageFile, OfSixteenBitsWithEmptyUpperBitsIsTakenByThoseThatItUses) {
  for (const char* extension : {".png", ".tiff"}) {
    const cv::Mat deep = Noise(CV_16UC3);
    const cv::Mat of_12_bits = deep / 16 - cv::Scalar::all(1);
    std::vector<std::string> dark;
    for (int i = 0; i < 12; ++i) {
      const cv::Mat image = i == 4 ? of_12_bits : cv::Mat(of_12_bits / 8);
      dark.push_back(WriteText(std::to_string(i) + extension, Encode(extension, image)));
    }
    const int bits = FindValueBits(dark);
    EXPECT_EQ(bits, 12) << extension << ": one scale for all";
    const cv::Mat read = ReadImage(dark[4], bits);
    ASSERT_EQ(read.type(), CV_8UC3);
    EXPECT_EQ(read.at<cv::Vec3b>(3, 5)[1], of_12_bits.at<cv::Vec3w>(3, 5)[1] / 16);
    EXPECT_GT(cv::mean(read)[0], 100);
    EXPECT_LT(cv::mean(ReadImage(dark[4]))[0], 10) << "as it was";
    dark[4] = WriteText(std::string("4") + extension, Encode(extension, deep));
    EXPECT_EQ(FindValueBits(dark), 16) << "a bright one among them";
    EXPECT_EQ(FindValueBits({WriteText("a", Encode(extension, Noise(CV_8UC3)))}), 16);
  }
  EXPECT_EQ(FindValueBits({WriteText("text.png", "no image")}), 16);
}

TEST_F(ImageFile, LosesItsAlphaChannel) {
  const cv::Mat read = Read(Encode(".png", cv::Mat(2, 2, CV_8UC4, cv::Scalar(1, 2, 3, 0))));
  ASSERT_EQ(read.type(), CV_8UC3);
  EXPECT_EQ(read.at<cv::Vec3b>(0, 0), cv::Vec3b(1, 2, 3));
}

TEST_F(ImageFile, TruncatedAnywhereIsRefused) {
  const std::string files[] = {Encode(".jpg", Noise(CV_8UC3)),
                               Encode(".jpg", Noise(CV_8UC3), {cv::IMWRITE_JPEG_PROGRESSIVE, 1}),
                               Encode(".jpg", Noise(CV_8UC3), {cv::IMWRITE_JPEG_RST_INTERVAL, 2}),
                               Encode(".png", Noise(CV_8UC3))};
  for (const std::string& bytes : files) {
    EXPECT_NO_THROW(Read(bytes));
    for (std::size_t size = 20; size < bytes.size(); size += 1 + size / 20) {
      EXPECT_THROW(Read(bytes.substr(0, size)), Error) << size << " of " << bytes.size();
    }
    EXPECT_THAT([&] { Read(bytes.substr(0, bytes.size() - 1)); },
                ThrowsMessage<Error>(HasSubstr("image: the image is truncated")));
  }
}

// A thumbnail has an end-of-image marker of its own.
TEST_F(ImageFile, TruncatedBehindAThumbnailIsRefused) {
  const std::string jpeg = Encode(".jpg", Noise(CV_8UC3));
  const std::string thumbnail = Encode(".jpg", cv::Mat(2, 2, CV_8UC3, cv::Scalar::all(9)));
  const std::size_t length = thumbnail.size() + 2;
  const std::string segment = std::string("\xFF\xE1") + static_cast<char>(length >> 8) +
                              static_cast<char>(length & 0xFF) + thumbnail;
  const std::string with_thumbnail = jpeg.substr(0, 2) + segment + jpeg.substr(2);
  EXPECT_NO_THROW(Read(with_thumbnail));
  EXPECT_THAT(
      [&] { Read(with_thumbnail.substr(0, with_thumbnail.size() / 2 + segment.size() / 2)); },
      ThrowsMessage<Error>(HasSubstr("the image is truncated")));
}

TEST_F(ImageFile, MayHaveBytesBehindItsEnd) {
  for (const char* extension : {".jpg", ".png"}) {
    EXPECT_NO_THROW(Read(Encode(extension, Noise(CV_8UC3)) + "notes of the maker"));
  }
}

// By what its head says, before memory is asked for.
TEST_F(ImageFile, ThatSaysItIsHugeIsRefused) {
  std::string png = Encode(".png", Noise(CV_8UC3));
  png.replace(16, 8, std::string("\0\0\x7D\0\0\0\x7D\0", 8));
  EXPECT_THAT([&] { Read(png); },
              ThrowsMessage<Error>(HasSubstr("the image is too large (expected at most 268435456 "
                                             "pixels, found 32000x32000)")));
}

TEST_F(ImageFile, OfAnyFormThatSaysItIsHugeIsRefused) {
  std::string bmp = Encode(".bmp", Noise(CV_8UC3));
  bmp.replace(18, 8, std::string("\0\0\x7D\0\0\x83\xFF\xFF", 8));  // 8192000 x -32000
  std::string tiff = Encode(".tiff", Noise(CV_8UC3));
  for (const char* tag : {"\x00\x01", "\x01\x01"}) {  // ImageWidth and ImageLength
    const std::size_t entry = tiff.find(std::string(tag, 2) + std::string("\x03\0\x01\0\0\0", 6));
    ASSERT_NE(entry, std::string::npos);
    tiff.replace(entry + 8, 2, "\x30\x75");  // 30000
  }
  for (const std::string& bytes : {bmp, tiff, std::string("P6 # of\n30000 30000 255\n")}) {
    EXPECT_THAT([&] { Read(bytes); },
                ThrowsMessage<Error>(HasSubstr("the image is too large (expected at most")));
  }
}

// A decoder that takes other bytes between two numbers, or between two segments, would find one.
TEST_F(ImageFile, ThatDoesNotSayItsSizeIsRefused) {
  EXPECT_THAT([&] { Read("P6 30000\x96\x33\x30\x30\x30\x30 255\n"); },
              ThrowsMessage<Error>(HasSubstr("the image is too large")));
  EXPECT_THAT([&] { Read("P6 x 30000 255\n"); },
              ThrowsMessage<Error>(HasSubstr("the image does not say its size")));
  std::string jpeg = Encode(".jpg", Noise(CV_8UC3));
  const std::size_t frame = jpeg.find("\xFF\xC0");
  ASSERT_NE(frame, std::string::npos);
  jpeg.replace(frame + 5, 4, "\x75\x30\x75\x30");  // 30000
  jpeg.insert(frame, "odd bytes");
  EXPECT_THAT([&] { Read(jpeg); }, ThrowsMessage<Error>(HasSubstr("the image is too large")));
}

TEST_F(ImageFile, OfEachFormSaysItsSize) {
  for (const char* extension : {".jpg", ".png", ".bmp", ".tiff", ".webp", ".ppm"}) {
    const cv::Mat image(30, 500, CV_8UC3, cv::Scalar(10, 200, 90));
    WriteText("image", Encode(extension, image));
    EXPECT_NO_THROW(RequireDecodableSize(folder_ / "image")) << extension;
    EXPECT_EQ(ReadImage(folder_ / "image").size(), image.size()) << extension;
  }
  const cv::Mat image(30, 500, CV_8UC3, cv::Scalar(10, 200, 90));
  WriteText("image", Encode(".webp", image, {cv::IMWRITE_WEBP_QUALITY, 101}));  // without loss
  EXPECT_EQ(ReadImageMetadata(folder_ / "image").width, 500);
  EXPECT_EQ(ReadImageMetadata(folder_ / "image").height, 30);
}

TEST_F(ImageFile, IsReadAtAnEighthOfItsSize) {
  for (const char* extension : {".jpg", ".png"}) {
    WriteText("image", Encode(extension, cv::Mat(80, 161, CV_8UC3, cv::Scalar(10, 200, 90))));
    const cv::Mat small = ReadSmallImage(folder_ / "image");
    EXPECT_EQ(small.rows, 10) << extension;
    EXPECT_NEAR(small.cols, 20, 1) << extension;
    EXPECT_EQ(small.type(), CV_8UC3);
  }
  WriteText("image", "P6 30000 30000 255\n");
  EXPECT_THROW(ReadSmallImage(folder_ / "image"), Error);
  WriteText("image", Encode(".hdr", Noise(CV_8UC3)));
  EXPECT_THROW(ReadSmallImage(folder_ / "image"), Error);
}

TEST_F(ImageFile, OfAFormThatNobodyAskedForIsNotDecoded) {
  EXPECT_THAT([&] { Read(Encode(".hdr", Noise(CV_8UC3))); },
              ThrowsMessage<Error>(HasSubstr("not an image, or not of a known kind")));
}

TEST_F(ImageFile, ThatIsNoImageIsRefused) {
  EXPECT_THAT([&] { Read("just a text file with a wrong name\n"); },
              ThrowsMessage<Error>(HasSubstr("image: not an image, or not of a known kind")));
  EXPECT_THAT([&] { Read(""); }, ThrowsMessage<Error>(HasSubstr("the file is empty")));
  EXPECT_THAT([&] { ReadImage(folder_ / "none.jpg"); },
              ThrowsMessage<Error>(HasSubstr("none.jpg: there is no such file")));
}

}  // namespace
}  // namespace mono3d
