// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>
#include <opencv2/core/mat.hpp>
#include <span>
#include <vector>

#include "depth/kernels.h"
#include "depth/normals.params.h"
#include "depth/padded_image.h"
#include "depth/sweep_geometry.h"
#include "gpu/buffer.h"
#include "gpu/recorder.h"
#include "mono3d/depth/depth_estimator.h"

namespace mono3d {

// Infers the depth of pixels that were not matched from the surface around them: the smooth surface
// through the depths that were, held together where grey values are alike, from coarse to fine
// (shaders/depth/inference*.comp). Keeps its buffers from one bundle to the next.
class Inference {
 public:
  // `kernels` must outlive it.
  Inference(std::shared_ptr<Device> device, DepthKernels& kernels, const InferenceOptions& options);

  struct Input {
    LevelSize size;           // full resolution
    const Buffer& images;     // padded, the reference first
    const Buffer& halved;     // the same at half the resolution
    EstimateBuffers matched;  // inverse depth before the texture filter
    const Buffer& depth;      // after it, su; 0: none
    const Buffer& winners;    // of the level swept last: inverse depth, negative where not clear
    LevelSize winner_size;    // of that level
    int winner_level = 0;     // its halvings
    double step = 0;          // between its planes, 1/su
    SourceProjections projections;  // at full resolution
    int min_views = 0;              // sources that must see a point
    int min_coarse_views = 0;       // the same where it was matched on a coarser level
    cv::Mat cells;                  // FindPlanarRegions, FindCoarseMatches (inference.glsl)
    // In which something was not matched (TilesWithoutDepth), at least one.
    std::span<const std::uint32_t> tiles;
    NormalsParams normals;
  };

  // The results are there after recorder.Submit().
  void Record(Recorder& recorder, const Input& input);

  const Buffer& inverse_depth() const { return inverse_depth_; }  // 1/su, matched or inferred
  // Above 0 where inferred; below 0 where it was matched on a coarser level, as `cells` say.
  const Buffer& confidence() const { return confidence_; }
  const Buffer& normals() const { return normals_; }  // of the pixels of `tiles`

 private:
  // Half the resolution is the first; the last has one pixel.
  struct Level {
    LevelSize size = {};
    Buffer data = {};
    Buffer state = {};
    Buffer next = {};
  };

  void Prepare(LevelSize full);
  void RecordSurface(Recorder& recorder);

  std::shared_ptr<Device> device_;
  DepthKernels& kernels_;
  InferenceOptions options_;
  std::vector<Level> levels_;
  Buffer projections_;
  Buffer cells_;
  Buffer tiles_;
  Buffer normals_;
  Buffer inverse_depth_;
  Buffer confidence_;
};

}  // namespace mono3d
