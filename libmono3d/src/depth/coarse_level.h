// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/kernels.h"
#include "depth/sgm.h"
#include "depth/sweep_geometry.h"
#include "depth/sweep_plan.h"
#include "depth/winner_selection.h"
#include "gpu/buffer.h"
#include "gpu/recorder.h"
#include "mono3d/depth/depth_estimator.h"

namespace mono3d {

// The coarsest level, which is swept over the whole range of depths: from the images of the level
// to the inverse depth of the reference on it by census, plane sweep, SGM, winner takes all and
// median. Keeps its buffers from one bundle to the next.
class CoarseLevel {
 public:
  // `kernels` must outlive it.
  CoarseLevel(std::shared_ptr<Device> device, DepthKernels& kernels,
              const DepthEstimatorOptions& options);

  // `images` holds padded images of plan.size, the reference and then the sources. The results are
  // there after recorder.Submit(), plan.size.num_pixels() floats each. Every winner is kept, as a
  // prior, unless `is_last`.
  void Record(Recorder& recorder, const SweepPlan& plan, const SourceProjections& projections,
              const Buffer& images, bool is_last);

  const WinnerSelection& results() const { return winner_selection_; }

 private:
  void RecordSweep(Recorder& recorder, const SweepPlan& plan, const SourceProjections& projections,
                   const Buffer& images);
  void RecordWinnerSelection(Recorder& recorder, const SweepPlan& plan, bool is_last);

  std::shared_ptr<Device> device_;
  DepthKernels& kernels_;
  DepthEstimatorOptions options_;
  SgmPenalties penalties_;
  WinnerSelection winner_selection_;
  Buffer census_;
  Buffer projections_;
  Buffer costs_;
  Buffer sums_;
};

}  // namespace mono3d
