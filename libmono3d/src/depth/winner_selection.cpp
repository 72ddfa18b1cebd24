// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/winner_selection.h"

#include <utility>

#include "depth/buffers.h"

namespace mono3d {

WinnerSelection::WinnerSelection(std::shared_ptr<Device> device, DepthKernels& kernels,
                                 const DepthEstimatorOptions& options)
    : device_(std::move(device)), kernels_(kernels), options_(options) {}

std::uint32_t WinnerSelection::MaxCost(bool is_last) const {
  return is_last ? static_cast<std::uint32_t>(options_.winner_takes_all.max_cost) : 255u;
}

float WinnerSelection::MinUniqueness(bool is_last) const {
  return is_last ? static_cast<float>(options_.winner_takes_all.min_uniqueness) : -1.0f;
}

void WinnerSelection::Prepare(LevelSize size) {
  const std::size_t map_bytes = sizeof(float) * size.num_pixels();
  Reserve(winner_depth_, device_, map_bytes, "depth/winner");
  Reserve(winner_uniqueness_, device_, map_bytes, "depth/uniqueness");
  Reserve(median_depth_, device_, map_bytes, "depth/median");
  Reserve(median_confidence_, device_, map_bytes, "depth/median_confidence");
}

void WinnerSelection::RecordMedian(Recorder& recorder, const SweepPlan& plan, bool is_last) {
  if (!has_median()) return;
  // Surfaces steeper than one plane a pixel are hidden from one side or the other; in the window
  // the farthest pixel is 2 px from the middle.
  kernels_.Median(
      recorder, is_last,
      {.width_px = plan.size.width_px,
       .height_px = plan.size.height_px,
       .min_support = is_last ? static_cast<std::uint32_t>(options_.median.min_support) : 1u,
       .tolerance = static_cast<float>(2 * plan.step)},
      winners(), {median_depth_, median_confidence_});
}

const Buffer& WinnerSelection::inverse_depth() const {
  return has_median() ? median_depth_ : winner_depth_;
}

const Buffer& WinnerSelection::confidence() const {
  return has_median() ? median_confidence_ : winner_uniqueness_;
}

}  // namespace mono3d
