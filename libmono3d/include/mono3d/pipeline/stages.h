// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <functional>
#include <memory>
#include <optional>

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/core/timing.h"
#include "mono3d/depth/depth_estimator.h"
#include "mono3d/fusion/surfel_map.h"
#include "mono3d/geo/georeference.h"
#include "mono3d/geo/ground_control.h"
#include "mono3d/geo/position_track.h"
#include "mono3d/gpu/device.h"
#include "mono3d/keyframes/keyframe_selector.h"
#include "mono3d/tracking/photo_mapper.h"
#include "mono3d/tracking/tracker.h"

namespace MONO3D_EXPORT mono3d {

// Frames that come at their own pace (Pipeline::Push) and wait while the tracker is busy. The
// oldest one is dropped when one of the limits is passed; the newest one never is.
struct LiveOptions {
  double max_delay_s = 0.5;     // that a frame waits
  double max_waiting_mb = 512;  // images of all frames that wait
  // Bundles that wait for the depth stage, beyond which the oldest is dropped: they come in bursts,
  // and a map that is adjusted as a whole holds depth up for a second. Eight are two seconds.
  int max_waiting_bundles = 8;

  void Visit(OptionVisitor& visit);
};

// Where the drone was while it filmed, as it wrote it down, and what was surveyed on the ground.
struct PipelinePositions {
  PositionTrack track;  // without fixes: the drone wrote nothing
  GeoreferenceOptions georeference;
  int turn_deg = 0;  // ReadShownTurn of the images: see ChooseWorldAxes
  std::optional<GroundControl> control = {};
};

// All options of the chain, by module.
struct PipelineOptions {
  // Real time: the tracker maps, and the models are made, in threads of their own, so that no frame
  // waits for them. Bundles that come while one is worked at wait; depth maps take less work as
  // soon as they do, and where that is not enough the oldest is dropped and counted (paper,
  // section 3.1). Else everything is processed in the order of the frames, and the same input with
  // the same options gives the same result, if the tracker does.
  bool is_live = false;  // not among the listed options: tools have --live for it
  // In the order of the frames: threads of their own make the models while the next frames are
  // tracked, one the next depth map while the other one fuses the one before, two bundles behind at
  // most; what they tell the tracker comes at the same frame in each run. False: each Process ends
  // with the models up to date. Not among the listed options either.
  bool models_trail = true;
  // Photographs in any order instead of a video: CreatePhotoMapper instead of the tracker, and the
  // views of a depth map are chosen among all of them, in Finish. Not with is_live. Not among the
  // listed options either.
  bool are_photos = false;
  // The maps follow them (Tracker::FollowPositions) while they grow and in Finish, photographs in
  // Finish. Their frames and units stay: see PlaceOnEarth. They may come while the run goes on
  // (Pipeline::GivePositions): then a track without fixes. Not among the listed options either.
  std::optional<PipelinePositions> positions;
  LiveOptions live;
  TrackerOptions tracking;
  PhotoMapperOptions photos;
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
// With a depth estimator that is made already: its kernels take a third of a second on a processor,
// for which another thread need not wait.
PipelineStages CreateStages(const PipelineOptions& options, const std::shared_ptr<Device>& device,
                            std::unique_ptr<DepthEstimator> depth_estimator,
                            StageTimes* times = nullptr);

}  // namespace mono3d
