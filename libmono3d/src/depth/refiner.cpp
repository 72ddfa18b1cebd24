// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/refiner.h"

#include <algorithm>
#include <span>
#include <utility>

#include "depth/buffers.h"
#include "depth/sweep_plan.h"

namespace mono3d {
namespace {

constexpr std::uint32_t kNumDetail = 1 + kNumSources / 2;
constexpr std::uint32_t kNumMoreDetail = kNumSources / 2;

}  // namespace

Refiner::Refiner(std::shared_ptr<Device> device, const RefinementOptions& options)
    : device_(std::move(device)),
      options_(options),
      detail_stage_(device_),
      photometric_(device_),
      surface_(device_, false),
      last_surface_(device_),
      projections_(device_, sizeof(PackedProjections), "depth/refiner_projections") {}

void Refiner::Record(Recorder& recorder, const SweepGeometry& geometry, const Input& input) {
  const LevelSize size = SizeAtLevel(geometry.camera(), 0);
  Reserve(detail_, device_, 4 * kNumDetail * size.num_strided_pixels(), "depth/detail");
  Reserve(more_detail_, device_, 4 * kNumMoreDetail * size.num_strided_pixels(),
          "depth/more_detail");
  Reserve(measurements_, device_, 4 * sizeof(float) * NumMeasurements(size), "depth/photometric");
  Reserve(inverse_depth_, device_, sizeof(float) * size.num_pixels(), "depth/surface");
  Reserve(confidence_, device_, sizeof(float) * size.num_pixels(), "depth/confidence");
  const PackedProjections packed = Pack(geometry.Projections(0));
  projections_.Upload(std::span<const float>(packed));
  detail_stage_.Record(recorder, {size.width_px, size.height_px, 0}, kNumDetail, input.images,
                       input.quarter, detail_);
  detail_stage_.Record(recorder, {size.width_px, size.height_px, kNumDetail}, kNumMoreDetail,
                       input.images, input.quarter, more_detail_);
  for (int i = 0; i < options_.iterations; ++i) {
    photometric_.Record(recorder,
                        {.width_px = size.width_px,
                         .height_px = size.height_px,
                         .inverse_depth_step = static_cast<float>(input.step),
                         .noise = static_cast<float>(input.noise),
                         .min_views = static_cast<float>(options_.min_views)},
                        detail_, more_detail_, projections_,
                        i == 0 ? input.inverse_depth : inverse_depth_, measurements_);
    const SurfaceStage& surface = i + 1 < options_.iterations ? surface_ : last_surface_;
    surface.Record(recorder,
                   {.width_px = size.width_px,
                    .height_px = size.height_px,
                    .inverse_depth_step = static_cast<float>(input.step)},
                   measurements_, input.uniqueness, inverse_depth_, confidence_);
  }
}

}  // namespace mono3d
