// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/plane_sweep.h"

#include <Eigen/Geometry>

#include "depth/stage_testing.h"
#include "reference/depth/plane_sweep_reference.h"

namespace mono3d {
namespace {

using Projections = std::array<SourceProjection, kNumSources>;

// Positions are rounded to whole or half pixels: where one lies within rounding of a border between
// two, float and double may differ, and no two drivers need agree on the last bit of a division.
constexpr double kLargestShareOfOtherRounding = 0.002;

std::vector<std::uint8_t> SweepOnDevice(const reference::CensusImages& census,
                                        const Projections& projections,
                                        const PlaneSweepParams& params) {
  const LevelSize size{params.width_px, params.height_px};
  const std::size_t plane = size.num_strided_pixels();
  std::vector<std::uint32_t> words(2 * plane * census.size());
  for (std::size_t i = 0; i < census.size(); ++i) {
    for (std::size_t p = 0; p < size.num_pixels(); ++p) {
      const std::size_t at =
          2 * (i * plane + p / size.width_px * 4 * size.groups_per_row() + p % size.width_px);
      words[at] = static_cast<std::uint32_t>(census[i][p]);
      words[at + 1] = static_cast<std::uint32_t>(census[i][p] >> 32);
    }
  }
  std::vector<float> numbers;
  for (const SourceProjection& projection : projections) {
    for (int i = 0; i < 9; ++i) numbers.push_back(static_cast<float>(projection.A(i / 3, i % 3)));
    for (int i = 0; i < 3; ++i) numbers.push_back(static_cast<float>(projection.b(i)));
  }
  const std::size_t num_costs = size.num_pixels() * params.padded_planes;
  const Buffer costs = MakeBuffer<std::uint8_t>(num_costs);
  Recorder recorder(TestDevice());
  PlaneSweepStage(TestDevice()).Record(recorder, params, ToBuffer(words), ToBuffer(numbers), costs);
  recorder.Submit();
  return FirstOf<std::uint8_t>(costs, num_costs);
}

reference::CensusImages RandomCensus(std::size_t num_images, std::size_t num_pixels,
                                     std::mt19937& random) {
  reference::CensusImages census(num_images, std::vector<std::uint64_t>(num_pixels));
  std::uniform_int_distribution<std::uint64_t> bits(0, (std::uint64_t{1} << 62) - 1);
  for (auto& image : census) {
    for (auto& pixel : image) pixel = bits(random);
  }
  return census;
}

// Cameras on a line, turned a little, one of them beyond the near planes.
Projections CamerasOnALine(LevelSize size) {
  Projections projections;
  const double f = 0.9 * size.width_px;
  Eigen::Matrix3d K;
  K << f, 0, 0.5 * size.width_px, 0, f, 0.5 * size.height_px, 0, 0, 1;
  const std::array<double, kNumSources> places = {-0.2, -0.1, 0.1, 0.2};
  for (std::size_t i = 0; i < kNumSources; ++i) {
    const Eigen::Matrix3d R =
        Eigen::AngleAxisd(0.2 * places[i], Eigen::Vector3d(0.1, 1, 0.3).normalized())
            .toRotationMatrix();
    projections[i] = {K * R * K.inverse(), K * Eigen::Vector3d(places[i], 0.02, 4 * places[i])};
  }
  return projections;
}

PlaneSweepParams Params(LevelSize size, std::uint32_t positions_per_px) {
  return {.width_px = size.width_px,
          .height_px = size.height_px,
          .num_planes = 29,
          .padded_planes = 32,
          .positions_per_px = positions_per_px,
          .inverse_depth = 0.f,
          .inverse_depth_step = 0.06f};
}

TEST(PlaneSweep, EqualsReferenceButForRounding) {
  std::mt19937 random = SeededByTestName();
  for (const LevelSize size : kSmallSizes) {
    for (const std::uint32_t positions : {1u, 2u}) {
      const auto census = RandomCensus(1 + 4 * positions * positions, size.num_pixels(), random);
      const Projections projections = CamerasOnALine(size);
      const PlaneSweepParams params = Params(size, positions);
      const auto expected = reference::PlaneSweep(census, projections, params);
      const auto found = SweepOnDevice(census, projections, params);
      std::size_t num_different = 0;
      for (std::size_t i = 0; i < found.size(); ++i) num_different += found[i] != expected[i];
      EXPECT_LE(static_cast<double>(num_different),
                kLargestShareOfOtherRounding * static_cast<double>(found.size()));
    }
  }
}

// Each source shows the census of one pixel everywhere, so the cost of any pixel that all see is
// known.
std::vector<std::uint8_t> CostsOfOnePixel(const std::array<std::uint64_t, 5>& bits,
                                          const Projections& projections) {
  reference::CensusImages census;
  for (const std::uint64_t b : bits) census.push_back({b});
  const PlaneSweepParams params = Params({1, 1}, 1);
  return SweepOnDevice(census, projections, params);
}

TEST(PlaneSweep, TakesTheSmallerSideNormalisedByItsNumberOfProjections) {
  const SourceProjection same{Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
  const SourceProjection away{Eigen::Matrix3d::Identity(), Eigen::Vector3d(1e9, 0, 0)};
  // Distances 3 and 4 before, 7 and 1 after.
  const std::array<std::uint64_t, 5> bits = {0, 0b111, 0b1111, 0b1111111, 0b1};
  // At plane 0 all see the pixel; from plane 1 on those that are away do not.
  const auto all = CostsOfOnePixel(bits, {same, same, same, same});
  EXPECT_EQ(all[1], 3 + 4);
  const auto one_after = CostsOfOnePixel(bits, {same, same, away, same});
  EXPECT_EQ(one_after[0], 3 + 4);
  EXPECT_EQ(one_after[1], 2 * 1);
  const auto only_before = CostsOfOnePixel(bits, {away, same, away, away});
  EXPECT_EQ(only_before[1], 2 * 4);
  const auto none = CostsOfOnePixel(bits, {away, away, away, away});
  EXPECT_EQ(none[1], 255);
  EXPECT_EQ(all[29], 255);  // beyond the last plane
}

}  // namespace
}  // namespace mono3d
