// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "fusion/anchor_map.h"
#include "fusion/fusion_scene.h"
#include "fusion/overlap_merger.h"
#include "gpu/test_device.h"
#include "reference/fusion/overlap_reference.h"

namespace mono3d {
namespace {

constexpr int kWidth = 53, kHeight = 35;  // no whole number of tiles of the index map

constexpr std::uint32_t kNumAnchors = 10;
constexpr double kSecondUnitsPerSu = 0.6;

// Where the anchors are: those but the first where the second camera is, in a unit of their own.
std::vector<Similarity> AnchorPlaces() {
  std::vector<Similarity> places(kNumAnchors, Similarity(1 / kSecondUnitsPerSu, MovedPose()));
  places.front() = Similarity();
  return places;
}

// The same slanted ground seen by two depth maps, the second moved `by` su, anchored to depth maps
// 0 and `second_anchor`.
Surfels TwoLayers(std::uint32_t second_anchor, double by, unsigned seed) {
  const CameraModel camera = TestCamera(kWidth, kHeight);
  Surfels model;
  for (const bool second : {false, true}) {
    const Plane plane{Eigen::Vector3d(0.2, -0.1, -1).normalized(), -9 - (second ? by : 0)};
    const Pose pose = second ? MovedPose() : Pose();
    TrackedMap map = PlaneMap(camera, pose, plane);
    Disturb(map, 0.005, 11, seed + (second ? 1 : 0));
    Surfels part;
    reference::Integrate(MakeViewParams(map, {}, 0, second ? second_anchor : 0), {}, Pack(map),
                         part);
    Append(model, second ? InUnit(part, kSecondUnitsPerSu) : part);
  }
  return InWholeBlocks(model);
}

// A camera where the first anchor is.
struct MergingView {
  explicit MergingView(const Surfels& surfels)
      : params(MakeViewParams(PlaneMap(TestCamera(kWidth, kHeight), Pose()), {},
                              static_cast<std::uint32_t>(surfels.size()), kNumAnchors)),
        anchors(AnchorTransforms(Similarity(), AnchorPlaces())) {
    // Depth maps up to three apart are one part.
    const auto first_slot_of = [&](std::uint32_t anchor) {
      std::uint32_t slot = 0;
      while (slot < surfels.size() && AnchorOf(surfels, slot) < anchor) ++slot;
      return slot;
    };
    for (std::uint32_t i = 0; i < kNumAnchors; ++i) {
      end_of_older.push_back(first_slot_of(i - std::min(i, AnchorMap::kMaxAnchorGap)));
    }
  }

  ViewParams params;
  reference::AnchorTransforms anchors;
  std::vector<std::uint32_t> end_of_older;
};

struct Merged {
  Surfels surfels;
  std::uint32_t num_removed = 0;
};

Merged Merge(const Surfels& surfels) {
  SurfelStorage storage(TestDevice(), 100'000);
  storage.Upload(surfels);
  BlockList all_blocks;
  all_blocks.SetRange(TestDevice(), 0, storage.size());
  Recorder recorder(TestDevice());
  const FusionKernels kernels(TestDevice());
  const MergingView view(surfels);
  AnchorTable anchors;
  anchors.Set(TestDevice(), view.anchors);
  Merged merged;
  merged.num_removed = OverlapMerger(TestDevice())
                           .Merge(recorder, kernels, view.params, anchors, view.end_of_older,
                                  storage, all_blocks, nullptr);
  merged.surfels = storage.Download();
  return merged;
}

std::uint64_t Observations(const Surfels& surfels) {
  std::uint64_t sum = 0;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    if (!IsRemoved(surfels, i)) sum += Low16(surfels.history[i][1]);
  }
  return sum;
}

TEST(Overlap, TwoSurfelsBecomeTheirMeanByWeight) {
  Surfels surfels = OneSurfel({0, 0, 10}, {0, 0, -1}, 300);
  // The second one in the frame of its anchor.
  const Similarity S_anchor_world = AnchorPlaces().back().Inverse();
  const Eigen::Vector3d p = S_anchor_world * Eigen::Vector3d(0, 0, 10.1);
  const Eigen::Vector3d n = S_anchor_world.pose().rotation() * Eigen::Vector3d(0, 0, -1);
  const auto weight = static_cast<float>(100 / (kSecondUnitsPerSu * kSecondUnitsPerSu));
  Append(surfels, OneSurfel(p.cast<float>(), n.cast<float>(), weight));
  surfels.history[1][3] |= 9;
  surfels.history[1][1] = 3;
  const Merged merged = Merge(InWholeBlocks(surfels));
  EXPECT_EQ(merged.num_removed, 1U);
  EXPECT_TRUE(IsRemoved(merged.surfels, kSurfelsPerBlock));
  // A quarter of the way, in inverse depth.
  EXPECT_NEAR(merged.surfels.position_radius[0][2], 1 / (0.75 / 10 + 0.25 / 10.1), 1e-3);
  EXPECT_NEAR(merged.surfels.normal_weight[0][3], 400, 0.5);
  EXPECT_EQ(Low16(merged.surfels.history[0][1]), 4U);
  EXPECT_EQ(High16(merged.surfels.history[0][3]), 512U);
}

TEST(Overlap, LeavesOnePartAndWhatLiesApart) {
  // Neighbouring depth maps are one part: what they left unmerged stays so.
  const Surfels one_part = TwoLayers(2, 0, 1);
  EXPECT_EQ(Merge(one_part).num_removed, 0U);
  // A floor 20 su below another, five sigmas.
  const Surfels two_floors = TwoLayers(9, 20, 2);
  EXPECT_EQ(Merge(two_floors).num_removed, 0U);
}

TEST(Overlap, MergesTheSecondLayerAndLosesNoObservation) {
  const Surfels surfels = TwoLayers(9, 0, 3);
  const Merged merged = Merge(surfels);
  // All of the second layer that the view sees but for noise, gaps, and surfels between pixels.
  EXPECT_GT(merged.num_removed, surfels.size() * 3 / 10);
  EXPECT_EQ(Observations(merged.surfels), Observations(surfels));
}

TEST(Overlap, EqualsReference) {
  Surfels expected = TwoLayers(9, 0.02, 4);
  const MergingView view(expected);
  const Merged merged = Merge(expected);
  const auto index_map = reference::DrawIndexMap(
      view.params, view.anchors, expected, std::vector<std::uint32_t>(expected.size(), kUnseen));
  const auto targets =
      reference::FindTargets(view.params, view.anchors, view.end_of_older, index_map, expected);
  const std::uint32_t num_removed = reference::AddToTargets(view.anchors, targets, expected);
  // Decisions that rounding tips over.
  constexpr double kMaxDifferingShare = 0.005;
  EXPECT_NEAR(merged.num_removed, num_removed, kMaxDifferingShare * num_removed);
  std::size_t num_different = 0;
  for (std::size_t i = 0; i < expected.size(); ++i) {
    // Shares are summed in steps of 1/1024.
    const bool same =
        IsRemoved(expected, i) == IsRemoved(merged.surfels, i) &&
        expected.history[i] == merged.surfels.history[i] &&
        std::abs(expected.position_radius[i][2] - merged.surfels.position_radius[i][2]) < 2e-3F &&
        std::abs(expected.normal_weight[i][3] - merged.surfels.normal_weight[i][3]) <=
            2e-3F * expected.normal_weight[i][3];
    num_different += same ? 0 : 1;
  }
  EXPECT_LE(static_cast<double>(num_different),
            kMaxDifferingShare * static_cast<double>(expected.size()));
}

}  // namespace
}  // namespace mono3d
