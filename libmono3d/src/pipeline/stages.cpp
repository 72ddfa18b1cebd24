// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/core/options.h"
#include "mono3d/pipeline/pipeline.h"

namespace mono3d {

void PipelineOptions::Visit(OptionVisitor& visit) {
  visit.Group("tracking", tracking);
  visit.Group("keyframes", keyframes);
  visit.Group("depth", depth);
  visit.Group("fusion", fusion);
  visit("pipeline.min_observations", min_observations,
        "depth maps that must agree on a surfel of the exported model");
}

void PipelineOptions::Validate() const {
  tracking.Validate();
  keyframes.Validate();
  depth.Validate();
  fusion.Validate();
  RequireOption(min_observations >= 1, "pipeline.min_observations", "1 or more", min_observations);
}

PipelineStages CreateStages(const PipelineOptions& options, const std::shared_ptr<Device>& device,
                            StageTimes* times) {
  options.Validate();
  PipelineStages stages;
  stages.tracker = CreateTracker(options.tracking, times);
  stages.keyframe_selector = CreateKeyframeSelector(options.keyframes);
  stages.depth_estimator = CreateDepthEstimator(device, options.depth, times);
  stages.create_surfel_map = [device, fusion = options.fusion, times] {
    return CreateSurfelMap(device, fusion, times);
  };
  return stages;
}

}  // namespace mono3d
