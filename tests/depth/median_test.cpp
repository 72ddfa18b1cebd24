// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/stage_testing.h"
#include "reference/depth/median_reference.h"
#include "reference/depth/upsample_reference.h"

namespace mono3d {
namespace {

// Sums of 25 floats in one order or another; products of a few.
constexpr float kRoundingTolerance = 1e-5f;

reference::FilteredDepth MedianOnDevice(const std::vector<float>& inverse_depth,
                                        const std::vector<float>& confidence,
                                        const MedianParams& params) {
  const std::size_t num_pixels = inverse_depth.size();
  const Buffer median_depth = MakeBuffer<float>(num_pixels);
  const Buffer median_confidence = MakeBuffer<float>(num_pixels);
  Recorder recorder(TestDevice());
  TestKernels().Median(recorder, true, params, {ToBuffer(inverse_depth), ToBuffer(confidence)},
                       {median_depth, median_confidence});
  recorder.Submit();
  return {FirstOf<float>(median_depth, num_pixels), FirstOf<float>(median_confidence, num_pixels)};
}

TEST(Median, EqualsReferenceBitForBit) {
  std::mt19937 random = SeededByTestName();
  for (const LevelSize size : kSizes) {
    for (const double share_missing : {0.0, 0.4, 0.9}) {
      const auto depth = RandomValues(size.num_pixels(), 1, 2, share_missing, random);
      const auto confidence = RandomValues(size.num_pixels(), 0, 1, 0, random);
      const MedianParams params{size.width_px, size.height_px, 5, 0.3f};
      const auto expected = reference::Median5x5(depth, confidence, params);
      const auto found = MedianOnDevice(depth, confidence, params);
      EXPECT_EQ(found.inverse_depth, expected.inverse_depth);
      for (std::size_t i = 0; i < depth.size(); ++i) {
        ASSERT_NEAR(found.confidence[i], expected.confidence[i], kRoundingTolerance);
      }
    }
  }
}

TEST(Median, RemovesASpeckleAndFillsAHole) {
  const MedianParams params{9, 9, 13, 0.1f};
  std::vector<float> depth(81, 1.f);
  depth[4 * 9 + 4] = 3.f;
  EXPECT_EQ(MedianOnDevice(depth, depth, params).inverse_depth[4 * 9 + 4], 1.f);
  depth[4 * 9 + 4] = 0.f;
  EXPECT_EQ(MedianOnDevice(depth, depth, params).inverse_depth[4 * 9 + 4], 1.f);
  std::vector<float> lonely(81, 0.f);
  lonely[4 * 9 + 4] = 1.f;
  EXPECT_EQ(MedianOnDevice(lonely, lonely, params).inverse_depth, std::vector<float>(81, 0.f));
}

TEST(Upsample, EqualsReference) {
  std::mt19937 random = SeededByTestName();
  for (const std::uint32_t factor : {2u, 4u}) {
    const LevelSize coarse{9, 7};
    const LevelSize full{9 * factor - 1, 7 * factor - 1};
    const UpsampleParams params{coarse.width_px, coarse.height_px, full.width_px,
                                full.height_px,  factor,           0.3f};
    const reference::FilteredDepth input = {RandomValues(coarse.num_pixels(), 1, 2, 0.2, random),
                                            RandomValues(coarse.num_pixels(), 0, 1, 0, random)};
    const Buffer depth = MakeBuffer<float>(full.num_pixels());
    const Buffer confidence = MakeBuffer<float>(full.num_pixels());
    Recorder recorder(TestDevice());
    TestKernels().Upsample(recorder, params,
                           {ToBuffer(input.inverse_depth), ToBuffer(input.confidence)},
                           {depth, confidence});
    recorder.Submit();
    const auto expected = reference::Upsample(input, params);
    const auto found_depth = FirstOf<float>(depth, full.num_pixels());
    const auto found_confidence = FirstOf<float>(confidence, full.num_pixels());
    for (std::size_t i = 0; i < full.num_pixels(); ++i) {
      ASSERT_NEAR(found_depth[i], expected.inverse_depth[i], kRoundingTolerance);
      ASSERT_NEAR(found_confidence[i], expected.confidence[i], kRoundingTolerance);
    }
  }
}

}  // namespace
}  // namespace mono3d
