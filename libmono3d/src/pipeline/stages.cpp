// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/stages.h"

#include <utility>

#include "mono3d/core/error.h"
#include "mono3d/core/options.h"

namespace mono3d {

void LiveOptions::Visit(OptionVisitor& visit) {
  visit("max_delay_s", max_delay_s, "time that a frame waits to be tracked; then it is dropped");
  visit("max_waiting_mb", max_waiting_mb,
        "images of frames that wait to be tracked; beyond it the oldest frame is dropped");
  visit("max_waiting_bundles", max_waiting_bundles,
        "bundles that wait for the depth stage; beyond it the oldest is dropped");
}

void PipelineOptions::Visit(OptionVisitor& visit) {
  visit.Group("live", live);
  visit.Group("tracking", tracking);
  visit.Group("photos", photos);
  visit.Group("keyframes", keyframes);
  visit.Group("depth", depth);
  visit.Group("fusion", fusion);
  visit.Group("fusion.export", surfel_export);
}

void PipelineOptions::Validate() const {
  RequireOption(live.max_delay_s >= 0, "live.max_delay_s", "0 or more", live.max_delay_s);
  RequireOption(live.max_waiting_mb > 0, "live.max_waiting_mb", "more than 0", live.max_waiting_mb);
  RequireOption(live.max_waiting_bundles >= 1, "live.max_waiting_bundles", "1 or more",
                live.max_waiting_bundles);
  if (is_live && are_photos) {
    throw UsageError("photographs are placed together at the end, so not at the pace of a camera");
  }
  tracking.Validate();
  photos.Validate();
  keyframes.Validate();
  depth.Validate();
  fusion.Validate();
  surfel_export.Validate();
}

PipelineStages CreateStages(const PipelineOptions& options, const std::shared_ptr<Device>& device,
                            StageTimes* times) {
  options.Validate();
  return CreateStages(options, device, CreateDepthEstimator(device, options.depth, times), times);
}

PipelineStages CreateStages(const PipelineOptions& options, const std::shared_ptr<Device>& device,
                            std::unique_ptr<DepthEstimator> depth_estimator, StageTimes* times) {
  options.Validate();
  PipelineStages stages;
  TrackerOptions tracking = options.tracking;
  if (options.is_live) tracking.mode = "live";
  KeyframeSelectorOptions keyframes = options.keyframes;
  SurfelMapOptions fusion = options.fusion;
  if (options.are_photos) {
    stages.tracker = CreatePhotoMapper(options.photos, times);
    keyframes.is_unordered = true;
    fusion.registration.moves = false;  // all poses come from one adjustment
  } else {
    stages.tracker = CreateTracker(tracking, times);
  }
  stages.keyframe_selector = CreateKeyframeSelector(keyframes);
  stages.depth_estimator = std::move(depth_estimator);
  stages.create_surfel_map = [device, fusion, times] {
    return CreateSurfelMap(device, fusion, times);
  };
  return stages;
}

}  // namespace mono3d
