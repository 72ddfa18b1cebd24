// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/surface.h"

#include <utility>

#include "depth/surface.spirv.h"

namespace mono3d {
namespace {

constexpr std::uint64_t kPixelsPerInvocation = 2;  // in a row, and rows

}  // namespace

SurfaceStage::SurfaceStage(std::shared_ptr<Device> device, bool with_confidence)
    : kernel_(std::move(device), {"depth/surface", depth_surface_spirv},
              {with_confidence ? 1u : 0u}) {}

void SurfaceStage::Record(Recorder& recorder, const SurfaceParams& params,
                          const Buffer& measurements, const Buffer& uniqueness,
                          const Buffer& inverse_depth, const Buffer& confidence) const {
  recorder.Dispatch(
      kernel_, {measurements, uniqueness, inverse_depth, confidence}, params,
      {DivideRoundingUp(params.width_px, kPixelsPerInvocation * kernel_.workgroup_size()[0]),
       DivideRoundingUp(params.height_px, kPixelsPerInvocation), 1});
}

}  // namespace mono3d
