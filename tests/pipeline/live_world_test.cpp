// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Loops and joined maps while the chain is live: the real tracker and selector on rendered flights.
// Depth and model are stand-ins that keep where each depth map is, so that what reaches the model
// can be held against the tracker's own last word.

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <map>
#include <memory>
#include <numbers>
#include <thread>
#include <utility>
#include <vector>

#include "mono3d/geometry/similarity.h"
#include "mono3d/pipeline/pipeline.h"
#include "tracking/tracking_world.h"

namespace mono3d {
namespace {

using tracking::BlackFrame;
using tracking::FlyOver;
using tracking::LookAt;
using tracking::SmallCamera;
using tracking::TexturedGround;

// Of the median depth: what later adjustments move a keyframe by that has been handed out.
constexpr double kMaxOffset_su = 0.01;
// Of the flying height of 10: as for flights over the same ground in sequential mode.
constexpr double kMaxRelativeError = 0.01;

class PoseDepthEstimator final : public DepthEstimator {
 public:
  DepthResult Estimate(const ImageBundle& bundle) override {
    const Keyframe& reference = bundle.reference();
    DepthResult result;
    result.status = DepthStatus::kEstimated;
    result.map.frame_index = reference.frame.index;
    result.map.keyframe_id = reference.id;
    return result;
  }
};

class PoseSurfelMap final : public SurfelMap {
 public:
  FusionResult Integrate(const DepthMap& map, const KeyframePoses& poses) override {
    FusionResult result;
    result.status = FusionStatus::kFused;
    result.S_world_kf = poses.At(map.keyframe_id).S_world_kf;
    maps_.push_back({map.frame_index, map.timestamp_s, map.keyframe_id, result.S_world_kf});
    return result;
  }
  UpdateResult Update(const KeyframePoses& poses) override {
    UpdateResult result;
    for (FusedDepthMap& map : maps_) {
      const Similarity& S_world_kf = poses.At(map.keyframe_id).S_world_kf;
      const Eigen::Vector3d motion =
          S_world_kf.pose().translation() - map.S_world_kf.pose().translation();
      if (motion.norm() > 0) result.has_moved = true;
      map.S_world_kf = S_world_kf;
    }
    return result;
  }
  std::vector<FusedDepthMap> DepthMaps() const override { return maps_; }
  PointCloud Export(const SurfelExportOptions&) const override { return {}; }
  std::int64_t num_surfels() const override { return 0; }

