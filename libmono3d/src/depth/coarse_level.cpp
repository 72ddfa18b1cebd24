// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/coarse_level.h"

#include <span>
#include <utility>
#include <vector>

#include "depth/buffers.h"

namespace mono3d {

CoarseLevel::CoarseLevel(std::shared_ptr<Device> device, DepthKernels& kernels,
                         const DepthEstimatorOptions& options)
    : device_(std::move(device)),
      kernels_(kernels),
      options_(options),
      penalties_(UploadPenalties(device_, options.sgm)),
      winner_selection_(device_, kernels, options),
      projections_(device_, kMaxProjectionBytes, "depth/projections") {}

void CoarseLevel::RecordSweep(Recorder& recorder, const SweepPlan& plan,
                              const SourceProjections& projections, const Buffer& images) {
  const auto num_images = static_cast<std::uint32_t>(1 + projections.size());
  const std::size_t cost_bytes = plan.size.num_pixels() * plan.padded_planes;
  Reserve(census_, device_, 8 * plan.size.num_strided_pixels() * num_images, "depth/census");
  Reserve(costs_, device_, cost_bytes, "depth/costs");
  Reserve(sums_, device_, 2 * cost_bytes, "depth/sums");
  const std::vector<float> packed = Pack(projections, plan.size);
  projections_.Upload(std::span<const float>(packed));
  kernels_.Census(recorder, images, plan.size, num_images, PackQuarterTurns(projections), census_);
  kernels_.PlaneSweep(recorder, {projections.size(), options_.plane_sweep.side_tolerance},
                      {.width_px = plan.size.width_px,
                       .height_px = plan.size.height_px,
                       .num_planes = plan.num_planes,
                       .padded_planes = plan.padded_planes,
                       .inverse_depth = static_cast<float>(plan.inverse_depth),
                       .inverse_depth_step = static_cast<float>(plan.step)},
                      census_, projections_, costs_);
  kernels_.Sgm(recorder, plan.size, plan.padded_planes, penalties_, images, costs_, sums_);
}

void CoarseLevel::RecordWinnerSelection(Recorder& recorder, const SweepPlan& plan, bool is_last) {
  winner_selection_.Prepare(plan.size);
  kernels_.WinnerTakesAll(recorder, options_.winner_takes_all.sub_plane,
                          {.width_px = plan.size.width_px,
                           .height_px = plan.size.height_px,
                           .num_planes = plan.num_planes,
                           .padded_planes = plan.padded_planes,
                           .max_cost = winner_selection_.MaxCost(is_last),
                           .min_uniqueness = winner_selection_.MinUniqueness(is_last),
                           .inverse_depth = static_cast<float>(plan.inverse_depth),
                           .inverse_depth_step = static_cast<float>(plan.step)},
                          sums_, costs_, winner_selection_.winners());
  winner_selection_.RecordMedian(recorder, plan, is_last);
}

void CoarseLevel::Record(Recorder& recorder, const SweepPlan& plan,
                         const SourceProjections& projections, const Buffer& images, bool is_last) {
  RecordSweep(recorder, plan, projections, images);
  RecordWinnerSelection(recorder, plan, is_last);
}

}  // namespace mono3d
