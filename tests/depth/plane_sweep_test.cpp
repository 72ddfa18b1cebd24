// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <Eigen/Geometry>

#include "depth/stage_testing.h"
#include "reference/depth/plane_sweep_reference.h"

namespace mono3d {
namespace {

// Positions are rounded to whole pixels: where one lies within rounding of a border between
// two, float and double may differ, and no two drivers need agree on the last bit of a division.
constexpr double kMaxShareOfOtherRounding = 0.002;

std::vector<std::uint8_t> SweepOnDevice(const reference::CensusImages& census,
                                        const SourceProjections& projections,
                                        const PlaneSweepParams& params,
                                        std::uint32_t side_tolerance = 0) {
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
  const std::size_t num_costs = size.num_pixels() * params.padded_planes;
  const Buffer costs = MakeBuffer<std::uint8_t>(num_costs);
  Recorder recorder(TestDevice());
  TestKernels().PlaneSweep(recorder, {projections.size(), int(side_tolerance)}, params,
                           ToBuffer(words), ToBuffer(Pack(projections, size)), costs);
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
SourceProjections CamerasOnALine(LevelSize size, std::size_t num_sources) {
  SourceProjections projections;
  const double f = 0.9 * size.width_px;
  Eigen::Matrix3d K;
  K << f, 0, 0.5 * size.width_px, 0, f, 0.5 * size.height_px, 0, 0, 1;
  const int num_per_side = static_cast<int>(num_sources / 2);
  for (int i = -num_per_side; i <= num_per_side; ++i) {
    if (i == 0) continue;  // the reference
    const double place = 0.2 * i / num_per_side;
    const Eigen::Matrix3d R =
        Eigen::AngleAxisd(0.2 * place, Eigen::Vector3d(0.1, 1, 0.3).normalized())
            .toRotationMatrix();
    projections.push_back({K * R * K.inverse(), K * Eigen::Vector3d(place, 0.02, 4 * place)});
  }
  return projections;
}

PlaneSweepParams Params(LevelSize size) {
  return {.width_px = size.width_px,
          .height_px = size.height_px,
          .num_planes = 29,
          .padded_planes = 32,
          .inverse_depth = 0.f,
          .inverse_depth_step = 0.06f};
}

void ExpectPlaneSweepEqualsReference(LevelSize size, const SourceProjections& projections,
                                     std::uint32_t tolerance, std::mt19937& random) {
  const auto census = RandomCensus(1 + projections.size(), size.num_pixels(), random);
  const PlaneSweepParams params = Params(size);
  const auto expected = reference::PlaneSweep(census, projections, params, int(tolerance));
  const auto found = SweepOnDevice(census, projections, params, tolerance);
  std::size_t num_different = 0;
  for (std::size_t i = 0; i < found.size(); ++i) num_different += found[i] != expected[i];
  EXPECT_LE(static_cast<double>(num_different),
            kMaxShareOfOtherRounding * static_cast<double>(found.size()));
}

TEST(PlaneSweep, EqualsReferenceButForRounding) {
  std::mt19937 random = SeededByTestName();
  for (const LevelSize size : kSmallSizes) {
    for (const std::uint32_t tolerance : {7u, 0u}) {
      for (const std::size_t num_sources : {2, 4, 6, 8}) {
        ExpectPlaneSweepEqualsReference(size, CamerasOnALine(size, num_sources), tolerance, random);
      }
    }
  }
}

TEST(PlaneSweep, EqualsReferenceWithImagesThatShowAPart) {
  std::mt19937 random = SeededByTestName();
  for (const std::size_t num_sources : {2, 8}) {
    SourceProjections projections = CamerasOnALine(kSmallSizes[1], num_sources);
    SetBounds(kSmallSizes[1], projections);
    ExpectPlaneSweepEqualsReference(kSmallSizes[1], projections, 7, random);
  }
}

// As IndicesOfSources has it for a bundle with fewer images on one side.
TEST(PlaneSweep, EqualsReferenceWithSourcesThatSeeNothing) {
  std::mt19937 random = SeededByTestName();
  for (const std::size_t num_sources : {2, 4, 8}) {
    SourceProjections projections = CamerasOnALine(kSmallSizes[0], num_sources);
    projections.back() = {Eigen::Vector3d(0, 0, -1).asDiagonal(), Eigen::Vector3d::Zero()};
    ExpectPlaneSweepEqualsReference(kSmallSizes[0], projections, 7, random);
  }
}

// Each source shows the census of one pixel everywhere, so the cost of any pixel that all see is
// known.
std::vector<std::uint8_t> CostsOfOnePixel(const std::vector<std::uint64_t>& bits,
                                          const SourceProjections& projections,
                                          std::uint32_t side_tolerance = 0) {
  reference::CensusImages census;
  for (const std::uint64_t b : bits) census.push_back({b});
  const PlaneSweepParams params = Params({1, 1});
  return SweepOnDevice(census, projections, params, side_tolerance);
}

TEST(PlaneSweep, TakesTheSmallerSideNormalisedByItsNumberOfProjections) {
  const SourceProjection same{Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
  const SourceProjection away{Eigen::Matrix3d::Identity(), Eigen::Vector3d(1e9, 0, 0)};
  // Distances 3 and 4 before, 7 and 1 after.
  const std::vector<std::uint64_t> bits = {0, 0b111, 0b1111, 0b1111111, 0b1};
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

TEST(PlaneSweep, TakesTwiceTheMeanOfOneThreeAndFourSourcesASide) {
  const SourceProjection same{Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
  const SourceProjection away{Eigen::Matrix3d::Identity(), Eigen::Vector3d(1e9, 0, 0)};
  const std::uint64_t all_bits = (std::uint64_t{1} << 62) - 1;
  // Distances 3 before and 7 after.
  const auto of_two = CostsOfOnePixel({0, 0b111, 0b1111111}, {same, away});
  EXPECT_EQ(of_two[0], 2 * 3);
  EXPECT_EQ(CostsOfOnePixel({0, 0b111, 0b1111111}, {away, same})[1], 2 * 7);
  // 3, 4 and 1 before, 62 each after: 2 * 8 / 3 is rounded.
  const std::vector<std::uint64_t> six = {0, 0b111, 0b1111, 0b1, all_bits, all_bits, all_bits};
  EXPECT_EQ(CostsOfOnePixel(six, {same, same, same, same, same, same})[1], 5);
  EXPECT_EQ(CostsOfOnePixel(six, {away, same, same, same, same, same})[1], 4 + 1);
  EXPECT_EQ(CostsOfOnePixel(six, {away, away, away, same, same, same})[1], 124);
  // 3, 4, 1 and 1 before, 2 * 9 / 4 is rounded up; then two of them, then one.
  const std::vector<std::uint64_t> eight = {0,        0b111,    0b1111,   0b1,     0b1,
                                            all_bits, all_bits, all_bits, all_bits};
  EXPECT_EQ(CostsOfOnePixel(eight, SourceProjections(8, same))[1], 5);
  EXPECT_EQ(CostsOfOnePixel(eight, {away, same, same, away, same, same, same, same})[1], 4 + 1);
  EXPECT_EQ(CostsOfOnePixel(eight, {away, same, away, away, same, same, same, same})[1], 2 * 4);
  EXPECT_EQ(CostsOfOnePixel(eight, SourceProjections(8, away))[1], 255);
}

TEST(PlaneSweep, TakesTheMeanOfTheSidesWithinTheTolerance) {
  const SourceProjection same{Eigen::Matrix3d::Identity(), Eigen::Vector3d::Zero()};
  const SourceProjection away{Eigen::Matrix3d::Identity(), Eigen::Vector3d(1e9, 0, 0)};
  // Distances 3 and 4 before, 12 and 1 after: half the difference is 3.
  const std::vector<std::uint64_t> bits = {0, 0b111, 0b1111, 0xfff, 0b1};
  EXPECT_EQ(CostsOfOnePixel(bits, {same, same, same, same}, 62)[1], 7 + 3);
  EXPECT_EQ(CostsOfOnePixel(bits, {same, same, same, same}, 3)[1], 7 + 3);
  EXPECT_EQ(CostsOfOnePixel(bits, {same, same, same, same}, 2)[1], 7 + 2);
  EXPECT_EQ(CostsOfOnePixel(bits, {same, same, away, away}, 62)[1], 7);
  EXPECT_EQ(CostsOfOnePixel(bits, {away, away, away, same}, 62)[1], 2);
  EXPECT_EQ(CostsOfOnePixel(bits, {away, away, away, away}, 62)[1], 255);
}

}  // namespace
}  // namespace mono3d
