// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "fusion/fusion_scene.h"
#include "fusion/kept_maps.h"
#include "fusion/past_views.h"
#include "gpu/allocation_hook.h"
#include "gpu/test_device.h"
#include "mono3d/core/error.h"
#include "mono3d/fusion/surfel_map.h"

namespace mono3d {
namespace {

// A device without memory for larger buffers of one name, as long as it lives.
class NoMemoryFor {
 public:
  explicit NoMemoryFor(std::string name, std::size_t max_bytes = 0) {
    SetAllocationHook([this, name = std::move(name), max_bytes](std::size_t size_bytes,
                                                                const std::string& buffer) {
      if (buffer != name || size_bytes <= max_bytes) return;
      ++num_refused_;
      throw Error("no memory for " + buffer, ErrorCode::kOutOfMemory);
    });
  }
  ~NoMemoryFor() { SetAllocationHook({}); }
  NoMemoryFor(const NoMemoryFor&) = delete;
  NoMemoryFor& operator=(const NoMemoryFor&) = delete;

  int num_refused() const { return num_refused_; }

 private:
  int num_refused_ = 0;
};

// A wall 10 su away as a camera at x su to the side sees it.
TrackedMap WallMap(int width_px, int height_px, double x_su, int number) {
  TrackedMap map = PlaneMap(TestCamera(width_px, height_px),
                            Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(x_su, 0, 0)));
  map.keyframe_id = map.frame_index = number;
  return map;
}

TEST(Memory, AModelOfWhichTheDeviceHasNoRoomForAViewBecomesCoarser) {
  constexpr std::size_t kRoom = 65'536;  // what a model has from the start
  const NoMemoryFor more_surfels("fusion/history", kRoom * 16);
  const auto map = CreateTrackedModel();
  for (int i = 0; i < 6; ++i) {
    const FusionResult result = map->Integrate(WallMap(320, 220, 11.0 * i, i));
    EXPECT_EQ(result.status, FusionStatus::kFused) << result.reason;
  }
  EXPECT_EQ(more_surfels.num_refused(), 1);  // it does not ask again
  // Coarser once, by the first view, which shows more pixels than there is room for; there is room
  // for each of the others then, and for six walls where the device has that of one.
  EXPECT_EQ(map->num_surfels(), 6 * 320 * 220 / 4);
}

TEST(Memory, AModelThatCannotGrowGoesOnBesideTheDevice) {
  constexpr std::size_t kRoom = 65'536;
  const NoMemoryFor more_surfels("fusion/history", kRoom * 16);
  const auto map = CreateTrackedModel();
  for (int i = 0; i < 6; ++i) {
    const FusionResult result = map->Integrate(WallMap(240, 160, 11.0 * i, i));
    EXPECT_EQ(result.status, FusionStatus::kFused) << result.reason;
  }
  EXPECT_EQ(more_surfels.num_refused(), 1);
  EXPECT_EQ(map->num_surfels(), 6 * 240 * 160);
  EXPECT_EQ(map->Export(1).size(), 6U * 240 * 160);
  // From afar all walls are in view at once, for which there is no room: the model becomes coarser.
  TrackedMap afar = PlaneMap(TestCamera(240, 160),
                             Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(27.5, 0, -50)));
  afar.keyframe_id = afar.frame_index = 6;
  const FusionResult result = map->Integrate(afar);
  EXPECT_EQ(result.status, FusionStatus::kFused) << result.reason;
  EXPECT_LE(map->num_surfels(), static_cast<std::int64_t>(kRoom));
  EXPECT_GT(map->num_surfels(), 6 * 240 * 160 / 8);
}

TEST(Memory, DepthMapsThatCannotBeKeptAreFusedAllTheSame) {
  const auto map = CreateTrackedModel();
  ASSERT_EQ(map->Integrate(WallMap(48, 32, 0, 0)).status, FusionStatus::kFused);
  const NoMemoryFor past_views("fusion/candidate");
  for (int i = 1; i < 4; ++i) {
    const FusionResult result = map->Integrate(WallMap(48, 32, 2.0 * i, i));
    EXPECT_EQ(result.status, FusionStatus::kFused) << result.reason;
    EXPECT_GT(result.num_inserted, 0);
  }
  EXPECT_EQ(past_views.num_refused(), 3);
}

