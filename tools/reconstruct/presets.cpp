// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/presets.h"

namespace mono3d::tools {

void SetFast(PipelineOptions& options) {
  options.depth.pyramid.level = 1;
  options.keyframes.min_reference_baseline_ratio *= 2;
}

void SetBest(PipelineOptions& options) {
  options.keyframes.num_images = 9;
  options.keyframes.min_reference_baseline_ratio /= 2;
}

void AddPresets(Tool& tool, PipelineOptions& options) {
  CLI::Option* fast =
      tool.AddPreset("--fast", "a first look: half as many depth maps, matched at half resolution",
                     [&options] { SetFast(options); });
  CLI::Option* best =
      tool.AddPreset("--best", "twice as many depth maps, each of nine images instead of five",
                     [&options] { SetBest(options); });
  fast->excludes(best);
}

std::vector<std::string> ShownOptions() {
  return {"help", "help-all", "version", "output", "camera",   "photos",    "live",   "view",
          "fast", "best",     "resize",  "stride", "products", "positions", "device", "config"};
}

}  // namespace mono3d::tools
