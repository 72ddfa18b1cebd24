// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/depth_image_file.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <gmock/gmock.h>

#include <limits>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/pfm_file.h"

namespace mono3d {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

class DepthImageFile : public TemporaryFolderTest {
 protected:
  std::filesystem::path WritePng(const cv::Mat& image) const {
    std::vector<std::uint8_t> bytes;
    cv::imencode(".png", image, bytes);
    return WriteText("depth.png", {bytes.begin(), bytes.end()});
  }

  // Two by two, one value in all of a channel.
  std::filesystem::path WriteExr(const std::vector<std::pair<std::string, float>>& channels,
                                 Imf::PixelType type = Imf::FLOAT) const {
    Imf::Header header(2, 2);
    Imf::FrameBuffer buffer;
    std::vector<std::vector<float>> floats;
    std::vector<std::vector<half>> halves;
    floats.reserve(channels.size());  // the buffer points into them
    halves.reserve(channels.size());
    for (const auto& [name, value] : channels) {
      header.channels().insert(name, Imf::Channel(type));
      floats.emplace_back(4, value);
      halves.emplace_back(4, half(value));
      char* data = type == Imf::HALF ? reinterpret_cast<char*>(halves.back().data())
                                     : reinterpret_cast<char*>(floats.back().data());
      const std::size_t size = type == Imf::HALF ? sizeof(half) : sizeof(float);
      buffer.insert(name, Imf::Slice(type, data, size, 2 * size));
    }
    const std::filesystem::path path = folder_ / "depth.exr";
    Imf::OutputFile file(path.c_str(), header);
    file.setFrameBuffer(buffer);
    file.writePixels(2);
    return path;
  }

  float ReadExr(const std::vector<std::pair<std::string, float>>& channels) const {
    return ReadDepthImage(WriteExr(channels)).at<float>(1, 1);
  }
};

const cv::Mat kSixteenBits = (cv::Mat_<std::uint16_t>(1, 3) << 0, 100, 65535);

TEST_F(DepthImageFile, InPngIsDividedByTheScale) {
  const cv::Mat depth = ReadDepthImage(WritePng(kSixteenBits), 50);
  ASSERT_EQ(depth.type(), CV_32FC1);
  EXPECT_THAT(std::vector<float>(depth.begin<float>(), depth.end<float>()),
              ElementsAre(0, 2, 1310.7F));
}

TEST_F(DepthImageFile, InPngTakesTheScaleBesideIt) {
  WriteText("scale.txt", "200 units per metre\n");
  EXPECT_EQ(ReadDepthImage(WritePng(kSixteenBits)).at<float>(0, 1), 0.5F);
  EXPECT_EQ(ReadDepthImage(WritePng(kSixteenBits), 100).at<float>(0, 1), 1);
}

TEST_F(DepthImageFile, InPngIsRefusedWithoutAScale) {
  const auto path = WritePng(kSixteenBits);
  EXPECT_THAT([&] { ReadDepthImage(path); },
              ThrowsMessage<Error>(HasSubstr("depth.png: a depth image in PNG needs a scale")));
  WriteText("scale.txt", "0\n");
  EXPECT_THAT([&] { ReadDepthImage(path); },
              ThrowsMessage<Error>(HasSubstr("scale.txt: bad scale of depth images")));
  EXPECT_THROW(ReadDepthImage(path, -1), UsageError);
}

TEST_F(DepthImageFile, InPngMustHaveSixteenBitsInOneChannel) {
  EXPECT_THAT(
      [&] { ReadDepthImage(WritePng(cv::Mat(2, 2, CV_8UC1, cv::Scalar(1))), 1); },
      ThrowsMessage<Error>(HasSubstr(
          "not a depth image (expected 16 bits in one channel, found 8 bits in 1 channels)")));
  EXPECT_THROW(ReadDepthImage(WritePng(cv::Mat(2, 2, CV_16UC3, cv::Scalar::all(1))), 1), Error);
}

TEST_F(DepthImageFile, InPngIsRefusedWhenTruncated) {
  const std::string bytes = ReadText(WritePng(kSixteenBits));
  EXPECT_THAT([&] { ReadDepthImage(WriteText("cut.png", bytes.substr(0, bytes.size() - 8)), 1); },
              ThrowsMessage<Error>(HasSubstr("the image is truncated")));
}

TEST_F(DepthImageFile, InPfmIsReadAsItIsAndWhatIsNoDepthBecomesZero) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
  WritePfm(folder_ / "d.pfm", (cv::Mat_<float>(2, 3) << 1.5F, -1, kInfinity, kNan, 1e10F, 9e9F));
  const cv::Mat depth = ReadDepthImage(folder_ / "d.pfm");
  EXPECT_THAT(std::vector<float>(depth.begin<float>(), depth.end<float>()),
              ElementsAre(1.5F, 0, 0, 0, 0, 9e9F));
  WritePfm(folder_ / "n.pfm", cv::Mat(2, 2, CV_32FC3, cv::Scalar::all(1)));
  EXPECT_THROW(ReadDepthImage(folder_ / "n.pfm"), Error);
}

