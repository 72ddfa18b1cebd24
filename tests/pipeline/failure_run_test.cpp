// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <string>
#include <vector>

#include "fusion/registration_scene.h"
#include "mono3d/geometry/similarity.h"
#include "pipeline/scripted_stages.h"

// The ways in which a model of this kind has died before, through the whole chain: the model is
// sound at the end, and run.json tells what has happened.
namespace mono3d {
namespace {

using Eigen::Vector3d;
using nlohmann::json;

// Outlines: surfels of a coarser view stand over an edge by a pixel of a finer one.
constexpr double kMaxFalseShare = 0.02;

class FailureRun : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) /
              (std::string("mono3d_failure_run_") + test->name());
    std::filesystem::remove_all(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  ScriptedRun Run(const std::vector<ScriptedFrame>& script) { return RunScript(script, folder_); }

  std::filesystem::path folder_;
};

// A tracker that has drifted: all its poses moved by the same motion, farther than a
// registration can find back.
TrackedMap Astray(TrackedMap map) {
  const Pose moved(RotationExp({0.1, 0.15, 0.05}), Vector3d(3, 1, -2));
  map.T_world_cam = moved * map.T_world_cam;
  return map;
}

double FalseShareAt(const ScriptedRun& run, const std::vector<double>& angles_deg,
                    const HouseScene& scene = {}) {
  std::vector<TrackedMap> truth;
  for (const double angle_deg : angles_deg) truth.push_back(HouseView(scene, angle_deg));
  return FalseShare(run.reconstruction.maps.at(0).model, truth);
}

const json& HealthOf(const ScriptedRun& run) { return run.json["maps"][0]["health"]; }

// The states through which the model went, "degraded" and so on, each with its frame.
std::vector<std::string> StatesOf(const ScriptedRun& run) {
  std::vector<std::string> states;
  for (const json& change : run.json["maps"][0]["health_changes"]) {
    EXPECT_TRUE(change.contains("frame"));
    EXPECT_EQ(change.contains("reason"), change["state"] != "good");
    states.push_back(change["state"]);
  }
  return states;
}

TEST_F(FailureRun, OneWrongPose) {
  std::vector<ScriptedFrame> script;
  for (int i = 0; i < 9; ++i) {
    const TrackedMap view = HouseView({}, 3 * i);
    script.push_back({i == 4 ? Astray(view) : view, {}});
  }
  const ScriptedRun run = Run(script);
  EXPECT_LT(FalseShareAt(run, {0, 12, 24}), kMaxFalseShare);
  EXPECT_EQ(run.json["counts"]["fused"], 8);
  ASSERT_EQ(run.json["counts"]["rejected_depth_maps"].size(), 1U);
  EXPECT_THAT(run.json["counts"]["rejected_depth_maps"].begin().key(),
              ::testing::HasSubstr("not registered with the model"));
  const json& refused = run.json["maps"][0]["fusions"][4];
  EXPECT_EQ(refused["frame"], 4);
  EXPECT_EQ(refused["fused"], false);
  EXPECT_TRUE(refused.contains("reason"));
  EXPECT_EQ(HealthOf(run)["state"], "good");
}

// Poses that are wrong from the start: hardly anything matches, and what does makes the model.
TEST_F(FailureRun, ImagesThatHardlyEverMatch) {
  std::vector<ScriptedFrame> script;
  for (int i = 0; i < 10; ++i) script.push_back({HouseView({}, 3 * i), {}, i % 5 == 0});
  const ScriptedRun run = Run(script);
  EXPECT_EQ(run.json["counts"]["fused"], 2);
  EXPECT_EQ(HealthOf(run)["state"], "degraded");
  EXPECT_EQ(HealthOf(run)["reason"], "bundles whose images do not match: 88 %");
  EXPECT_EQ(StatesOf(run), std::vector<std::string>{"degraded"});
}

TEST_F(FailureRun, SomeImagesThatDoNotMatch) {
  std::vector<ScriptedFrame> script;
  for (int i = 0; i < 20; ++i) {
    // Five of eight, then all.
    script.push_back({HouseView({}, 3 * i), {}, i < 2 || i >= 7});
  }
  const ScriptedRun run = Run(script);
  EXPECT_EQ(StatesOf(run), (std::vector<std::string>{"degraded", "good"}));
  EXPECT_EQ(HealthOf(run)["state"], "good");
}

TEST_F(FailureRun, FiveWrongPosesInARow) {
  std::vector<ScriptedFrame> script;
  for (int i = 0; i < 20; ++i) {
    const TrackedMap view = HouseView({}, 3 * i);
    script.push_back({i >= 4 && i < 9 ? Astray(view) : view, {}});
  }
  const ScriptedRun run = Run(script);
  EXPECT_LT(FalseShareAt(run, {0, 18, 39, 57}), kMaxFalseShare);
  EXPECT_THAT(StatesOf(run), ::testing::Contains("broken"));
  EXPECT_EQ(StatesOf(run).back(), "good");
  EXPECT_EQ(HealthOf(run)["state"], "good");
  EXPECT_GE(run.json["counts"]["repairs"], 1);
  int num_repairs = 0;
  for (const json& fusion : run.json["maps"][0]["fusions"])
    num_repairs += fusion.contains("repair");
  EXPECT_EQ(run.json["counts"]["repairs"], num_repairs);
  // The wrong ones, at least at first.
  std::int64_t num_rejected = 0;
  for (const auto& [reason, times] : run.json["counts"]["rejected_depth_maps"].items()) {
    num_rejected += times.get<std::int64_t>();
  }
  EXPECT_GE(num_rejected, 5);
}

// In between the camera saw nothing with texture, and comes back far from where it was.
TEST_F(FailureRun, NoDepthForLongAndThenLittleOverlap) {
  std::vector<ScriptedFrame> script;
  for (int i = 0; i < 20; ++i) {
    TrackedMap view = HouseViewFrom({}, PoseOver(i < 3 ? -20 + i : i < 12 ? -12 : 13 - i, 0));
    if (i >= 3 && i < 12) view.depth.release();
    script.push_back({view, {}});
  }
  const ScriptedRun run = Run(script);
  const std::vector<TrackedMap> truth = {HouseViewFrom({}, PoseOver(-19, 0)),
                                         HouseViewFrom({}, PoseOver(0, 0))};
  EXPECT_LT(FalseShare(run.reconstruction.maps.at(0).model, truth), kMaxFalseShare);
  EXPECT_EQ(run.json["counts"]["rejected_bundles"]["no texture"], 9);
  EXPECT_EQ(run.json["counts"]["fused"], 11);
  EXPECT_EQ(HealthOf(run)["state"], "good");
}

// The same without any overlap, and with a tracker that has drifted meanwhile: a submap of its own,
// which joins the rest when the camera comes back.
TEST_F(FailureRun, NoDepthForLongAndThenNoOverlap) {
  const Similarity drift(1.02, Pose(RotationExp({0.006, -0.008, 0.01}), Vector3d(0.15, -0.2, 0.1)));
  std::vector<ScriptedFrame> script;
  for (const int x : {-20, -19, -18, -14, 6, 4, 2, 0, -2, -4, -6, -8, -10}) {
    TrackedMap view = HouseViewFrom({}, PoseOver(x, 0));
    view.depth_sigma_per_square_depth /= 5;  // of a baseline of half the distance
    if (x == -14) view.depth.release();
    if (x > -14) {
      view.T_world_cam = drift * view.T_world_cam;
      view.depth = view.depth * drift.scale();
      view.depth_sigma_per_square_depth /= drift.scale();
    }
    script.push_back({view, {}});
  }
  const ScriptedRun run = Run(script);
  EXPECT_EQ(run.json["counts"]["submaps_started"], 1);
  EXPECT_EQ(run.json["counts"]["submaps_joined"], 1);
  const json& of_map = run.json["maps"][0];
  EXPECT_EQ(of_map["fusions"][3]["starts_submap"], true);
  ASSERT_EQ(of_map["submap_joins"].size(), 1U);
  EXPECT_GT(of_map["submap_joins"][0]["moved_px"], 1);
  EXPECT_EQ(of_map["health"]["submaps"], 1);
  // The trajectory of the model has moved along: by half at least of what the tracker is off.
  for (const TrajectoryEntry& entry : run.reconstruction.maps[0].model_trajectory) {
    if (entry.frame_index < 4) continue;
    const Pose of_tracker = script.at(static_cast<std::size_t>(entry.frame_index)).map.T_world_cam;
    const Pose truth = drift.Inverse() * of_tracker;
    EXPECT_LT(ImageDistance_px(entry.T_world_cam, truth),
              0.5 * ImageDistance_px(of_tracker, truth));
  }
  const std::vector<TrackedMap> truth = {HouseViewFrom({}, PoseOver(-19, 0)),
                                         HouseViewFrom({}, PoseOver(0, 0))};
  EXPECT_LT(FalseShare(run.reconstruction.maps.at(0).model, truth), kMaxFalseShare);
}

TEST_F(FailureRun, FlatGroundWithAWrongPose) {
  HouseScene flat;
  flat.with_house = false;
  std::vector<ScriptedFrame> script;
  for (int i = 0; i < 9; ++i) {
    const TrackedMap view = HouseView(flat, 3 * i);
    script.push_back({i == 4 ? Misplaced(view, {0, 0, 0}, {0.3, -0.2, 0.2}, 1) : view, {}});
  }
  const ScriptedRun run = Run(script);
  double largest = 0;
  for (const auto& p : run.reconstruction.maps.at(0).model.points) {
    if (p.norm() < 12) largest = std::max(largest, std::abs(static_cast<double>(p.z())));
  }
  EXPECT_LT(largest, 0.2);  // a fiftieth of the distance
  // The model knew better than the tracker.
  const json& fifth = run.json["maps"][0]["fusions"][4];
  EXPECT_EQ(fifth["fused"], true);
  EXPECT_EQ(fifth["moved"], true);
  EXPECT_GT(fifth["deviation_px"], 1);
  EXPECT_EQ(HealthOf(run)["state"], "good");
}

// Two maps of the tracker, the second twice as large and elsewhere, until it finds that they are
// one: one model without double layers.
TEST_F(FailureRun, TwoMapsBecomeOne) {
  const Similarity other_world(2, Pose(RotationExp({0.3, 0.1, -0.5}), Vector3d(40, -7, 3)));
  std::vector<ScriptedFrame> script;
  std::vector<ScriptedFrame> alone;  // all in one map from the beginning
  for (int i = 0; i < 10; ++i) {
    TrackedMap view = HouseView({}, i < 5 ? 4 * i : 4 * (i - 3));  // seen twice: 8, 12 and 16
    alone.push_back({view, {}});
    if (i >= 5 && i < 9) {
      view.map_id = 1;
      view.T_world_cam = other_world * view.T_world_cam;
      view.depth = view.depth * other_world.scale();
      view.depth_sigma_per_square_depth /= other_world.scale();
    }
    script.push_back({view, {}});
  }
  for (int i = 0; i < 9; ++i) {
    const Pose truth = alone[static_cast<std::size_t>(i)].map.T_world_cam;
    script.back().moved.push_back({i, 0, Similarity(i < 5 ? 1 : 1 / other_world.scale(), truth)});
  }
  const ScriptedRun run = Run(script);
  ASSERT_EQ(run.reconstruction.maps.size(), 1U);
  EXPECT_EQ(run.json["counts"]["models_joined"], 1);
  EXPECT_EQ(run.json["counts"]["fused"], 10);
  EXPECT_EQ(run.json["maps"][0]["depth_maps_fused"], 10);
  EXPECT_EQ(run.json["maps"][0]["fusions"].size(), 10U);
  for (const TrajectoryEntry& entry : run.reconstruction.maps[0].model_trajectory) {
    const Pose truth = alone.at(static_cast<std::size_t>(entry.frame_index)).map.T_world_cam;
    EXPECT_LT(ImageDistance_px(entry.T_world_cam, truth), 1e-3);
  }
  EXPECT_LT(FalseShareAt(run, {0, 12, 24}), kMaxFalseShare);
  // Side by side they would hold every place that both have seen twice.
  const ScriptedRun together = RunScript(alone, folder_);
  const auto num_together = static_cast<double>(together.reconstruction.maps[0].model.size());
  const auto num_joined = static_cast<double>(run.reconstruction.maps[0].model.size());
  EXPECT_LT(num_joined, 1.1 * num_together);
  EXPECT_GT(num_joined, 0.9 * num_together);
}

}  // namespace
}  // namespace mono3d
