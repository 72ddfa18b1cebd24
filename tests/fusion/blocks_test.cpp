// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/blocks.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <random>
#include <vector>

#include "fusion/fusion_scene.h"
#include "gpu/test_device.h"
#include "reference/fusion/view_reference.h"

namespace mono3d {
namespace {

// The first of the 64 is somewhere, the others within 1 su of it; every third is removed.
Surfels Clusters(int num_blocks, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> place(-30, 30);
  std::uniform_real_distribution<float> offset(-1, 1);
  Surfels surfels;
  for (int block = 0; block < num_blocks; ++block) {
    const Eigen::Vector3f centre(place(random), place(random), place(random));
    for (std::uint32_t i = 0; i < kSurfelsPerBlock; ++i) {
      const Eigen::Vector3f p = centre + Eigen::Vector3f(offset(random), offset(random), 0);
      Append(surfels, OneSurfel(p, {0, 0, -1}, i % 3 == 0 ? 0.0F : 1.0F));
    }
  }
  return surfels;
}

std::vector<std::uint32_t> Numbers(const BlockList& list) {
  std::vector<std::uint32_t> numbers(list.size());
  if (!numbers.empty()) list.buffer().Download(std::span(numbers));
  return numbers;
}

// A camera of 64x48 pixels in the world, in whose frame the anchor of all surfels is.
struct View {
  explicit View(const Pose& T_world_cam)
      : params(MakeViewParams(PlaneMap(TestCamera(64, 48), T_world_cam), {}, 0, 0)),
        anchors(AnchorTransforms(Similarity(2, T_world_cam), std::vector<Similarity>(1))) {
    table.Set(TestDevice(), anchors);
  }

