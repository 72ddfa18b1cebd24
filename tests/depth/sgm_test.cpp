// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/sgm.h"

#include "depth/stage_testing.h"
#include "reference/depth/sgm_reference.h"

namespace mono3d {
namespace {

std::vector<std::uint16_t> SumsOnDevice(const std::vector<std::uint8_t>& costs, const cv::Mat& grey,
                                        std::uint32_t num_planes, const SgmOptions& options) {
  const LevelSize size{static_cast<std::uint32_t>(grey.cols),
                       static_cast<std::uint32_t>(grey.rows)};
  const Buffer sums = MakeBuffer<std::uint16_t>(costs.size());
  Recorder recorder(TestDevice());
  TestKernels().Sgm(recorder, size, num_planes, UploadPenalties(TestDevice(), options),
                    ImagesToBuffer({grey}), ToBuffer(costs), sums);
  recorder.Submit();
  return FirstOf<std::uint16_t>(sums, costs.size());
}

// `costs` with planes appended up to what the kernel takes, at the cost of an unseen point.
std::vector<std::uint8_t> Pad(const std::vector<std::uint8_t>& costs, std::size_t num_planes,
                              std::size_t padded_planes) {
  std::vector<std::uint8_t> padded;
  for (std::size_t first = 0; first < costs.size(); first += num_planes) {
    for (std::size_t d = 0; d < padded_planes; ++d) {
      padded.push_back(d < num_planes ? costs[first + d] : std::uint8_t{255});
    }
  }
  return padded;
}

TEST(Sgm, AggregatesThreePixelsAndThreePlanesAsByHand) {
  // A row of one grey value, P1 = 10, P2 = 100. Path costs from the left:
  //   0 20 50, then 40 10 70 (= 40 0 40 + 0 10 30), then, less the minimum of 10, 15 30 10.
  // From the right: 5 30 0, then 45 10 40, then 10 20 60. The six other directions have no pixel
  // before: the costs themselves.
  const std::vector<std::uint8_t> costs = {0, 20, 50, 40, 0, 40, 5, 30, 0};
  const cv::Mat grey = cv::Mat::zeros(1, 3, CV_8UC1);
  const SgmOptions options{.p1 = 10, .p2 = 100, .min_p2 = 20, .gradient = 8};
  const std::vector<std::uint16_t> expected = {0 + 10 + 6 * 0,   20 + 20 + 6 * 20, 50 + 60 + 6 * 50,
                                               40 + 45 + 6 * 40, 10 + 10 + 6 * 0,  70 + 40 + 6 * 40,
                                               15 + 5 + 6 * 5,   30 + 30 + 6 * 30, 10 + 0 + 6 * 0};
  EXPECT_EQ(reference::AggregateCosts(costs, grey, 3, options.p1, JumpPenalties(options)),
            expected);

  const std::uint32_t padded = TestKernels().PaddedPlanes(3);
  const auto found = SumsOnDevice(Pad(costs, 3, padded), grey, padded, options);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    EXPECT_EQ(found[i / 3 * padded + i % 3], expected[i]) << i;
  }
}

TEST(Sgm, EqualsReferenceBitForBit) {
  std::mt19937 random = SeededByTestName();
  const SgmOptions options;
  for (const LevelSize size :
       {LevelSize{1, 1}, LevelSize{17, 33}, LevelSize{70, 9}, LevelSize{1, 40}}) {
    for (const std::uint32_t num_planes : {3u, 40u, 100u, 256u}) {
      const std::uint32_t planes = TestKernels().PaddedPlanes(num_planes);
      const cv::Mat grey = RandomImage(size, random);
      std::vector<std::uint8_t> costs(size.num_pixels() * planes);
      for (auto& cost : costs) cost = static_cast<std::uint8_t>(random() % 256);
      EXPECT_EQ(SumsOnDevice(costs, grey, planes, options),
                reference::AggregateCosts(costs, grey, static_cast<int>(planes), options.p1,
                                          JumpPenalties(options)))
          << size.width_px << "x" << size.height_px << ", " << planes << " planes";
    }
  }
}

TEST(Sgm, UnseenPlanesNeverBeatSeenOnes) {
  // All but one plane unseen at each pixel, and not the same one: every jump is paid, and still the
  // seen plane has the smallest sum.
  std::mt19937 random = SeededByTestName();
  const SgmOptions options{.p1 = 10, .p2 = 130, .min_p2 = 130, .gradient = 8};
  const LevelSize size{20, 20};
  const std::uint32_t planes = TestKernels().PaddedPlanes(32);
  std::vector<std::uint8_t> costs(size.num_pixels() * planes, 255);
  std::vector<std::size_t> seen;
  for (std::size_t pixel = 0; pixel < size.num_pixels(); ++pixel) {
    seen.push_back(random() % planes);
    costs[pixel * planes + seen.back()] = 124;
  }
  const auto sums = SumsOnDevice(costs, RandomImage(size, random), planes, options);
  for (std::size_t pixel = 0; pixel < size.num_pixels(); ++pixel) {
    const auto first = sums.begin() + static_cast<std::ptrdiff_t>(pixel * planes);
    const auto best = std::min_element(first, first + planes) - first;
    EXPECT_EQ(static_cast<std::size_t>(best), seen[pixel]);
  }
}

TEST(Sgm, PenaltyFallsWithTheGradientToItsLeast) {
  const auto penalties = JumpPenalties({.p1 = 10, .p2 = 100, .min_p2 = 20, .gradient = 8});
  EXPECT_EQ(penalties[0], 100u);
  EXPECT_EQ(penalties[8], 50u);
  EXPECT_EQ(penalties[255], 20u);
  for (std::size_t i = 1; i < penalties.size(); ++i) EXPECT_LE(penalties[i], penalties[i - 1]);
}

}  // namespace
}  // namespace mono3d