 private:
  std::vector<FusedDepthMap> maps_;
};

struct Film {
  std::vector<cv::Mat> images;
  std::vector<Pose> T_world_cam;
};

// What a viewer sees at any moment.
void ExpectConsistent(const PipelineSnapshot& now) {
  EXPECT_LE(now.counts.num_tracked, now.counts.num_frames);
  EXPECT_LE(now.counts.num_fused, now.counts.num_bundles);
  if (!now.pose) return;
  EXPECT_EQ(now.pose->frame_index, now.frame_index);
  EXPECT_TRUE(now.pose->T_world_cam.Matrix().allFinite());
}

Reconstruction ReconstructLive(const Film& film) {
  PipelineOptions options;
  options.is_live = true;
  PipelineStages stages;
  options.tracking.mode = "live";  // as CreateStages has it
  stages.tracker = CreateTracker(options.tracking);
  stages.keyframe_selector = CreateKeyframeSelector(options.keyframes);
  stages.depth_estimator = std::make_unique<PoseDepthEstimator>();
  stages.create_surfel_map = [] { return std::make_unique<PoseSurfelMap>(); };
  options.live = {.max_delay_s = 3600, .max_waiting_mb = 1e6};  // however slow the machine is
  Pipeline pipeline(std::move(stages), {}, options);
  pipeline.Start();
  std::atomic<bool> is_over = false;
  std::thread viewer([&] {
    while (!is_over) ExpectConsistent(pipeline.Snapshot());
  });
  for (std::size_t i = 0; i < film.images.size(); ++i) {
    Frame frame = BlackFrame(static_cast<std::int64_t>(i));
    frame.bgr = film.images[i];
    (void)pipeline.Push(std::move(frame));
  }
  Reconstruction result = pipeline.Stop();
  is_over = true;
  viewer.join();
  return result;
}

void ExpectTruth(const std::vector<TrajectoryEntry>& trajectory, const Film& film) {
  std::vector<Eigen::Vector3d> found;
  std::vector<Eigen::Vector3d> truth;
  for (const TrajectoryEntry& entry : trajectory) {
    found.push_back(entry.T_world_cam.translation());
    truth.push_back(film.T_world_cam[static_cast<std::size_t>(entry.frame_index)].translation());
  }
  const Similarity fit = FitSimilarity(found, truth);
  double sum = 0;
  for (std::size_t i = 0; i < found.size(); ++i) sum += (fit * found[i] - truth[i]).squaredNorm();
  EXPECT_LT(std::sqrt(sum / static_cast<double>(found.size())) / 10, kMaxRelativeError);
}

// Every depth map is where the tracker has its keyframe in the end.
void ExpectModelAtKeyframes(const MapReconstruction& map) {
  std::map<std::int64_t, Pose> keyframes;
  for (const TrajectoryEntry& entry : map.keyframes) {
    keyframes[entry.frame_index] = entry.T_world_cam;
  }
  for (const TrajectoryEntry& entry : map.model_trajectory) {
    ASSERT_EQ(keyframes.count(entry.frame_index), 1U);
    const Pose& T_world_cam = keyframes[entry.frame_index];
    EXPECT_LT((entry.T_world_cam.translation() - T_world_cam.translation()).norm(), kMaxOffset_su)
        << "frame " << entry.frame_index;
  }
}

// Once around and a little further, looking outwards and steeply down.
Film Round() {
  constexpr int kNumFrames = 84;
  constexpr double kStep_rad = 2 * std::numbers::pi / 78;
  const TexturedGround ground(false);
  Film film;
  for (int i = 0; i < kNumFrames; ++i) {
    const Eigen::Vector3d outwards(std::cos(kStep_rad * i), std::sin(kStep_rad * i), 0);
    const Eigen::Vector3d eye = 5 * outwards + Eigen::Vector3d(0, 0, 10);
    film.T_world_cam.push_back(LookAt(eye, 10.8 * outwards));
    film.images.push_back(ground.Render(SmallCamera(), film.T_world_cam.back()));
  }
  return film;
}

TEST(LivePipeline, ALoopReachesTheModelAndTheTrajectory) {
  const Film film = Round();
  const Reconstruction result = ReconstructLive(film);
  EXPECT_GE(result.counts.num_corrections, 1);
  ASSERT_EQ(result.maps.size(), 1U);
  const MapReconstruction& map = result.maps[0];
  EXPECT_GE(map.trajectory.size(), film.images.size() - 2);
  EXPECT_EQ(map.model_trajectory.size(), static_cast<std::size_t>(result.counts.num_fused));
  EXPECT_GE(map.model_trajectory.size(), 5U);
  ExpectTruth(map.trajectory, film);
  ExpectModelAtKeyframes(map);
}

// A flight, twelve black frames, then from far away back to where the first map was made.
Film ThereAndBack() {
  const auto flight = FlyOver(TexturedGround(false), 60);
  Film film;
  const auto add = [&](std::size_t i) {
    film.images.push_back(flight.frames[i].bgr);
    film.T_world_cam.push_back(flight.T_world_cam[i]);
  };
  constexpr std::size_t kNumBefore = 12;
  for (std::size_t i = 0; i < kNumBefore; ++i) add(i);
  for (int i = 0; i < 12; ++i) {
    film.images.push_back(BlackFrame(0).bgr);
    film.T_world_cam.emplace_back();
  }
  for (std::size_t i = 59; i > kNumBefore - 4; i -= 2) add(i);
  return film;
}

TEST(LivePipeline, TwoMapsBecomeOneWithTheirModelsAndTrajectories) {
  const Film film = ThereAndBack();
  const Reconstruction result = ReconstructLive(film);
  EXPECT_GE(result.counts.num_corrections, 1);
  ASSERT_EQ(result.maps.size(), 1U);
  const MapReconstruction& map = result.maps[0];
  EXPECT_EQ(map.map_id, 0);
  EXPECT_GE(map.trajectory.size(), film.images.size() - 12);
  EXPECT_GE(map.online_trajectory.size(), film.images.size() - 12);
  EXPECT_EQ(map.model_trajectory.size(), static_cast<std::size_t>(result.counts.num_fused));
  EXPECT_GE(map.model_trajectory.size(), 2U);
  ExpectTruth(map.trajectory, film);
  ExpectModelAtKeyframes(map);
}

}  // namespace
}  // namespace mono3d
