// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/kernels.h"

#include <cstdint>

#include "fusion/associate.spirv.h"
#include "fusion/associate_draw.spirv.h"
#include "fusion/exposure_cells.spirv.h"
#include "fusion/free_space.spirv.h"
#include "fusion/give_way.spirv.h"
#include "fusion/grid.h"
#include "fusion/host/host_kernels.h"
#include "fusion/index_map.spirv.h"
#include "fusion/index_map_depth.spirv.h"
#include "fusion/index_map_id.spirv.h"
#include "fusion/insert.spirv.h"
#include "fusion/merge.spirv.h"
#include "fusion/prepare.spirv.h"
#include "fusion/select_new.spirv.h"
#include "gpu/device_handle.h"

namespace mono3d {
FusionKernels::FusionKernels(const std::shared_ptr<Device>& device, bool allow_int64_atomics)
    : prepare_(device, {"fusion/prepare", fusion_prepare_spirv}),
      associate_(device, {"fusion/associate", fusion_associate_spirv, kAssociateOnHost}),
      exposure_cells_(device, {"fusion/exposure_cells", fusion_exposure_cells_spirv}),
      select_new_(device, {"fusion/select_new", fusion_select_new_spirv, kSelectNewOnHost}),
      merge_(device, {"fusion/merge", fusion_merge_spirv, kMergeOnHost}),
      free_space_(device, {"fusion/free_space", fusion_free_space_spirv}),
      give_way_(device, {"fusion/give_way", fusion_give_way_spirv}),
      insert_(device, {"fusion/insert", fusion_insert_spirv}) {
  if (allow_int64_atomics && Limits(*device).has_int64_atomics) {
    index_map_.emplace(device, KernelSource{"fusion/index_map", fusion_index_map_spirv});
    associate_draw_.emplace(
        device,
        KernelSource{"fusion/associate_draw", fusion_associate_draw_spirv, kAssociateDrawOnHost});
  } else {
    index_map_depth_.emplace(device,
                             KernelSource{"fusion/index_map_depth", fusion_index_map_depth_spirv});
    index_map_id_.emplace(device, KernelSource{"fusion/index_map_id", fusion_index_map_id_spirv});
  }
}

void FusionKernels::Prepare(Recorder& recorder, const ViewParams& params,
                            const DepthMapBuffers& map) const {
  recorder.Dispatch(prepare_, {map.depth, map.candidate, map.blocks_to_fit.buffer(), map.candidate},
                    params, map.blocks_to_fit.grid());
}

void FusionKernels::Associate(Recorder& recorder, const ViewParams& params,
                              const AnchorTable& anchors, const DepthMapBuffers& map,
                              const SurfelStorage& surfels, const BlockList& blocks) const {
  recorder.Dispatch(
      associate_,
      {surfels.position_radius(), surfels.normal_weight(), map.depth, map.candidate,
       blocks.buffer(), surfels.anchor_of_block(), anchors.buffer(), surfels.association()},
      params, blocks.grid());
}

void FusionKernels::DrawIndexMap(Recorder& recorder, const ViewParams& params,
                                 const AnchorTable& anchors, const Buffer& index_map,
                                 const SurfelStorage& surfels, const BlockList& blocks) const {
  recorder.Fill(index_map, 0xFFFFFFFFU);
  const auto draw = [&](const Kernel& kernel) {
    recorder.Dispatch(kernel,
                      {surfels.position_radius(), surfels.normal_weight(), surfels.association(),
                       blocks.buffer(), surfels.anchor_of_block(), anchors.buffer(), index_map},
                      params, blocks.grid());
  };
  if (index_map_) {
    draw(*index_map_);
  } else {
    draw(*index_map_depth_);
    draw(*index_map_id_);
  }
}

void FusionKernels::AssociateAndDraw(Recorder& recorder, const ViewParams& params,
                                     const AnchorTable& anchors, const DepthMapBuffers& map,
                                     const Buffer& index_map, const SurfelStorage& surfels,
                                     const BlockList& blocks) const {
  if (!associate_draw_) {
    Associate(recorder, params, anchors, map, surfels, blocks);
    DrawIndexMap(recorder, params, anchors, index_map, surfels, blocks);
    return;
  }
  recorder.Fill(index_map, 0xFFFFFFFFU);
  recorder.Dispatch(*associate_draw_,
                    {surfels.position_radius(), surfels.normal_weight(), map.depth, map.candidate,
                     blocks.buffer(), surfels.anchor_of_block(), anchors.buffer(),
                     surfels.association(), index_map},
                    params, blocks.grid());
}

void FusionKernels::SelectNew(Recorder& recorder, const ViewParams& params,
                              const AnchorTable& anchors, const DepthMapBuffers& map,
                              const Buffer& index_map, const SurfelStorage& surfels,
                              const BlockList& blocks) const {
  recorder.Fill(map.selected, 0);
  recorder.Dispatch(
      select_new_,
      {map.depth, map.candidate, index_map, surfels.normal_weight(), surfels.anchor_of_block(),
       anchors.buffer(), map.blocks.buffer(), blocks.buffer(), map.selected},
      params, map.blocks.grid());
}

void FusionKernels::ExposureCells(Recorder& recorder, const ViewParams& params,
                                  const DepthMapBuffers& map, const Buffer& cells,
                                  const SurfelStorage& surfels, const BlockList& blocks) const {
  recorder.Fill(cells, 0);
  recorder.Dispatch(exposure_cells_,
                    {surfels.association(), map.colour, surfels.history(), blocks.buffer(), cells},
                    params, blocks.grid());
}

void FusionKernels::Merge(Recorder& recorder, const ViewParams& params, const AnchorTable& anchors,
                          const DepthMapBuffers& map, const Buffer& num_removed,
                          const SurfelStorage& surfels, const BlockList& blocks) const {
  recorder.Fill(surfels.num_confirmed(), 0);
  recorder.Dispatch(
      merge_,
      {surfels.association(), map.depth, map.candidate, map.colour, surfels.position_radius(),
       surfels.normal_weight(), surfels.history(), blocks.buffer(), surfels.anchor_of_block(),
       anchors.buffer(), surfels.position_radius(), surfels.normal_weight(), surfels.history(),
       surfels.num_confirmed(), num_removed},
      params, blocks.grid());
}

void FusionKernels::ClearFreeSpace(Recorder& recorder, const ViewParams& params,
                                   const Buffer& num_removed, const SurfelStorage& surfels,
                                   const BlockList& blocks) const {
  recorder.Dispatch(free_space_,
                    {surfels.association(), surfels.history(), blocks.buffer(),
                     surfels.normal_weight(), surfels.history(), num_removed},
                    params, blocks.grid());
}

void FusionKernels::GiveWay(Recorder& recorder, const ViewParams& params, const Buffer& num_removed,
                            const SurfelStorage& surfels, const BlockList& blocks) const {
  recorder.Dispatch(give_way_,
                    {surfels.association(), blocks.buffer(), surfels.normal_weight(),
                     surfels.normal_weight(), num_removed},
                    params, blocks.grid());
}

void FusionKernels::Insert(Recorder& recorder, const ViewParams& params, const DepthMapBuffers& map,
                           const SurfelStorage& surfels, const BlockList& blocks) const {
  recorder.Dispatch(insert_,
                    {map.depth, map.candidate, map.colour, map.new_pixels, blocks.buffer(),
                     surfels.position_radius(), surfels.normal_weight(), surfels.history()},
                    params, blocks.grid());
}

}  // namespace mono3d
