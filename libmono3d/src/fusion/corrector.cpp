// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/corrector.h"

#include "fusion/deform.params.h"
#include "fusion/deform.spirv.h"
#include "fusion/grid.h"
#include "fusion/overlap_add.spirv.h"
#include "fusion/overlap_apply.spirv.h"
#include "fusion/overlap_target.spirv.h"

namespace mono3d {

Corrector::Corrector(const std::shared_ptr<Device>& device)
    : device_(device),
      deform_(device, {"fusion/deform", fusion_deform_spirv}),
      overlap_target_(device, {"fusion/overlap_target", fusion_overlap_target_spirv}),
      overlap_add_(device, {"fusion/overlap_add", fusion_overlap_add_spirv}),
      overlap_apply_(device, {"fusion/overlap_apply", fusion_overlap_apply_spirv}) {}

void Corrector::Deform(Recorder& recorder, std::span<const DeformationNode> nodes,
                       const SurfelStorage& surfels, StageTimes* times) {
  if (nodes.empty() || surfels.size() == 0) return;
  Buffer buffer(device_, nodes.size_bytes(), "fusion/deformation_nodes");
  buffer.Upload(nodes);
  const DeformParams params{surfels.size(), static_cast<std::uint32_t>(nodes.size()),
                            kDeformationWindow};
  recorder.Dispatch(deform_,
                    {surfels.position_radius(), surfels.normal_weight(), surfels.history(), buffer,
                     surfels.position_radius(), surfels.normal_weight()},
                    params, GridFor(deform_, surfels.size()));
  recorder.Submit(times);
}

std::uint32_t Corrector::MergeOverlap(Recorder& recorder, const FusionStages& stages,
                                      const ViewParams& params, const DepthMapBuffers& map,
                                      const SurfelStorage& surfels, const BlockList& blocks,
                                      StageTimes* times) {
  if (surfels.size() == 0) return 0;
  const Buffer sums(device_, std::size_t{surfels.size()} * 16, "fusion/overlap_sums");
  const std::span<const std::uint32_t> first_slots = surfels.first_slots();
  Buffer first_of(device_, first_slots.size_bytes(), "fusion/first_slots");
  first_of.Upload(first_slots);
  recorder.Fill(surfels.association(), kUnseen);  // nothing is seen through
  stages.DrawIndexMap(recorder, params, map, surfels, blocks);
  // What was the association is the target from here on.
  recorder.Dispatch(overlap_target_,
                    {surfels.position_radius(), surfels.normal_weight(), surfels.history(),
                     map.index_map, blocks.buffer(), first_of, surfels.association()},
                    params, blocks.grid());
  recorder.Fill(sums, 0);
  recorder.Fill(map.num_removed, 0);
  recorder.Dispatch(
      overlap_add_,
      {surfels.position_radius(), surfels.normal_weight(), surfels.history(), surfels.association(),
       blocks.buffer(), sums, surfels.normal_weight(), map.num_removed},
      params, blocks.grid());
  recorder.Dispatch(
      overlap_apply_,
      {sums, surfels.position_radius(), surfels.normal_weight(), surfels.history(), blocks.buffer(),
       surfels.position_radius(), surfels.normal_weight(), surfels.history()},
      params, blocks.grid());
  recorder.Submit(times);
  return map.num_removed.Download<std::uint32_t>().front();
}

}  // namespace mono3d
