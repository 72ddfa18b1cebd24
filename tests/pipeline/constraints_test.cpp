// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// What the model says of where keyframes are, on its way up to the tracker.

#include <gtest/gtest.h>

#include <filesystem>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "fusion/registration_scene.h"
#include "mono3d/pipeline/pipeline.h"
#include "pipeline/keyframe_table.h"
#include "pipeline/scripted_stages.h"

namespace mono3d {
namespace {

using Eigen::Vector3d;

TEST(Constraints, TellTheTrackerWhereTheModelHasItsKeyframes) {
  std::vector<ScriptedFrame> script;
  for (int i = 0; i < 6; ++i) {
    const TrackedMap view = HouseView({}, 3 * i);
    const bool is_wrong = i == 3;
    script.push_back(
        {is_wrong ? Misplaced(view, {0.02, -0.03, 0.02}, {0.3, -0.2, 0.2}, 1) : view, {}});
  }
  const auto folder = std::filesystem::path(testing::TempDir()) / "mono3d_constraints";
  const ScriptedRun run = RunScript(script, folder);
  std::filesystem::remove_all(folder);
  ASSERT_EQ(run.constraints.size(), 1U);
  const KeyframeConstraint& constraint = run.constraints.front();
  EXPECT_EQ(constraint.id, 3);
  const auto anchor = static_cast<std::size_t>(constraint.anchor_id);
  ASSERT_LT(anchor, 3U);
  const Pose T_world_cam = script[anchor].map.T_world_cam * constraint.T_cam_anchor.Inverse();
  EXPECT_LT(ImageDistance_px(T_world_cam, HouseView({}, 9).T_world_cam),
            0.1 * ImageDistance_px(script[3].map.T_world_cam, HouseView({}, 9).T_world_cam));
  EXPECT_EQ(run.json["counts"]["constraints"], 1);
}

// Each depth map is off by a little more than the one before. The model knows it by how the last
// one had to be moved; the tracker has to hear of it all the same, and against what was there
// before.
TEST(Constraints, TellATrackerThatDriftsSlowly) {
  std::vector<ScriptedFrame> script;
  for (int i = 0; i < 14; ++i) {
    const double share = 0.06 * i;
    script.push_back({Misplaced(HouseView({}, 1.5 * i), share * Vector3d(0.02, -0.03, 0.02),
                                share * Vector3d(0.3, -0.2, 0.2), 1),
                      {}});
  }
  const auto folder = std::filesystem::path(testing::TempDir()) / "mono3d_drift";
  const ScriptedRun run = RunScript(script, folder);
  std::filesystem::remove_all(folder);
  ASSERT_FALSE(run.constraints.empty());
  const KeyframeConstraint& last = run.constraints.back();
  ASSERT_LT(last.anchor_id, 3);
  const auto kf = static_cast<int>(last.id);
  const Pose T_world_cam = script[static_cast<std::size_t>(last.anchor_id)].map.T_world_cam *
                           last.T_cam_anchor.Inverse();
  const Pose T_true = HouseView({}, 1.5 * kf).T_world_cam;
  EXPECT_LT(ImageDistance_px(T_world_cam, T_true),
            0.3 * ImageDistance_px(script[static_cast<std::size_t>(kf)].map.T_world_cam, T_true));
}

// Stages that do as little as possible: each frame is a keyframe, a bundle and a depth map, and the
// model has every one of them six su from the first.
class ListeningTracker final : public Tracker {
 public:
  explicit ListeningTracker(std::vector<KeyframeConstraint>* heard) : heard_(heard) {}
  TrackingResult Track(const Frame& frame) override {
    TrackingResult result;
    result.status = TrackingStatus::kTracking;
    result.T_world_cam =
        Pose(Eigen::Quaterniond::Identity(), Vector3d(static_cast<double>(frame.index), 0, 0));
    keyframes_.Set(frame.index, 0, *result.T_world_cam);
    // The world around the first keyframe becomes twice as large before its depth map is made.
    if (frame.index == 1) keyframes_.Set(0, 0, Similarity(2, Pose()));
    result.finalised_keyframes = {{frame.index, frame, {1}}};
    return result;
  }
  KeyframePosesPtr Poses() const override { return keyframes_.Poses(); }
  void Constrain(std::span<const KeyframeConstraint> constraints) override {
    heard_->insert(heard_->end(), constraints.begin(), constraints.end());
  }
  std::vector<Keyframe> Finish() override { return {}; }
  std::vector<TrajectoryEntry> Trajectory() const override { return {}; }
  std::vector<TrajectoryEntry> KeyframeTrajectory() const override { return {}; }

