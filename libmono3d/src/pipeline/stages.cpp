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
  visit.Group("fusion.export", surfel_export);
}

void PipelineOptions::Validate() const {
  tracking.Validate();
  keyframes.Validate();
  depth.Validate();
  fusion.Validate();
  surfel_export.Validate();
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
