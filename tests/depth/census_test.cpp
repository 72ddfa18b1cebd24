// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/fine_testing.h"
#include "depth/stage_testing.h"
#include "reference/depth/census_reference.h"

namespace mono3d {
namespace {

std::vector<std::uint64_t> CensusOnDevice(const std::vector<cv::Mat>& images,
                                          std::uint32_t quarter_turns = 0) {
  const LevelSize size{static_cast<std::uint32_t>(images[0].cols),
                       static_cast<std::uint32_t>(images[0].rows)};
  const std::size_t plane = size.num_strided_pixels();
  const Buffer census = MakeBuffer<std::uint32_t>(2 * plane * images.size());
  Recorder recorder(TestDevice());
  TestKernels().Census(recorder, ImagesToBuffer(images), size,
                       static_cast<std::uint32_t>(images.size()), quarter_turns, census);
  recorder.Submit();
  const auto words = census.Download<std::uint32_t>();
  std::vector<std::uint64_t> result;
  for (std::size_t i = 0; i < images.size(); ++i) {
    for (std::size_t p = 0; p < size.num_pixels(); ++p) {
      const std::size_t at =
          i * plane + p / size.width_px * 4 * size.groups_per_row() + p % size.width_px;
      result.push_back(words[2 * at] | std::uint64_t{words[2 * at + 1]} << 32);
    }
  }
  return result;
}

TEST(CensusTransform, FindsTheDarkerNeighboursOfATinyImage) {
  // The middle pixel sees 5 to its left and, repeated, all of the columns further left; 9 and 8 are
  // not darker. Columns -4 .. -1 of each of seven rows: bits 0..3, 9..12, 18..21, 27..30, and one
  // less from the centre's row on: 35..38, 44..47, 53..56.
  const cv::Mat image = (cv::Mat_<std::uint8_t>(1, 3) << 5, 8, 9);
  std::uint64_t expected = 0;
  for (const int first : {0, 9, 18, 27, 35, 44, 53}) expected |= std::uint64_t{0xf} << first;
  EXPECT_EQ(reference::Census(image)[1], expected);
  EXPECT_EQ(CensusOnDevice({image})[1], expected);
}

// One image for each number of quarter turns.
constexpr unsigned kNumTurns = 4;
constexpr std::uint32_t kTurnsOfImages = 0b11'10'01'00;

TEST(CensusTransform, EqualsReferenceBitForBit) {
  std::mt19937 random = SeededByTestName();
  for (const LevelSize size : kSizes) {
    std::vector<cv::Mat> images;
    std::vector<std::uint64_t> expected;
    for (unsigned turns = 0; turns < kNumTurns; ++turns) {
      images.push_back(RandomImage(size, random));
      const std::vector<std::uint64_t> of_image = reference::Census(images.back(), turns);
      expected.insert(expected.end(), of_image.begin(), of_image.end());
    }
    EXPECT_EQ(CensusOnDevice(images, kTurnsOfImages), expected)
        << size.width_px << "x" << size.height_px;
  }
}

TEST(FineCensus, EqualsReferenceBitForBit) {
  std::mt19937 random = SeededByTestName();
  for (const LevelSize size : kSizes) {
    std::vector<cv::Mat> images;
    reference::FineCensus expected;
    for (unsigned turns = 0; turns < kNumTurns; ++turns) {
      images.push_back(RandomImage(size, random));
      expected.push_back(reference::HalfCensus(images.back(), turns));
    }
    const Buffer census = MakeBuffer<std::uint32_t>(kNumTurns * 2 * NumFineCensusTexels(size));
    Recorder recorder(TestDevice());
    TestKernels().FineCensus(recorder, ImagesToBuffer(images), size, kNumTurns, kTurnsOfImages,
                             census);
    recorder.Submit();
    EXPECT_EQ(FineCensusOf(census, size, kNumTurns), expected)
        << size.width_px << "x" << size.height_px;
  }
}

// The same surface in a picture that is turned clockwise has the same bits.
TEST(CensusTransform, FollowsThePictureThroughQuarterTurns) {
  std::mt19937 random = SeededByTestName();
  const cv::Mat image = RandomImage({24, 17}, random);
  const auto upright = reference::Census(image);
  const auto upright_half = reference::HalfCensus(image);
  cv::Mat turned = image;
  cv::Point at(9, 7);
  for (unsigned turns = 1; turns < kNumTurns; ++turns) {
    at = {turned.rows - 1 - at.y, at.x};
    cv::rotate(turned.clone(), turned, cv::ROTATE_90_CLOCKWISE);
    const auto pixel = static_cast<std::size_t>(at.y * turned.cols + at.x);
    EXPECT_EQ(CensusOnDevice({turned}, turns)[pixel], upright[7 * 24 + 9]) << turns;
    EXPECT_EQ(reference::HalfCensus(turned, turns)[pixel], upright_half[7 * 24 + 9]) << turns;
  }
}

TEST(CensusTransform, DoesNotSeeBrightnessAndContrast) {
  std::mt19937 random = SeededByTestName();
  const cv::Mat image = RandomImage({40, 30}, random) / 4;  // 0 to 63, so that nothing saturates
  EXPECT_EQ(CensusOnDevice({image}), CensusOnDevice({3 * image + 20}));
}

}  // namespace
}  // namespace mono3d
