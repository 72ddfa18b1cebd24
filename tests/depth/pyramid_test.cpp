// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/stage_testing.h"
#include "reference/depth/pyramid_reference.h"

namespace mono3d {
namespace {

TEST(Pyramid, HalvesATinyImageAsByHand) {
  // One coarse pixel: its middle two pixels are those of the image, the outer taps repeat them.
  const cv::Mat image = (cv::Mat_<std::uint8_t>(2, 2) << 0, 64, 128, 192);
  const cv::Mat half = reference::Halve(image);
  ASSERT_EQ(half.size(), cv::Size(1, 1));
  EXPECT_EQ(half.at<std::uint8_t>(0), 96);  // the mean, by symmetry
}

TEST(Pyramid, EqualsReferenceBitForBit) {
  std::mt19937 random = SeededByTestName();
  Recorder recorder(TestDevice());
  for (const LevelSize size : kSizes) {
    const std::vector<cv::Mat> images = {RandomImage(size, random), RandomImage(size, random)};
    const Buffer fine = ImagesToBuffer(images);
    const Buffer coarse = MakeBuffer<std::uint32_t>(2 * PaddedWords(size.Halved()));
    TestKernels().Pyramid(recorder, fine, size, 2, coarse);
    recorder.Submit();
    for (std::size_t i = 0; i < 2; ++i) {
      const cv::Mat expected = reference::Halve(images[i]);
      EXPECT_TRUE(SameImage(ImageOf(coarse, size.Halved(), i), expected));
      // The padding too: it is what the next stage reads.
      std::vector<std::uint32_t> words(PaddedWords(size.Halved()));
      coarse.Download(std::span<std::uint32_t>(words), 4 * i * words.size());
      EXPECT_EQ(words, PackPadded(expected));
    }
  }
}

}  // namespace
}  // namespace mono3d