  ViewParams params;
  reference::AnchorTransforms anchors;
  AnchorTable table;
};

bool IsInImage(const View& view, const Surfels& surfels, std::size_t i, std::uint32_t margin) {
  if (IsRemoved(surfels, i)) return false;
  const auto margin_px = static_cast<float>(margin);
  const Eigen::Vector3f p = reference::CameraFromAnchor(view.anchors.front())
                                .Point(reference::Head(surfels.position_radius[i]));
  if (p.z() <= 0) return false;
  const Eigen::Vector2f pixel = reference::Project(view.params, p);
  return pixel.x() >= -0.5F - margin_px && pixel.y() >= -0.5F - margin_px &&
         pixel.x() < static_cast<float>(view.params.width_px) - 0.5F + margin_px &&
         pixel.y() < static_cast<float>(view.params.height_px) - 0.5F + margin_px;
}

std::vector<ModelView> ModelViews(const std::vector<View>& views) {
  std::vector<ModelView> model_views;
  for (const View& view : views) model_views.push_back({view.params, view.table});
  return model_views;
}

std::vector<View> ViewsFrom(const std::vector<Pose>& poses) {
  std::vector<View> views;
  for (const Pose& pose : poses) views.emplace_back(pose);
  return views;
}

std::vector<std::uint32_t> Visible(const Surfels& surfels, const std::vector<View>& views,
                                   std::uint32_t margin_px) {
  SurfelStorage storage(TestDevice(), 100'000);
  storage.Upload(surfels);
  Recorder recorder(TestDevice());
  BlockList visible;
  BlockCuller(TestDevice())
      .FindVisible(recorder, ModelViews(views), margin_px, storage, visible, nullptr);
  EXPECT_TRUE(storage.Unbounded().empty());
  return Numbers(visible);
}

TEST(Blocks, ListAllThatASurfelInViewIsIn) {
  Surfels surfels = Clusters(600, 1);
  Append(surfels, OneSurfel({0, 0, 5}, {0, 0, -1}, 1));  // a block that is not full
  const std::vector<View> views = ViewsFrom({Pose(), MovedPose()});
  for (const std::uint32_t margin_px : {0U, 20U}) {
    const std::vector<std::uint32_t> listed = Visible(surfels, views, margin_px);
    std::vector<bool> is_listed(601, false);
    for (const std::uint32_t block : listed) is_listed.at(block) = true;
    EXPECT_TRUE(is_listed[600]);
    for (std::size_t i = 0; i < surfels.size(); ++i) {
      if (!IsInImage(views[0], surfels, i, margin_px) &&
          !IsInImage(views[1], surfels, i, margin_px)) {
        continue;
      }
      EXPECT_TRUE(is_listed[i / kSurfelsPerBlock]) << i;
    }
    EXPECT_TRUE(std::is_sorted(listed.begin(), listed.end()));
    // A camera of 53 degrees sees an eighth of a cube around it, and some blocks are half in view.
    EXPECT_LT(listed.size(), 300U);
    EXPECT_GT(listed.size(), 30U);
  }
}

TEST(Blocks, ListNoneWithoutASurfel) {
  const std::vector<View> views = ViewsFrom({Pose()});
  EXPECT_TRUE(Visible({}, views, 1).empty());
  Surfels removed;
  for (int i = 0; i < 100; ++i) Append(removed, OneSurfel({0, 0, 5}, {0, 0, -1}, 0));
  EXPECT_TRUE(Visible(removed, views, 1).empty());
}

TEST(Blocks, FollowSurfelsThatAreAddedOrMove) {
  const std::vector<View> views = ViewsFrom({Pose()});
  SurfelStorage storage(TestDevice(), 100'000);
  Surfels surfels;
  for (int i = 0; i < 128; ++i) Append(surfels, OneSurfel({0, 0, -5}, {0, 0, -1}, 1));
  storage.Upload(surfels);
  Recorder recorder(TestDevice());
  BlockCuller culler(TestDevice());
  BlockList visible;
  culler.FindVisible(recorder, ModelViews(views), 1, storage, visible, nullptr);
  EXPECT_EQ(visible.size(), 0U);

  surfels.position_radius[3] = {0, 0, 5, 1};
  surfels.position_radius[66] = {0, 0, 5, 1};
  storage.Upload(surfels);
  culler.FindVisible(recorder, ModelViews(views), 1, storage, visible, nullptr);
  EXPECT_EQ(Numbers(visible), (std::vector<std::uint32_t>{0, 1}));

  // One more block, of one surfel.
  surfels.position_radius[3] = surfels.position_radius[66] = {0, 0, -5, 1};
  storage.Upload(surfels);
  culler.FindVisible(recorder, ModelViews(views), 1, storage, visible, nullptr);
  std::vector<Surfels::Float4> positions(kSurfelsPerBlock, {0, 0, 5, 1});
  std::vector<Surfels::Float4> normals(kSurfelsPerBlock);
  normals.front() = {0, 0, -1, 1};
  constexpr std::size_t kEnd_bytes = 128 * sizeof(Surfels::Float4);
  Buffer block(TestDevice(), kSurfelsPerBlock * sizeof(Surfels::Float4), "test/block");
  block.Upload(std::span<const Surfels::Float4>(positions));
  recorder.Copy(block, 0, storage.position_radius(), kEnd_bytes, block.size_bytes());
  recorder.Submit();
  block.Upload(std::span<const Surfels::Float4>(normals));
  recorder.Copy(block, 0, storage.normal_weight(), kEnd_bytes, block.size_bytes());
  EXPECT_EQ(storage.BeginInsert(0, 1), std::vector<std::uint32_t>{2});
  storage.EndInsert(1, 0);
  EXPECT_EQ(storage.num_surfels(), 129U);
  culler.FindVisible(recorder, ModelViews(views), 1, storage, visible, nullptr);
  EXPECT_EQ(Numbers(visible), std::vector<std::uint32_t>{2});
}

TEST(SurfelStorage, GivesEachAnchorBlocksOfItsOwn) {
  Surfels surfels;
  for (std::uint32_t i = 0; i < 150; ++i) {
    Append(surfels,
           OneSurfel({static_cast<float>(i), 0, 5}, {0, 0, -1}, i % 10 == 0 ? 0.0F : 1.0F));
    surfels.history.back()[3] |= i < 100 ? 3U : 5U;
  }
  const Surfels closed = InWholeBlocks(surfels);
  ASSERT_EQ(closed.size(), 3U * kSurfelsPerBlock);  // 90 and 45
  SurfelStorage storage(TestDevice(), 100'000);
  storage.Upload(closed);
  EXPECT_EQ(storage.num_surfels(), 135U);
  EXPECT_EQ(storage.num_slots(), 192U);
  EXPECT_EQ(storage.NumSlotsOf(0), 0U);
  EXPECT_EQ(storage.NumSlotsOf(3), 128U);
  EXPECT_EQ(storage.NumSlotsOf(5), 64U);
  EXPECT_EQ(storage.NumSlotsOf(6), 0U);
  EXPECT_EQ(storage.Download(5).history, Surfels(storage.DownloadSlots(128, 192)).history);
  EXPECT_EQ(closed.position_radius[89][0], 99);
  EXPECT_EQ(closed.position_radius[128][0], 101);
  storage.RemoveAnchoredFrom(4);
  EXPECT_EQ(storage.num_surfels(), 90U);
  EXPECT_EQ(storage.num_slots(), 128U);
}

TEST(Blocks, GoOnAlongYWhereTheyAreMany) {
  BlockList list;
  list.SetRange(TestDevice(), 100 * kSurfelsPerBlock, (100 + 40'000) * kSurfelsPerBlock - 1);
  EXPECT_EQ(list.size(), 40'000U);
  EXPECT_EQ(list.grid(), (std::array<std::uint32_t, 3>{32'768, 2, 1}));
  const std::vector<std::uint32_t> numbers = list.buffer().Download<std::uint32_t>();
  EXPECT_EQ(numbers[0], 100U);
  EXPECT_EQ(numbers[39'999], 40'099U);
  EXPECT_EQ(numbers[40'000], 0xFFFFFFFFU);
  EXPECT_EQ(numbers[65'535], 0xFFFFFFFFU);
}

}  // namespace
}  // namespace mono3d
