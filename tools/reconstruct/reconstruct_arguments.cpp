// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/reconstruct_arguments.h"

#include <cstdio>

#include "mono3d/core/error.h"

namespace mono3d::tools {

std::vector<OptionField> ListAll(ReconstructArguments& arguments) {
  OptionVisitor visitor;
  arguments.source.Visit(visitor);
  arguments.size.Visit(visitor);
  arguments.mask.Visit(visitor);
  visitor.Group("calibration", arguments.camera.calibration);
  arguments.pipeline.Visit(visitor);
  visitor.Group("live.calibration", arguments.self_calibration);
  visitor.Group("live.input", arguments.live_input);
  visitor.Group("positions", arguments.positions.georeference);
  visitor.Group("control", arguments.control.options);
  return visitor.fields();
}

void RequireSameCamera(ReconstructArguments& arguments) {
  if (arguments.map.empty()) return;
  if (arguments.camera.file.empty()) {
    throw UsageError(
        ErrorParts{.what = "a saved map needs the camera of its run",
                   .where = "--map",
                   .expected = "--camera with its calibration, or with its learned_camera.yaml",
                   .found = {}});
  }
  arguments.camera.is_held = true;
}

void PrepareForLive(ReconstructArguments& arguments) {
  const bool is_live_input = IsLiveInput(arguments.input);
  arguments.pipeline.is_live = arguments.pipeline.is_live || is_live_input;
  if (arguments.pipeline.is_live) arguments.pipeline.tracking.mode = "live";  // in run.json too
  if (!is_live_input) return;
  // There is nothing beside it, and nothing to go back to.
  if (arguments.positions.source == "auto") arguments.positions.source = "none";
  arguments.written.images = ImagePlacing::kNone;
}

void TakeEveryImageLive(FrameSourceOptions& source) {
  if (source.stride != kStrideByMotion) return;
  std::printf("--stride auto is for recordings that are not played live: every image is taken\n");
  source.stride = 1;
}

}  // namespace mono3d::tools
