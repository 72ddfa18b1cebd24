// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/refiner.h"

#include <algorithm>
#include <span>
#include <utility>

#include "depth/buffers.h"
#include "depth/measurement.h"
#include "depth/sweep_plan.h"

namespace mono3d {

Refiner::Refiner(std::shared_ptr<Device> device, DepthKernels& kernels,
                 const RefinementOptions& options)
    : device_(std::move(device)),
      kernels_(kernels),
      options_(options),
      projections_(device_, kMaxProjectionBytes, "depth/refiner_projections") {}

void Refiner::RecordDetail(Recorder& recorder, const LevelSize& size, std::uint32_t first_image,
                           std::uint32_t num_images, const Input& input, Buffer& detail) {
  Reserve(detail, device_, 4 * num_images * size.num_strided_pixels(), "depth/detail");
  kernels_.Detail(recorder, {size.width_px, size.height_px, first_image}, num_images, input.images,
                  input.quarter, input.gains, detail);
}

void Refiner::Record(Recorder& recorder, const SweepGeometry& geometry, const Input& input) {
  const LevelSize size = SizeAtLevel(geometry.camera(), 0);
  Reserve(measurements_, device_, 2 * sizeof(std::uint32_t) * NumMeasurements(size),
          "depth/photometric");
  Reserve(inverse_depth_, device_, sizeof(float) * size.num_pixels(), "depth/surface");
  Reserve(confidence_, device_, sizeof(float) * size.num_pixels(), "depth/confidence");
  const std::vector<float> packed = Pack(geometry.Projections(0), size);
  projections_.Upload(std::span<const float>(packed));
  const std::size_t num_sources = geometry.num_sources();
  const auto sources_per_side = static_cast<std::uint32_t>(num_sources / 2);
  RecordDetail(recorder, size, 0, 1, input, reference_detail_);
  RecordDetail(recorder, size, 1, sources_per_side, input, detail_before_);
  RecordDetail(recorder, size, 1 + sources_per_side, sources_per_side, input, detail_after_);
  for (int i = 0; i < options_.iterations; ++i) {
    kernels_.Photometric(recorder, num_sources,
                         {.width_px = size.width_px,
                          .height_px = size.height_px,
                          .inverse_depth_step = static_cast<float>(input.step),
                          .noise = static_cast<float>(input.noise),
                          .min_views = static_cast<float>(options_.min_views)},
                         {reference_detail_, detail_before_, detail_after_}, projections_,
                         i == 0 ? input.inverse_depth : inverse_depth_, measurements_);
    const bool is_last = i + 1 == options_.iterations;
    kernels_.Surface(recorder, is_last,
                     {.width_px = size.width_px,
                      .height_px = size.height_px,
                      .inverse_depth_step = static_cast<float>(input.step)},
                     measurements_, input.uniqueness, {inverse_depth_, confidence_});
  }
}

}  // namespace mono3d
