// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/core/options.h"
#include "mono3d/core/timing.h"
#include "mono3d/depth/depth_estimator.h"
#include "mono3d/fusion/surfel_map.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/gpu/device.h"
#include "mono3d/image/depth_map.h"
#include "mono3d/image/frame.h"
#include "mono3d/image/sparse_model.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/keyframes/keyframe_selector.h"
#include "mono3d/tracking/tracker.h"

namespace mono3d {

// Frames that come at their own pace (Pipeline::Push) and wait while the tracker is busy. The
// oldest one is dropped when one of the limits is passed; the newest one never is.
struct LiveOptions {
  double max_delay_s = 0.5;     // that a frame waits
  double max_waiting_mb = 512;  // images of all frames that wait

  void Visit(OptionVisitor& visit);
};

// All options of the chain, by module.
struct PipelineOptions {
  // Real time: the tracker maps, and the models are made, in threads of their own, so that no frame
  // waits for them. One bundle waits while another is worked at; a newer one takes its place, and
  // is counted as dropped (paper, section 3.1). Else everything is processed in the order of the
  // frames, and the same input with the same options gives the same result, if the tracker does.
  bool is_live = false;  // not among the listed options: tools have --live for it
  LiveOptions live;
  TrackerOptions tracking;
  KeyframeSelectorOptions keyframes;
  DepthEstimatorOptions depth;
  SurfelMapOptions fusion;
  // What belongs to the exported model. When fewer maps were fused than must agree on a surfel, all
  // that every map agrees on are exported.
  SurfelExportOptions surfel_export;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// The stages of the chain; each can be replaced by one of your own.
struct PipelineStages {
  std::unique_ptr<Tracker> tracker;
  std::unique_ptr<KeyframeSelector> keyframe_selector;
  std::unique_ptr<DepthEstimator> depth_estimator;
  // Called once for each map of the tracker from which there is a depth map.
  std::function<std::unique_ptr<SurfelMap>()> create_surfel_map;
};

// mono3d's own stages; with `options.is_live` the tracker is in its mode "live". `times`, where
// given, must outlive them.
PipelineStages CreateStages(const PipelineOptions& options, const std::shared_ptr<Device>& device,
                            StageTimes* times = nullptr);

// What happened so far.
struct PipelineCounts {
  std::int64_t num_frames = 0;
  std::int64_t num_dropped_frames = 0;           // besides: pushed, but waited for too long
  std::int64_t num_tracked = 0;                  // when they came
  std::int64_t num_recovered = 0;                // later: before a start, or during a loss
  std::int64_t num_keyframes = 0;                // finalised ones
  std::int64_t num_keyframes_without_image = 0;  // they came to nothing; see Tracker
  std::int64_t num_bundles = 0;
  std::int64_t num_dropped_bundles = 0;  // of them, live: the depth stage was busy
  std::int64_t num_depth_maps = 0;
  std::int64_t num_fused = 0;
  std::int64_t num_fused_late = 0;       // of them, at a later attempt
  std::int64_t num_repairs = 0;          // times that the latest part of a model was made again
  std::int64_t num_submaps_started = 0;  // depth maps that showed nothing of the model so far
  std::int64_t num_submaps_joined = 0;   // that a depth map showed to be part of an older one
  std::int64_t num_models_joined = 0;    // of two maps of the tracker that became one
  std::int64_t num_corrections = 0;      // times that the model was moved with the tracker's map
  // Depth maps of which the tracker was told that the model has them elsewhere; some twice, of two
  // submaps.
  std::int64_t num_constraints = 0;
  // How often, by reason.
  std::map<std::string, std::int64_t> untracked_frames;  // when they came
  std::map<std::string, std::int64_t> rejected_bundles;
  std::map<std::string, std::int64_t> rejected_depth_maps;
};

struct PipelineProgress {
  const PipelineCounts& counts;
  const TrackingResult& tracking;  // of the latest frame
  std::int64_t num_surfels = 0;    // in the current model
  const ModelHealth& health;       // of the current model
};

// Called from within Process and Finish; what they throw comes out there. Live, on_depth_map is
// called by the thread that makes the models, on_frame, after Start, by the one that tracks; what
// they throw comes out of a later call.
struct PipelineObserver {
  std::function<void(const PipelineProgress&)> on_frame;
  std::function<void(const DepthMap&, const FusionResult&)> on_depth_map;
};

// What became of one depth map, or of a later attempt with it.
struct FusionRecord {
  std::int64_t frame_index = 0;
  FusionStatus status = FusionStatus::kRejected;
  std::string reason;     // why it was rejected
  bool is_retry = false;  // it had been tried before
  RegistrationEvidence registration;
  bool starts_submap = false;  // it showed nothing of the model so far
  bool is_repaired = false;    // after it the latest part of the model was made again
};

// From this depth map on the model was in another state.
struct HealthChange {
  std::int64_t frame_index = 0;
  HealthState state = HealthState::kGood;
  std::string reason;
};

// What the chain knows of one map of the tracker; maps have no common frame or scale.
struct MapReconstruction {
  int map_id = 0;
  std::vector<TrajectoryEntry> trajectory;         // every tracked frame, final
  std::vector<TrajectoryEntry> online_trajectory;  // as known when tracked, in order of time
  std::vector<TrajectoryEntry> keyframes;
  std::vector<TrajectoryEntry> model_trajectory;  // fused depth maps
  PointCloud model;
  SparseModel sparse;                        // the tracker's keyframes and points
  std::vector<FusionRecord> fusions;         // in the order in which they were tried
  ModelHealth health;                        // at the end
  std::vector<HealthChange> health_changes;  // good at first
  std::vector<SubmapJoin> submap_joins;
};

// How a live run kept up with frames that came at their own pace.
struct LiveStatistics {
  std::int64_t num_dropped_frames = 0;
  double frames_per_s = 0;  // that were tracked
  // From when a frame was pushed until its pose was known: mean, exceeded by one in twenty,
  // largest.
  double mean_latency_ms = 0, p95_latency_ms = 0, max_latency_ms = 0;
};

struct Reconstruction {
  std::vector<MapReconstruction> maps;  // the one with most tracked frames first
  PipelineCounts counts;
  std::optional<LiveStatistics> live;  // after Start
};

// What became of a pushed frame: it waits to be tracked, or is being tracked.
struct PushResult {
  std::vector<std::int64_t> dropped;  // indices of earlier frames that were dropped instead
  std::int64_t num_waiting = 0;       // with this one
};

// What there is at one moment.
struct PipelineSnapshot {
  // The latest frame: what became of it, and its pose by `keyframe_poses`.
  std::int64_t frame_index = -1;  // none yet
  double timestamp_s = 0;
  TrackingStatus status = TrackingStatus::kNotInitialised;
  std::string reason;  // why it has no pose
  std::optional<TrajectoryEntry> pose;
  KeyframePosesPtr keyframe_poses;  // never null
  PipelineCounts counts;
  std::int64_t num_surfels = 0;  // in the current model
  ModelHealth health;            // of the current model
  // The surfels of the current model as they were published last, `version` counting these
  // publications from 1. Null where none is newer than the version that was asked about. They are
  // in the world of map `model_map_id` as it was by `model_poses`, and shared: never changed.
  std::uint64_t version = 0;
  std::shared_ptr<const PointCloud> surfels;
  int model_map_id = 0;
  KeyframePosesPtr model_poses;
};

// The chain of the paper's Figure 1. Used in one of two ways:
//
//   In the order of the frames        At the pace of a camera (options.is_live)
//   Process, Process, ..., Finish     Start; Push, Push, ...; Stop
//   or Run
//
// Snapshot may be called at any time by any thread, Push by any thread, in the order of time. All
// other calls come from one thread at a time.
class Pipeline {
 public:
  // Of the options, those of the stages have been given to CreateStages.
  explicit Pipeline(PipelineStages stages, PipelineObserver observer = {},
                    const PipelineOptions& options = {});
  // Ends after the work in hand. What waits is left undone.
  ~Pipeline();