TEST(Memory, ACorrectionThatCannotMergeMovesTheModelStill) {
  SurfelMapOptions options;
  options.registration.enabled = false;
  const auto map = CreateTrackedModel(options);
  std::vector<KeyframePose> moved;
  for (int i = 0; i < 6; ++i) {
    const TrackedMap view = WallMap(48, 32, 0.5 * i, i);
    (void)map->Integrate(view);
    const Eigen::Vector3d place = view.T_world_cam.translation() + Eigen::Vector3d(0.5 * i, 0, 0);
    moved.push_back({i, 0, Similarity(1, Pose(Eigen::Quaterniond::Identity(), place))});
  }
  const std::int64_t num_before = map->num_surfels();
  const NoMemoryFor merging("fusion/overlap_sums");
  const UpdateResult result = map->Update(moved);
  EXPECT_TRUE(result.has_moved);
  (void)map->Export(1);  // merges what came to lie upon each other
  EXPECT_EQ(merging.num_refused(), 1);
  ASSERT_EQ(map->DepthMaps().size(), 6U);
  EXPECT_NEAR(map->DepthMaps()[5].S_world_kf.pose().translation().x(), 5, 1e-6);
  EXPECT_EQ(map->num_surfels(), num_before);
}

// Whatever holds memory of the device holds the device.
TEST(Memory, TheLastExportLetsTheModelGo) {
  const std::shared_ptr<Device> device = TestDevice();
  const long num_before = device.use_count();
  const std::unique_ptr<SurfelMap> model = CreateSurfelMap(device, {}, nullptr);
  std::vector<KeyframePose> poses;
  for (int i = 0; i < 3; ++i) {
    const TrackedMap view = WallMap(48, 32, 0.5 * i, i);
    poses.push_back({i, 0, Similarity(1, view.T_world_cam)});
    const KeyframePoses snapshot(static_cast<std::uint64_t>(i) + 1, poses);
    ASSERT_EQ(model->Integrate(view, snapshot).status, FusionStatus::kFused);
  }
  EXPECT_GT(device.use_count(), num_before);
  const PointCloud cloud = model->Export(SurfelExportOptions());
  const PointCloud last = model->ExportLast(SurfelExportOptions());
  EXPECT_EQ(device.use_count(), num_before);
  ASSERT_GT(cloud.size(), 1000U);
  EXPECT_EQ(last.points, cloud.points);
  EXPECT_EQ(last.confidences, cloud.confidences);
}

TEST(Memory, OfKeptMapsIsBounded) {
  const TrackedMap map = WallMap(48, 32, 0, 0);
  const std::size_t bytes = StoredDepthMap(map).num_bytes();
  EXPECT_EQ(bytes, 48U * 32 * 5);  // depth and colour; normal and confidence would be 3 more
  const auto kept_of = [&](int max_size, std::size_t max_bytes) {
    KeptMaps kept(max_size, max_bytes);
    for (int i = 0; i < 10; ++i) {
      kept.Add({StoredDepthMap(WallMap(48, 32, 0, i))});
      EXPECT_LE(kept.size(), static_cast<std::size_t>(max_size));
    }
    EXPECT_EQ(kept.TakeNewest()->map.frame.frame_index, 9);
    return kept.size() + 1;
  };
  EXPECT_EQ(kept_of(4, 100 * bytes), 4U);
  EXPECT_EQ(kept_of(8, 3 * bytes), 3U);
  EXPECT_EQ(kept_of(8, bytes / 2), 1U);
}

TEST(Memory, OfPastViewsIsBounded) {
  PastViews past(3);
  DepthMapBuffers buffers(TestDevice(), 48, 32);
  for (int i = 0; i < 8; ++i) past.Push(TestDevice(), WallMap(48, 32, 0, i), 0, buffers);
  ASSERT_EQ(past.views().size(), 3U);
  EXPECT_EQ(past.views().front().map.frame_index, 5);
  EXPECT_EQ(past.views().front().buffers.depth.size_bytes() +
                past.views().front().buffers.candidate.size_bytes(),
            48U * 32 * 20);
}

}  // namespace
}  // namespace mono3d
