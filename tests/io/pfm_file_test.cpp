// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/pfm_file.h"

#include <gmock/gmock.h>

#include <limits>
#include <opencv2/core.hpp>
#include <string>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

using PfmFile = TemporaryFolderTest;

bool AreEqualBitForBit(const cv::Mat& a, const cv::Mat& b) {
  return a.type() == b.type() && a.size() == b.size() && a.isContinuous() && b.isContinuous() &&
         std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0;
}

TEST_F(PfmFile, HasItsBottomRowFirst) {
  WritePfm(folder_ / "a.pfm", cv::Mat_<float>({2, 1}, {1.0F, 2.0F}));
  EXPECT_EQ(ReadText(folder_ / "a.pfm"), std::string("Pf\n1 2\n-1.0\n\0\0\0\x40\0\0\x80\x3F", 20));
}

TEST_F(PfmFile, SurvivesWritingAndReading) {
  for (const int type : {CV_32FC1, CV_32FC3}) {
    for (const cv::Size size : {cv::Size(1, 1), cv::Size(17, 33), cv::Size(64, 5)}) {
      cv::Mat image(size, type);
      cv::RNG(7).fill(image, cv::RNG::NORMAL, 0, 1e3);
      image.ptr<float>(0)[0] = std::numeric_limits<float>::infinity();
      WritePfm(folder_ / "a.pfm", image);
      EXPECT_TRUE(AreEqualBitForBit(ReadPfm(folder_ / "a.pfm"), image)) << size << type;
    }
  }
}

TEST_F(PfmFile, WritesAPartOfAnImage) {
  const cv::Mat whole = cv::Mat_<float>({2, 3}, {1.0F, 2.0F, 3.0F, 4.0F, 5.0F, 6.0F});
  const cv::Mat part = whole.colRange(1, 3);
  WritePfm(folder_ / "a.pfm", part);
  EXPECT_TRUE(AreEqualBitForBit(ReadPfm(folder_ / "a.pfm"), part.clone()));
}

TEST_F(PfmFile, ReadsBigEndian) {
  const auto path = WriteText("a.pfm", std::string("Pf\n1 2\n1.0\n\x40\0\0\0\x3F\x80\0\0", 20));
  EXPECT_TRUE(AreEqualBitForBit(ReadPfm(path), cv::Mat_<float>({2, 1}, {1.0F, 2.0F})));
}

TEST_F(PfmFile, RefusesOtherFiles) {
  struct Case {
    const char* text;
    const char* message;
  };
  const Case cases[] = {
      {"P5 1 1 255 x", "a.pfm: not a PFM file"},
      {"Pf\n0 1\n-1.0\n", "bad image size in the header (expected 1 to 32767"},
      {"Pf\n99999999 99999999\n-1.0\n", "bad image size in the header"},
      {"Pf\n1 1\n0\n", "bad scale in the header (expected a number, found 0)"},
      {"Pf", "bad image size in the header"},
      {"Pf\n1 1\n-1.0", "file ends too early"},
      {"Pf\n1 1\n-1.0\nabc", "file ends too early (expected 16 bytes, found 15)"}};
  for (const Case& c : cases) {
    EXPECT_THAT([&] { ReadPfm(WriteText("a.pfm", c.text)); },
                ThrowsMessage<Error>(HasSubstr(c.message)));
  }
}

TEST_F(PfmFile, RefusesOtherImages) {
  EXPECT_THAT([&] { WritePfm(folder_ / "a.pfm", cv::Mat(2, 2, CV_8UC1, cv::Scalar(0))); },
              ThrowsMessage<Error>(HasSubstr("found CV_8UC1")));
  EXPECT_THAT([&] { WritePfm(folder_ / "a.pfm", cv::Mat()); },
              ThrowsMessage<Error>(HasSubstr("found an empty image")));
}

}  // namespace
}  // namespace mono3d
