// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/local_volume.h"
#include "gpu/recorder.h"
#include "mono3d/depth/depth_estimator.h"

namespace mono3d {

// SGM and SGM^sn over the planes around each pixel's prior (shaders/depth/local_sgm.comp).
class LocalSgmStage {
 public:
  LocalSgmStage(std::shared_ptr<Device> device, const SgmOptions& options);

  // The first `num_paths` directions, kFewPaths or kNumPaths. `ranges` is that of PriorStage,
  // `costs` of LocalSweepStage. `paths` and `more_paths` get the path costs of four directions
  // each, 4 * kLocalPlanes bytes for each of NumLocalPixels.
  void Record(Recorder& recorder, LevelSize size, const Buffer& costs, const Buffer& ranges,
              const Buffer& paths, const Buffer& more_paths, std::uint32_t num_paths) const;

 private:
  SgmOptions options_;
  Kernel kernel_;
  Buffer jump_penalties_;
};

}  // namespace mono3d
