// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/median.h"
#include "depth/sweep_plan.h"
#include "gpu/buffer.h"
#include "gpu/recorder.h"
#include "mono3d/depth/depth_estimator.h"

namespace mono3d {

// How the matching of a level ends: the winners, and the median of them unless
// options.median.min_support is 0. Every winner is kept, as a prior, on all levels but the last.
class Choice {
 public:
  Choice(std::shared_ptr<Device> device, const DepthEstimatorOptions& options);

  // Limits for the winners of a level.
  std::uint32_t MaxCost(bool is_last) const;
  float MinUniqueness(bool is_last) const;

  // Makes room for size.num_pixels() floats in each buffer; call before the winners are recorded.
  void Prepare(LevelSize size);

  const Buffer& winner_depth() const { return winner_depth_; }            // to be written, 1/su
  const Buffer& winner_uniqueness() const { return winner_uniqueness_; }  // to be written

  // Call after the winners are recorded.
  void RecordMedian(Recorder& recorder, const SweepPlan& plan, bool is_last) const;

  const Buffer& inverse_depth() const;  // 1/su; 0: no estimate
  const Buffer& confidence() const;     // of the last level, 0 to 1

 private:
  bool has_median() const { return options_.median.min_support > 0; }

  std::shared_ptr<Device> device_;
  DepthEstimatorOptions options_;
  MedianStage median_;  // without confidence
  MedianStage last_median_;
  Buffer winner_depth_;
  Buffer winner_uniqueness_;
  Buffer median_depth_;
  Buffer median_confidence_;
};

}  // namespace mono3d
