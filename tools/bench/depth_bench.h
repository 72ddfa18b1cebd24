// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <vector>

#include "bench/device_times.h"
#include "bench/sequence_result.h"
#include "mono3d/depth/depth_estimator.h"
#include "report/table.h"

namespace mono3d::tools {

// What the depth of some images of a sequence costs.
struct DepthBenchOptions {
  std::string folder;  // of a sequence: images/, camera.yaml, groundtruth.txt
  std::string poses;   // a pose for each image, as in groundtruth.txt, the default
  std::string resize;  // WIDTHxHEIGHT
  int reference = -1;  // index of the middle image, from 0; -1: the middle of the sequence
  int num_images = static_cast<int>(kBundleSize);  // of the bundle
  int step = 10;                                   // images from one of the bundle to the next
  int num_repeats = 8;                             // timed maps
  bool compare = true;  // with OpenCV's StereoSGBM, in the same process and in turn
  DepthEstimatorOptions depth;
};

struct DepthBenchResult {
  std::string device;
  int num_images = 0;
  int width = 0, height = 0;
  double first_cpu_ms = 0;  // of the map that makes pipelines and buffers and finds the depths
  Spread cpu_ms;            // of this process, all threads, for a map
  Spread sgbm_cpu_ms;       // the same for one StereoSGBM of a pair; 0: not measured
  std::vector<StageSpread> stages;

  double RatioToSgbm() const {
    return sgbm_cpu_ms.least > 0 ? cpu_ms.least / sgbm_cpu_ms.least : 0;
  }
};

// Throws Error when the sequence is too short, a pose is missing, or the images have no depth.
DepthBenchResult BenchDepth(const DepthBenchOptions& options, const DeviceOptions& device);

Table ToTable(const DepthBenchResult& result);
Json ToJson(const DepthBenchResult& result);

}  // namespace mono3d::tools
