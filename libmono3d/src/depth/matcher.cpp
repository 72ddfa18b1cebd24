// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/matcher.h"

#include <span>
#include <utility>

#include "depth/buffers.h"

namespace mono3d {

Matcher::Matcher(std::shared_ptr<Device> device, const DepthEstimatorOptions& options)
    : device_(std::move(device)),
      options_(options),
      half_pixel_(device_),
      census_stage_(device_),
      plane_sweep_(device_, static_cast<std::uint32_t>(options.plane_sweep.side_tolerance)),
      sgm_(device_, options.sgm),
      winner_takes_all_(device_, options.winner_takes_all.sub_plane),
      choice_(device_, options),
      projections_(device_, kMaxProjectionBytes, "depth/projections") {}

void Matcher::RecordCensus(Recorder& recorder, const LevelSize& size, std::size_t num_sources,
                           const Buffer& images) {
  const bool half_pixel = options_.plane_sweep.half_pixel;
  const auto num_images = static_cast<std::uint32_t>(1 + (half_pixel ? 4 : 1) * num_sources);
  Reserve(census_, device_, 8 * size.num_strided_pixels() * num_images, "depth/census");
  if (!half_pixel) {
    census_stage_.Record(recorder, images, size, num_images, census_);
    return;
  }
  Reserve(shifted_images_, device_, 4 * PaddedWords(size) * num_images, "depth/half_pixel");
  half_pixel_.Record(recorder, images, size, static_cast<std::uint32_t>(1 + num_sources),
                     shifted_images_);
  census_stage_.Record(recorder, shifted_images_, size, num_images, census_);
}

void Matcher::RecordSweep(Recorder& recorder, const SweepPlan& plan,
                          const SourceProjections& projections, const Buffer& images) {
  const std::size_t cost_bytes = plan.size.num_pixels() * plan.padded_planes;
  Reserve(costs_, device_, cost_bytes, "depth/costs");
  Reserve(sums_, device_, 2 * cost_bytes, "depth/sums");
  const std::vector<float> packed = Pack(projections);
  projections_.Upload(std::span<const float>(packed));
  plane_sweep_.Record(recorder, projections.size(),
                      {.width_px = plan.size.width_px,
                       .height_px = plan.size.height_px,
                       .num_planes = plan.num_planes,
                       .padded_planes = plan.padded_planes,
                       .positions_per_px = options_.plane_sweep.half_pixel ? 2u : 1u,
                       .inverse_depth = static_cast<float>(plan.inverse_depth),
                       .inverse_depth_step = static_cast<float>(plan.step)},
                      census_, projections_, costs_);
  sgm_.Record(recorder, plan.size, plan.padded_planes, images, costs_, sums_);
}

void Matcher::RecordChoice(Recorder& recorder, const SweepPlan& plan, bool is_last) {
  choice_.Prepare(plan.size);
  winner_takes_all_.Record(recorder,
                           {.width_px = plan.size.width_px,
                            .height_px = plan.size.height_px,
                            .num_planes = plan.num_planes,
                            .padded_planes = plan.padded_planes,
                            .max_cost = choice_.MaxCost(is_last),
                            .min_uniqueness = choice_.MinUniqueness(is_last),
                            .inverse_depth = static_cast<float>(plan.inverse_depth),
                            .inverse_depth_step = static_cast<float>(plan.step)},
                           sums_, costs_, choice_.winner_depth(), choice_.winner_uniqueness());
  choice_.RecordMedian(recorder, plan, is_last);
}

void Matcher::Record(Recorder& recorder, const SweepPlan& plan,
                     const SourceProjections& projections, const Buffer& images, bool is_last) {
  RecordCensus(recorder, plan.size, projections.size(), images);
  RecordSweep(recorder, plan, projections, images);
  RecordChoice(recorder, plan, is_last);
}

}  // namespace mono3d