TEST_F(DepthImageFile, InExrIsTheChannelOfDepth) {
  EXPECT_EQ(ReadExr({{"R", 1}, {"Z", 2}, {"Y", 3}}), 2);
  EXPECT_EQ(ReadExr({{"View.Depth.Z", 7}, {"R", 1}, {"G", 1}, {"B", 1}}), 7);
  EXPECT_EQ(ReadExr({{"Y", 3}, {"A", 1}}), 3);
  EXPECT_EQ(ReadExr({{"R", 4}, {"G", 5}, {"B", 6}}), 4);
  EXPECT_EQ(ReadExr({{"distance", 8}}), 8);
  EXPECT_EQ(ReadExr({{"Z", 1e10F}}), 0);
  EXPECT_THAT(
      [&] {
        ReadExr({{"A", 1}, {"B", 2}});
      },
      ThrowsMessage<Error>(HasSubstr("depth.exr: no channel for depth")));
}

TEST_F(DepthImageFile, InExrMayBeOfHalfFloats) {
  EXPECT_EQ(ReadDepthImage(WriteExr({{"Z", 12.5F}}, Imf::HALF)).at<float>(0, 0), 12.5F);
}

TEST_F(DepthImageFile, InExrCoversTheDisplayWindow) {
  // Data at (1, 1) to (4, 1) of a display of 3x2: one pixel sticks out to the right.
  Imf::Header header(Imath::Box2i({0, 0}, {2, 1}), Imath::Box2i({1, 1}, {4, 1}));
  header.channels().insert("Z", Imf::Channel(Imf::FLOAT));
  std::vector<float> values = {1, 2, 3, 4};
  Imf::FrameBuffer buffer;
  buffer.insert("Z", Imf::Slice::Make(Imf::FLOAT, values.data(), header.dataWindow()));
  {
    Imf::OutputFile file((folder_ / "w.exr").c_str(), header);
    file.setFrameBuffer(buffer);
    file.writePixels(1);
  }
  const cv::Mat depth = ReadDepthImage(folder_ / "w.exr");
  EXPECT_THAT(std::vector<float>(depth.begin<float>(), depth.end<float>()),
              ElementsAre(0, 0, 0, 0, 1, 2));
}

TEST_F(DepthImageFile, InExrWithAnAttributeOfAnotherSizeThanItsTypeIsRefused) {
  std::string bytes = ReadText(WriteExr({{"Z", 1}}));
  const std::string type = "chlist";
  const std::size_t at = bytes.find(type) + type.size() + 1;
  const std::size_t value = at + sizeof(std::int32_t);
  ASSERT_EQ(bytes[at], 19);  // "Z", its end, 16 bytes, the end of the list
  // One byte more than the list has: OpenEXR would read on at this byte, as the name of an
  // attribute.
  bytes[at] = 20;
  bytes.insert(value + 19, 1, 'x');
  EXPECT_THAT([&] { ReadDepthImage(WriteText("list.exr", bytes)); },
              ThrowsMessage<Error>(HasSubstr("list.exr: the header of the OpenEXR image")));
}

TEST_F(DepthImageFile, InExrOfChannelsThatTakeTooMuchMemoryIsRefused) {
  Imf::Header header(32767, 1);
  header.compression() = Imf::ZIP_COMPRESSION;
  for (int i = 0; i < 600; ++i) {
    header.channels().insert("Z" + std::to_string(i), Imf::Channel(Imf::HALF));
  }
  { const Imf::OutputFile file((folder_ / "many.exr").c_str(), header); }
  EXPECT_THAT([&] { ReadDepthImage(folder_ / "many.exr"); },
              ThrowsMessage<Error>(HasSubstr("32767x1 in 600 channels")));
}

TEST_F(DepthImageFile, OfAnyFormIsRefusedWhenTruncatedOrUnknown) {
  const std::string bytes = ReadText(WriteExr({{"Z", 1}}));
  for (const std::size_t size : {std::size_t{4}, bytes.size() / 2, bytes.size() - 1}) {
    EXPECT_THAT([&] { ReadDepthImage(WriteText("cut.exr", bytes.substr(0, size))); },
                ThrowsMessage<Error>(HasSubstr("cut.exr")));
  }
  EXPECT_THAT([&] { ReadDepthImage(WriteText("t.txt", "text")); },
              ThrowsMessage<Error>(HasSubstr("t.txt: not a depth image of a known form")));
  EXPECT_THROW(ReadDepthImage(folder_ / "none.pfm"), Error);
}

}  // namespace
}  // namespace mono3d
