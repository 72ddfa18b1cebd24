// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/choice.h"

#include <utility>

#include "depth/buffers.h"

namespace mono3d {

Choice::Choice(std::shared_ptr<Device> device, const DepthEstimatorOptions& options)
    : device_(std::move(device)),
      options_(options),
      median_(device_, false),
      last_median_(device_) {}

std::uint32_t Choice::MaxCost(bool is_last) const {
  return is_last ? static_cast<std::uint32_t>(options_.winner_takes_all.max_cost) : 255u;
}

float Choice::MinUniqueness(bool is_last) const {
  return is_last ? static_cast<float>(options_.winner_takes_all.min_uniqueness) : -1.0f;
}

void Choice::Prepare(LevelSize size) {
  const std::size_t map_bytes = sizeof(float) * size.num_pixels();
  Reserve(winner_depth_, device_, map_bytes, "depth/winner");
  Reserve(winner_uniqueness_, device_, map_bytes, "depth/uniqueness");
  Reserve(median_depth_, device_, map_bytes, "depth/median");
  Reserve(median_confidence_, device_, map_bytes, "depth/median_confidence");
}

void Choice::RecordMedian(Recorder& recorder, const SweepPlan& plan, bool is_last) const {
  if (!has_median()) return;
  const MedianStage& median = is_last ? last_median_ : median_;
  // Surfaces steeper than one plane a pixel are hidden from one side or the other; in the window
  // the farthest pixel is 2 px from the middle.
  median.Record(
      recorder,
      {.width_px = plan.size.width_px,
       .height_px = plan.size.height_px,
       .min_support = is_last ? static_cast<std::uint32_t>(options_.median.min_support) : 1u,
       .tolerance = static_cast<float>(2 * plan.step)},
      winner_depth_, winner_uniqueness_, median_depth_, median_confidence_);
}

const Buffer& Choice::inverse_depth() const { return has_median() ? median_depth_ : winner_depth_; }

const Buffer& Choice::confidence() const {
  return has_median() ? median_confidence_ : winner_uniqueness_;
}

}  // namespace mono3d
