// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/scripted_stages.h"

#include <fstream>
#include <memory>
#include <utility>

#include "gpu/test_device.h"
#include "mono3d/pipeline/run_writer.h"
#include "pipeline/keyframe_table.h"

namespace mono3d {
namespace {

using Script = std::vector<ScriptedFrame>;

constexpr double kFrameInterval_s = 0.1;

class ScriptedTracker final : public Tracker {
 public:
  ScriptedTracker(const Script& script, std::vector<KeyframeConstraint>* constraints)
      : script_(script), constraints_(constraints) {}

  TrackingResult Track(const Frame& frame) override {
    const ScriptedFrame& now = script_.at(static_cast<std::size_t>(frame.index));
    TrackingResult result;
    result.status = TrackingStatus::kTracking;
    result.map_id = now.map.map_id;
    result.T_world_cam = now.map.T_world_cam;
    for (const KeyframePose& pose : now.moved) {
      keyframes_.Set(pose.keyframe_id, pose.map_id, pose.S_world_kf);
    }
    keyframes_.Set(frame.index, result.map_id, *result.T_world_cam);
    result.finalised_keyframes = {Keyframe{frame.index, frame, {1}}};
    return result;
  }
  KeyframePosesPtr Poses() const override { return keyframes_.Poses(); }
  void Constrain(std::span<const KeyframeConstraint> constraints) override {
    constraints_->insert(constraints_->end(), constraints.begin(), constraints.end());
  }
  std::vector<Keyframe> Finish() override { return {}; }
  std::vector<TrajectoryEntry> Trajectory() const override {
    return keyframes_.Entries(kFrameInterval_s);
  }
  std::vector<TrajectoryEntry> KeyframeTrajectory() const override { return Trajectory(); }

 private:
  const Script& script_;
  std::vector<KeyframeConstraint>* constraints_;
  KeyframeTable keyframes_;
};

// Each keyframe is a bundle of its own.
class EverySelector final : public KeyframeSelector {
 public:
  std::optional<ImageBundle> Add(const Keyframe& keyframe, const KeyframePoses&) override {
    return ImageBundle{{keyframe}, {}};
  }
};

class ScriptedDepth final : public DepthEstimator {
 public:
  explicit ScriptedDepth(const Script& script) : script_(script) {}

  DepthResult Estimate(const ImageBundle& bundle) override {
    const Keyframe& keyframe = bundle.reference();
    DepthResult result;
    const ScriptedFrame& scripted = script_.at(static_cast<std::size_t>(keyframe.id));
    if (!scripted.matches) {
      result.rejection = DepthRejection::kNoMatch;
      result.reason = "the images do not match";
      return result;
    }
    result.map = scripted.map;
    if (result.map.depth.empty()) {
      result.reason = "no texture";
      return result;
    }
    result.status = DepthStatus::kEstimated;
    result.map.keyframe_id = keyframe.id;
    result.map.frame_index = keyframe.frame.index;
    result.map.timestamp_s = keyframe.frame.timestamp_s;
    return result;
  }

 private:
  const Script& script_;
};

}  // namespace

ScriptedRun RunScript(const Script& script, const std::filesystem::path& folder,
                      const SurfelMapOptions& options) {
  ScriptedRun run;
  PipelineStages stages;
  stages.tracker = std::make_unique<ScriptedTracker>(script, &run.constraints);
  stages.keyframe_selector = std::make_unique<EverySelector>();
  stages.depth_estimator = std::make_unique<ScriptedDepth>(script);
  stages.create_surfel_map = [&] { return CreateSurfelMap(TestDevice(), options); };
  PipelineOptions pipeline_options;
  pipeline_options.surfel_export = {.min_observations = 1, .min_confidence = 0};  // all surfels
  Pipeline pipeline(std::move(stages), {}, pipeline_options);
  for (std::size_t i = 0; i < script.size(); ++i) {
    Frame frame;
    frame.index = static_cast<std::int64_t>(i);
    frame.timestamp_s = kFrameInterval_s * static_cast<double>(i);
    pipeline.Process(frame);
  }
  run.reconstruction = pipeline.Finish();
  const RunWriter writer(folder);
  writer.WriteRecord(run.reconstruction, {});
  std::ifstream file(folder / "run.json");
  run.json = nlohmann::json::parse(file);
  return run;
}

}  // namespace mono3d
