// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/fine_testing.h"
#include "reference/depth/fine_sweep_reference.h"
#include "reference/depth/prior_reference.h"

namespace mono3d {
namespace {

using reference::FineRange;

// Where a position lies within rounding of a border between two planes, float and double may
// differ.
constexpr double kMaxShareOfOtherPlanes = 0.005;
// Projections are interpolated over the planes, which are a pixel apart: some more are rounded to
// another pixel.
constexpr double kMaxShareOfOtherPixels = 0.03;

constexpr LevelSize kCoarse{21, 15};
constexpr LevelSize kFine{41, 30};
constexpr PriorParams kPriorParams{.coarse_width_px = kCoarse.width_px,
                                   .coarse_height_px = kCoarse.height_px,
                                   .width_px = kFine.width_px,
                                   .height_px = kFine.height_px,
                                   .num_planes = 80,
                                   .fx = 20,
                                   .fy = 21,
                                   .cx = 10,
                                   .cy = 7,
                                   .inverse_depth = 0.4f,
                                   .inverse_depth_step = 0.01f,
                                   .follow_normals = 1};

// Where a stage reads or writes nothing else.
FineVolumes OnlyRanges(const Buffer& ranges) { return {ranges, ranges, ranges, ranges}; }

std::vector<FineRange> PriorOnDevice(const std::vector<float>& depth,
                                     const std::vector<Eigen::Vector3f>& normals,
                                     const cv::Mat& grey) {
  std::vector<float> numbers;
  for (const Eigen::Vector3f& n : normals) numbers.insert(numbers.end(), {n.x(), n.y(), n.z()});
  const Buffer ranges = MakeBuffer<std::uint32_t>(2 * NumFinePixels(kFine));
  Recorder recorder(TestDevice());
  TestKernels().Prior(recorder, kPriorParams, ToBuffer(depth), ToBuffer(numbers),
                      ImagesToBuffer({grey}), OnlyRanges(ranges));
  recorder.Submit();
  return FineRangesOf(ranges, kFine);
}

TEST(Prior, EqualsReferenceButForRounding) {
  std::mt19937 random = SeededByTestName();
  const cv::Mat grey = RandomImage(kFine, random);
  std::uniform_real_distribution<float> tilt(-0.6f, 0.6f);
  for (const double share_missing : {0.0, 0.3, 1.0}) {
    // Below, within and above the grid of planes; with neighbours within reach and out of it.
    const auto depth = RandomValues(kCoarse.num_pixels(), 0.35f, 1.3f, share_missing, random);
    std::vector<Eigen::Vector3f> normals;
    for (std::size_t i = 0; i < depth.size(); ++i) {
      normals.push_back(Eigen::Vector3f(tilt(random), tilt(random), -1).normalized());
    }
    const auto expected = reference::Prior(depth, normals, grey, kPriorParams);
    const auto found = PriorOnDevice(depth, normals, grey);
    std::size_t num_different = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      EXPECT_EQ(found[i].grey, expected[i].grey);
      num_different += found[i].first_plane != expected[i].first_plane ||
                       found[i].narrow != expected[i].narrow || found[i].jumps != expected[i].jumps;
    }
    EXPECT_LE(double(num_different), kMaxShareOfOtherPlanes * double(found.size()));
  }
}

TEST(Prior, HoldsTheDepthsOfTheNeighbourhood) {
  // A step of eight planes down the middle: on both sides of it both depths are matched.
  const auto depth_at = [](std::size_t column) { return column < 10 ? 0.5f : 0.58f; };
  std::vector<float> depth;
  for (std::size_t i = 0; i < kCoarse.num_pixels(); ++i) {
    depth.push_back(depth_at(i % kCoarse.width_px));
  }
  const std::vector<Eigen::Vector3f> facing(depth.size(), {0, 0, -1});
  const auto ranges = PriorOnDevice(depth, facing, cv::Mat::zeros(30, 41, CV_8UC1));
  for (std::size_t i = 0; i < ranges.size(); ++i) {
    const int first = ranges[i].first_plane;
    const std::size_t column = i % kFine.width_px / 2;
    const bool at_step = column == 9 || column == 10;
    EXPECT_EQ(first <= 10 && first + 15 >= 18, at_step || (first <= 10 && first >= 3)) << i;
    const int own = column < 10 ? 10 : 18;
    EXPECT_TRUE(first + 3 <= own && own <= first + 13) << i;  // with room on both sides
  }
}

constexpr int kSideTolerance = 5;

struct SweepCase {
  std::size_t num_sources = 4;
  bool last_sees_nothing = false;  // as of a bundle with fewer images on one side
  bool with_bounds = false;
  bool with_turns = false;  // by one quarter more from source to source
};

void ExpectSweepEqualsReference(const SweepCase& sweep, std::mt19937& random) {
  const std::size_t num_sources = sweep.num_sources;
  reference::FineCensus census(1 + num_sources);
  for (auto& image : census) {
    for (std::size_t p = 0; p < kFine.num_pixels(); ++p) {
      image.push_back(static_cast<std::uint32_t>(random()));
    }
  }
  // Cameras on a line that also moves forward a little, a pixel a plane at the ends.
  SourceProjections projections;
  const int num_per_side = static_cast<int>(num_sources / 2);
  for (int i = -num_per_side; i <= num_per_side; ++i) {
    const double place = 2.0 * i / num_per_side;
    if (i == 0) continue;  // the reference
    projections.push_back(
        {Eigen::Matrix3d::Identity(), Eigen::Vector3d(50 * place + 2, 3 * place, 0.01 * place)});
  }
  if (sweep.last_sees_nothing) {
    projections.back() = {Eigen::Vector3d(0, 0, -1).asDiagonal(), Eigen::Vector3d::Zero()};
  }
  if (sweep.with_bounds) SetBounds(kFine, projections);
  for (unsigned i = 0; i < projections.size() && sweep.with_turns; ++i) {
    projections[i].quarter_turns = (i + 1) % 4;
  }
  const FineSweepParams params{.width_px = kFine.width_px,
                               .height_px = kFine.height_px,
                               .inverse_depth = 0,
                               .inverse_depth_step = 0.01f,
                               .quarter_turns = PackQuarterTurns(projections)};
  const auto ranges = RandomFineRanges(kFine, random);
  const Buffer costs = MakeBuffer<std::uint8_t>(kFinePlanes * NumFinePixels(kFine));
  Recorder recorder(TestDevice());
  TestKernels().FineSweep(recorder, {num_sources, kSideTolerance}, params,
                          FineToBuffer(census, kFine), ToBuffer(Pack(projections, kFine)),
                          {FineToBuffer(ranges, kFine), costs, costs, costs});
  recorder.Submit();
  const auto found = FineVolumeOf(costs, kFine, 0);
  const auto expected = reference::FineSweep(census, projections, ranges, params, kSideTolerance);
  std::size_t num_different = 0;
  for (std::size_t i = 0; i < found.size(); ++i) {
    for (std::size_t d = 0; d < 16; ++d) num_different += found[i][d] != expected[i][d];
  }
  EXPECT_LE(double(num_different), kMaxShareOfOtherPixels * 16 * double(found.size()));
}

TEST(FineSweep, EqualsReferenceButForRounding) {
  std::mt19937 random = SeededByTestName();
  for (const std::size_t num_sources : {2, 4, 8}) {
    for (const SweepCase& sweep : {SweepCase{.num_sources = num_sources},
                                   SweepCase{.num_sources = num_sources, .last_sees_nothing = true},
                                   SweepCase{.num_sources = num_sources, .with_bounds = true},
                                   SweepCase{.num_sources = num_sources, .with_turns = true}}) {
      ExpectSweepEqualsReference(sweep, random);
    }
  }
}

}  // namespace
}  // namespace mono3d