 private:
  std::vector<KeyframeConstraint>* heard_;
  KeyframeTable keyframes_;
};

// Each keyframe is a bundle of its own, once the next one has come.
class DelayingSelector final : public KeyframeSelector {
 public:
  std::optional<ImageBundle> Add(const Keyframe& keyframe, const KeyframePoses&) override {
    const std::optional<Keyframe> before = std::exchange(last_, keyframe);
    if (!before) return std::nullopt;
    return ImageBundle{{*before}, {}};
  }

 private:
  std::optional<Keyframe> last_;
};

class PlainDepth final : public DepthEstimator {
 public:
  DepthResult Estimate(const ImageBundle& bundle) override {
    DepthResult result;
    result.status = DepthStatus::kEstimated;
    result.map.keyframe_id = bundle.reference().id;
    return result;
  }
};

class TalkingSurfelMap final : public SurfelMap {
 public:
  FusionResult Integrate(const DepthMap& map, const KeyframePoses&) override {
    FusionResult result;
    result.status = FusionStatus::kFused;
    if (map.keyframe_id == 0) return result;
    KeyframeConstraint constraint;
    constraint.id = map.keyframe_id;
    constraint.T_cam_anchor = Pose(Eigen::Quaterniond::Identity(), Vector3d(-6, 0, 0));
    constraint.information.setIdentity();
    result.constraints = {constraint};
    return result;
  }
  UpdateResult Update(const KeyframePoses&) override { return {}; }
  std::vector<FusedDepthMap> DepthMaps() const override { return {}; }
  PointCloud Export(const SurfelExportOptions&) const override { return {}; }
  std::int64_t num_surfels() const override { return 0; }
};

TEST(Constraints, ReachTheTrackerInBothModes) {
  for (const bool is_live : {false, true}) {
    PipelineOptions options;
    options.is_live = is_live;
    std::vector<KeyframeConstraint> heard;
    PipelineStages stages;
    stages.tracker = std::make_unique<ListeningTracker>(&heard);
    stages.keyframe_selector = std::make_unique<DelayingSelector>();
    stages.depth_estimator = std::make_unique<PlainDepth>();
    stages.create_surfel_map = [] { return std::make_unique<TalkingSurfelMap>(); };
    Pipeline pipeline(std::move(stages), {}, options);
    for (int i = 0; i < 5; ++i) {
      Frame frame;
      frame.index = i;
      pipeline.Process(frame);
    }
    const Reconstruction result = pipeline.Finish();
    ASSERT_FALSE(heard.empty());
    EXPECT_EQ(result.counts.num_constraints, static_cast<std::int64_t>(heard.size()));
    EXPECT_EQ(heard.back().id, 3);
    if (is_live) continue;  // the first bundle may have been dropped
    EXPECT_EQ(heard.size(), 3U);
    // In the keyframes' own units, whatever the scale of the world around them.
    EXPECT_EQ(heard.back().T_cam_anchor.translation(), Vector3d(-6, 0, 0));
    EXPECT_EQ(heard.back().scale, 1);
    EXPECT_EQ(heard.back().information(3, 3), 1);
  }
}

}  // namespace
}  // namespace mono3d
