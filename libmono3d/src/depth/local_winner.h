// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/local_volume.h"
#include "depth/local_winner.params.h"
#include "gpu/recorder.h"

namespace mono3d {

// The best of the planes around the prior (shaders/depth/local_winner.comp). `paths` and
// `more_paths` hold the volumes of four directions each; the results are size.num_pixels() floats.
class LocalWinnerStage {
 public:
  // `num_paths`: kNumPaths, or kFewPaths, for which `more_paths` is not read. Without `sub_plane`
  // the depth is that of the plane itself.
  LocalWinnerStage(std::shared_ptr<Device> device, std::uint32_t num_paths, bool sub_plane = true);

  void Record(Recorder& recorder, const LocalWinnerParams& params, const Buffer& paths,
              const Buffer& more_paths, const Buffer& costs, const Buffer& ranges,
              const Buffer& inverse_depth, const Buffer& uniqueness) const;

 private:
  Kernel kernel_;
};

}  // namespace mono3d