  // Takes the next frame through all stages that it sets in motion; live, through tracking and the
  // choice of keyframes. The caller may change its image afterwards: where the frame is not the
  // only one that holds it, it is copied. Throws Error after Start.
  void Process(Frame frame);

  // Takes what is still on its way through the stages and hands over the result. Call once, last.
  // After a Process that threw, or a Finish, too: what there was before is not lost, and what is on
  // its way is left out where a stage after the tracker threw.
  [[nodiscard]] Reconstruction Finish();

  // Process for all frames of the source, until it ends or `*stop` becomes true; then Finish.
  [[nodiscard]] Reconstruction Run(FrameSource& source, const std::atomic<bool>* stop = nullptr);

  // Begins to track frames that are pushed, in a thread of its own. Throws Error on the second call
  // and after Process.
  void Start();

  // Hands a frame over and returns at once. While the tracker is busy frames wait, and old ones are
  // dropped as LiveOptions says. The caller may change the image afterwards: where the frame is not
  // the only one that holds it, it is copied. Throws Error before Start and after Stop; on a frame
  // that is invalid, of another camera than the first or not after the one before, which is then
  // left out; and what one of the threads has thrown, after which no more frames are tracked.
  PushResult Push(Frame frame);

  // What there is by now. Nothing waits for it, and it waits for nothing but to copy values. The
  // first call asks for surfels: from then on they are published, in the thread that makes the
  // models, as often as that takes no more than a tenth of its time. Throws what one of the threads
  // has thrown, unless an earlier call has.
  [[nodiscard]] PipelineSnapshot Snapshot(std::uint64_t since_version = 0) const;

  // No more frames: tracks those that wait, and then as Finish. Throws what one of the threads has
  // thrown, unless an earlier call has; another call returns what there was before. Without Start
  // there was no frame.
  [[nodiscard]] Reconstruction Stop();

  // Until Start, or after Finish or Stop.
  const Tracker& tracker() const;

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace mono3d
