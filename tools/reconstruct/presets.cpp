// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reconstruct/presets.h"

namespace mono3d::tools {

void SetFast(PipelineOptions& options) {
  options.depth.pyramid.level = 1;
  options.keyframes.min_reference_baseline_ratio *= 2;
}

void SetBest(PipelineOptions& options, WorkingSize& size) {
  options.keyframes.num_images = 9;
  options.keyframes.min_reference_baseline_ratio /= 2;
  size.is_doubled = true;
}

void AddPresets(Tool& tool, PipelineOptions& options, WorkingSize& size) {
  CLI::Option* fast =
      tool.AddPreset("--fast", "a first look: half as many depth maps, matched at half resolution",
                     [&options] { SetFast(options); });
  CLI::Option* best =
      tool.AddPreset("--best",
                     "twice as many depth maps, each of nine images instead of five, of large "
                     "images at twice the size",
                     [&options, &size] { SetBest(options, size); });
  fast->excludes(best);
}

void AddMemoryLimit(Tool& tool, PipelineOptions& options) {
  constexpr int kLeast_mb = 16;
  constexpr int kMost_mb = 1 << 24;
  tool.app()
      .add_option_function<int>(
          "--max-memory",
          [&options](const int& mb) {
            SurfelStorageOptions& storage = options.fusion.storage;
            storage.max_device_mb = mb - mb / 4;
            storage.max_host_mb = mb / 4;
          },
          "MB of memory for the surfels of the model, of any length of the flight: those that are "
          "out of view beyond it are in a file in the output folder until the run ends (default: "
          "three eighths of the memory)")
      ->check(CLI::Range(kLeast_mb, kMost_mb));
}

std::vector<std::string> ShownOptions() {
  return {"help", "help-all", "version",  "output", "camera",   "photos",    "live",   "view",
          "fast", "best",     "max-side", "stride", "products", "positions", "device", "config"};
}

}  // namespace mono3d::tools
