// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/local_census.h"

#include <utility>

#include "depth/local_census.params.h"
#include "depth/local_census.spirv.h"

namespace mono3d {
namespace {

constexpr std::uint64_t kLocalCensusRowsPerInvocation = 2;

}  // namespace

LocalCensusStage::LocalCensusStage(std::shared_ptr<Device> device)
    : kernel_(std::move(device), {"depth/local_census", depth_local_census_spirv}) {}

void LocalCensusStage::Record(Recorder& recorder, const Buffer& images, LevelSize size,
                              std::uint32_t num_images, const Buffer& census) const {
  recorder.Dispatch(kernel_, {images, census}, LocalCensusParams{size.width_px, size.height_px},
                    {DivideRoundingUp(size.groups_per_row(), kernel_.workgroup_size()[0]),
                     DivideRoundingUp(size.height_px, kLocalCensusRowsPerInvocation), num_images});
}

}  // namespace mono3d
