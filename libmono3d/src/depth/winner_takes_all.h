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
  explicit WinnerTakesAllStage(std::shared_ptr<Device> device);

  void Record(Recorder& recorder, const WinnerTakesAllParams& params, const Buffer& sums,
              const Buffer& costs, const Buffer& inverse_depth, const Buffer& uniqueness) const;

 private:
  Kernel kernel_;
};

}  // namespace mono3d
