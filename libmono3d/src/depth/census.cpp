// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/census.h"

#include <utility>

#include "depth/census.params.h"
#include "depth/census.spirv.h"

namespace mono3d {
namespace {

constexpr std::uint64_t kCensusRowsPerInvocation = 2;

}  // namespace

CensusStage::CensusStage(std::shared_ptr<Device> device)
    : kernel_(std::move(device), {"depth/census", depth_census_spirv}) {}

void CensusStage::Record(Recorder& recorder, const Buffer& images, LevelSize size,
                         std::uint32_t num_images, const Buffer& census) const {
  recorder.Dispatch(kernel_, {images, census}, CensusParams{size.width_px, size.height_px},
                    {DivideRoundingUp(size.groups_per_row(), kernel_.workgroup_size()[0]),
                     DivideRoundingUp(size.height_px, kCensusRowsPerInvocation), num_images});
}

}  // namespace mono3d
