// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/kernels.h"
#include "depth/sweep_plan.h"
#include "gpu/buffer.h"
#include "gpu/recorder.h"
#include "mono3d/depth/depth_estimator.h"

namespace mono3d {

// The last step of matching on a level: which winning planes are kept, and the median of them
// unless options.median.min_support is 0. Every winner is kept, as a prior, on all levels but the
// last.
class WinnerSelection {
 public:
  // `kernels` must outlive it.
  WinnerSelection(std::shared_ptr<Device> device, DepthKernels& kernels,
                  const DepthEstimatorOptions& options);

  // Limits for the winners of a level.
  std::uint32_t MaxCost(bool is_last) const;
  float MinUniqueness(bool is_last) const;

  // Makes room for size.num_pixels() floats in each buffer; call before the winners are recorded.
  void Prepare(LevelSize size);

  // To be written by the kernel that finds the winners: inverse depth (fine_winner.glsl) and
  // uniqueness, 0 to 1.
  EstimateBuffers winners() const { return {winner_depth_, winner_uniqueness_}; }

  // Call after the winners are recorded.
  void RecordMedian(Recorder& recorder, const SweepPlan& plan, bool is_last);

  const Buffer& inverse_depth() const;  // 1/su; 0: no estimate
  const Buffer& confidence() const;     // of the last level, 0 to 1

 private:
  bool has_median() const { return options_.median.min_support > 0; }

  std::shared_ptr<Device> device_;
  DepthKernels& kernels_;
  DepthEstimatorOptions options_;
  Buffer winner_depth_;
  Buffer winner_uniqueness_;
  Buffer median_depth_;
  Buffer median_confidence_;
};

}  // namespace mono3d
