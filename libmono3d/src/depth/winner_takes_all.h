// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/winner_takes_all.params.h"
#include "gpu/recorder.h"

namespace mono3d {

// The best plane of each pixel and the place between planes (shaders/depth/winner_takes_all.comp).
class WinnerTakesAllStage {
 public:
  // Without `sub_plane` the depth is that of the plane itself.
  explicit WinnerTakesAllStage(std::shared_ptr<Device> device, bool sub_plane = true);

  void Record(Recorder& recorder, const WinnerTakesAllParams& params, const Buffer& sums,
              const Buffer& costs, const Buffer& inverse_depth, const Buffer& uniqueness) const;

 private:
  Kernel kernel_;
};

}  // namespace mono3d
