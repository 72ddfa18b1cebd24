// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/stage_testing.h"
#include "reference/depth/winner_takes_all_reference.h"

namespace mono3d {
namespace {

// Float against double: a few roundings.
constexpr float kRelativeTolerance = 1e-5f;
constexpr float kUniquenessTolerance = 1e-6f;

constexpr WinnerTakesAllParams kWinnerParams{.width_px = 1,
                                             .height_px = 1,
                                             .num_planes = 14,
                                             .padded_planes = 16,
                                             .max_cost = 70,
                                             .min_uniqueness = 0.05f,
                                             .inverse_depth = 0.5f,
                                             .inverse_depth_step = 0.25f};

reference::Winners WinnersOnDevice(const std::vector<std::uint16_t>& sums,
                                   const std::vector<std::uint8_t>& costs,
                                   const WinnerTakesAllParams& params, bool sub_plane = true) {
  const std::size_t num_pixels = std::size_t{params.width_px} * params.height_px;
  const Buffer inverse_depth = MakeBuffer<float>(num_pixels);
  const Buffer uniqueness = MakeBuffer<float>(num_pixels);
  Recorder recorder(TestDevice());
  TestKernels().WinnerTakesAll(recorder, sub_plane, params, ToBuffer(sums), ToBuffer(costs),
                               {inverse_depth, uniqueness});
  recorder.Submit();
  return {FirstOf<float>(inverse_depth, num_pixels), FirstOf<float>(uniqueness, num_pixels)};
}

// One pixel of 14 planes at 400, but for the given ones.
reference::Winners OnePixel(std::initializer_list<std::pair<std::size_t, std::uint16_t>> sums,
                            std::uint8_t cost = 30, bool sub_plane = true) {
  std::vector<std::uint16_t> all(16, 400);
  all[14] = all[15] = 2000;
  for (const auto& [plane, sum] : sums) all[plane] = sum;
  return WinnersOnDevice(all, std::vector<std::uint8_t>(16, cost), kWinnerParams, sub_plane);
}

TEST(WinnerTakesAll, LiesOnTheParabolaThroughTheNeighbours) {
  // 300 100 200: offset (300 - 200) / (2 (300 - 200 + 200)) = 1 / 6; the runner-up has 400.
  const auto winners = OnePixel({{4, 300}, {5, 100}, {6, 200}});
  EXPECT_FLOAT_EQ(winners.inverse_depth[0], 0.5f + (5 + 1.f / 6) * 0.25f);
  EXPECT_FLOAT_EQ(winners.uniqueness[0], 0.75f);
}

TEST(WinnerTakesAll, LiesOnThePlaneWhereThatIsWanted) {
  const auto winners = OnePixel({{4, 300}, {5, 100}, {6, 200}}, 30, false);
  EXPECT_EQ(winners.inverse_depth[0], 0.5f + 5 * 0.25f);
  EXPECT_FLOAT_EQ(winners.uniqueness[0], 0.75f);
}

TEST(WinnerTakesAll, RefusesBordersBadMatchesAndDoubles) {
  EXPECT_GT(OnePixel({{12, 100}}).inverse_depth[0], 0);
  EXPECT_EQ(OnePixel({{0, 100}}).inverse_depth[0], 0);
  EXPECT_EQ(OnePixel({{13, 100}}).inverse_depth[0], 0);
  EXPECT_EQ(OnePixel({{5, 100}}, 71).inverse_depth[0], 0);
  EXPECT_EQ(OnePixel({{5, 100}, {9, 103}}).inverse_depth[0], 0);
  EXPECT_EQ(OnePixel({}).inverse_depth[0], 0);  // all planes alike
}

TEST(WinnerTakesAll, EqualsReference) {
  std::mt19937 random = SeededByTestName();
  for (const LevelSize size : kSmallSizes) {
    WinnerTakesAllParams params = kWinnerParams;
    params.width_px = size.width_px;
    params.height_px = size.height_px;
    std::vector<std::uint16_t> sums(size.num_pixels() * params.padded_planes);
    for (auto& sum : sums) sum = static_cast<std::uint16_t>(random() % 600);
    std::vector<std::uint8_t> costs(sums.size());
    for (auto& cost : costs) cost = static_cast<std::uint8_t>(random() % 100);
    const auto expected = reference::WinnerTakesAll(sums, costs, params);
    const auto found = WinnersOnDevice(sums, costs, params);
    for (std::size_t i = 0; i < size.num_pixels(); ++i) {
      ASSERT_NEAR(found.inverse_depth[i], expected.inverse_depth[i],
                  kRelativeTolerance * expected.inverse_depth[i]);
      ASSERT_NEAR(found.uniqueness[i], expected.uniqueness[i], kUniquenessTolerance);
    }
  }
}

}  // namespace
}  // namespace mono3d
