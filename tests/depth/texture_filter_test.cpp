// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/stage_testing.h"
#include "reference/depth/dog_reference.h"

namespace mono3d {
namespace {

std::vector<std::uint32_t> ResponseOnDevice(const cv::Mat& grey) {
  const LevelSize size{static_cast<std::uint32_t>(grey.cols),
                       static_cast<std::uint32_t>(grey.rows)};
  const Buffer response = MakeBuffer<std::uint32_t>(size.num_strided_pixels());
  Recorder recorder(TestDevice());
  TestKernels().Dog(recorder, ImagesToBuffer({grey}), size, response);
  recorder.Submit();
  return WithoutStride(FirstOf<std::uint32_t>(response, size.num_strided_pixels()), size);
}

TEST(Dog, EqualsReferenceBitForBit) {
  std::mt19937 random = SeededByTestName();
  for (const LevelSize size : kSizes) {
    const cv::Mat grey = RandomImage(size, random);
    EXPECT_EQ(ResponseOnDevice(grey), reference::DogResponse(grey));
  }
}

TEST(Dog, OfASinglePixelIsTheDifferenceOfTheKernelsMiddles) {
  cv::Mat grey = cv::Mat::zeros(21, 21, CV_8UC1);
  grey.at<std::uint8_t>(10, 10) = 200;
  // 256 * 200 * (36 / 256 - 4900 / 65536).
  EXPECT_EQ(ResponseOnDevice(grey)[10 * 21 + 10], 3371u);
}

TEST(Dog, DoesNotSeeAConstantOrALinearImage) {
  cv::Mat ramp(30, 30, CV_8UC1);
  for (int y = 0; y < 30; ++y) {
    for (int x = 0; x < 30; ++x)
      ramp.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(3 * x + 4 * y);
  }
  EXPECT_EQ(ResponseOnDevice(ramp)[15 * 30 + 15], 0u);
}

TEST(TextureFilter, EqualsReferenceBitForBit) {
  std::mt19937 random = SeededByTestName();
  for (const LevelSize size : kSizes) {
    const int width = static_cast<int>(size.width_px);
    const int height = static_cast<int>(size.height_px);
    std::vector<std::uint32_t> response(size.num_strided_pixels());
    for (auto& r : response) r = static_cast<std::uint32_t>(random() % 1000);
    const auto inverse_depth = RandomValues(size.num_pixels(), 0.5f, 2, 0.2, random);
    const auto confidence = RandomValues(size.num_pixels(), 0, 1, 0, random);
    const TextureFilterParams params{size.width_px, size.height_px, 500 * 63};
    const Buffer depth = MakeBuffer<float>(size.num_pixels());
    const Buffer filtered = MakeBuffer<float>(size.num_pixels());
    Recorder recorder(TestDevice());
    TestKernels().TextureFilter(recorder, params, ToBuffer(response),
                                {ToBuffer(inverse_depth), ToBuffer(confidence)}, depth, filtered);
    recorder.Submit();
    const auto sums = reference::TextureSum(WithoutStride(response, size), width, height);
    const auto found = FirstOf<float>(depth, size.num_pixels());
    const auto found_confidence = FirstOf<float>(filtered, size.num_pixels());
    for (std::size_t i = 0; i < size.num_pixels(); ++i) {
      const bool valid = inverse_depth[i] > 0 && sums[i] >= params.min_response_sum;
      // A division may be off by a unit in the last place or two (Vulkan allows 2.5).
      ASSERT_FLOAT_EQ(found[i], valid ? 1 / inverse_depth[i] : 0.f);
      ASSERT_EQ(found_confidence[i], valid ? confidence[i] : 0.f);
    }
  }
}

}  // namespace
}  // namespace mono3d
