// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/corrector.h"

#include "fusion/deform.params.h"
#include "fusion/deform.spirv.h"
#include "fusion/grid.h"
#include "fusion/overlap_add.spirv.h"
#include "fusion/overlap_apply.spirv.h"
#include "fusion/overlap_candidates.spirv.h"
#include "fusion/overlap_oldest.spirv.h"
#include "fusion/overlap_target.spirv.h"

namespace mono3d {
namespace {

// What overlap_target leaves alone.
constexpr std::uint32_t kNoTarget = 0xFFFFFFFFU;
static_assert(kNoTarget == kUnseen);

// Of the index map; kTileCells of shaders/fusion/overlap.glsl.
std::uint32_t NumTiles(const ViewParams& view) {
  constexpr std::uint32_t kTileCells = 16;
  const auto along = [](std::uint32_t side_px) {
    return DivideRoundingUp(std::uint64_t{side_px} * kIndexCellsPerPixel, kTileCells);
  };
  return along(view.width_px) * along(view.height_px);
}

}  // namespace

Corrector::Corrector(const std::shared_ptr<Device>& device)
    : device_(device),
      deform_(device, {"fusion/deform", fusion_deform_spirv}),
      overlap_oldest_(device, {"fusion/overlap_oldest", fusion_overlap_oldest_spirv}),
      overlap_candidates_(device, {"fusion/overlap_candidates", fusion_overlap_candidates_spirv}),
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
  Reserve(recorder, params, surfels);
  Buffer first_of(device_, std::span(surfels.first_slots()).size_bytes(), "fusion/first_slots");
  first_of.Upload(std::span(surfels.first_slots()));

  recorder.Fill(surfels.association(), kNoTarget);  // nothing is seen through, either
  stages.DrawIndexMap(recorder, params, map, surfels, blocks);
  recorder.Dispatch(overlap_oldest_, {map.index_map, oldest_}, params,
                    GridFor(overlap_oldest_, NumTiles(params)));
  recorder.Fill(num_candidates_, 0);
  recorder.Dispatch(overlap_candidates_,
                    {surfels.position_radius(), surfels.normal_weight(), surfels.history(),
                     blocks.buffer(), first_of, oldest_, candidates_, num_candidates_},
                    params, blocks.grid());
  recorder.Submit(times);
  const std::uint32_t num_candidates = num_candidates_.Download<std::uint32_t>().front();

  recorder.Fill(is_marked_, 0);
  // What was the association is the target from here on.
  recorder.Dispatch(
      overlap_target_,
      {surfels.position_radius(), surfels.normal_weight(), surfels.history(), map.index_map,
       candidates_, first_of, num_candidates_, surfels.association(), is_marked_},
      params, GridFor(overlap_target_, num_candidates));
  recorder.Submit(times);
  const std::uint32_t num_blocks = DivideRoundingUp(surfels.size(), kSurfelsPerBlock);
  marked_.SetFlagged(device_, is_marked_, num_blocks);

  recorder.Fill(map.num_removed, 0);
  recorder.Dispatch(
      overlap_add_,
      {surfels.position_radius(), surfels.normal_weight(), surfels.history(), surfels.association(),
       marked_.buffer(), sums_, surfels.normal_weight(), map.num_removed},
      params, marked_.grid());
  recorder.Dispatch(overlap_apply_,
                    {sums_, surfels.position_radius(), surfels.normal_weight(), surfels.history(),
                     marked_.buffer(), sums_, surfels.position_radius(), surfels.normal_weight(),
                     surfels.history()},
                    params, marked_.grid());
  recorder.Submit(times);
  return map.num_removed.Download<std::uint32_t>().front();
}

void Corrector::Reserve(Recorder& recorder, const ViewParams& params,
                        const SurfelStorage& surfels) {
  const auto reserve = [&](Buffer& buffer, std::size_t bytes, const char* name) {
    const bool is_too_small = buffer.size_bytes() < bytes;
    if (is_too_small) buffer = Buffer(device_, bytes, name);
    return is_too_small;
  };
  const std::size_t num_surfels = surfels.size();
  if (reserve(sums_, num_surfels * 4 * sizeof(std::uint32_t), "fusion/overlap_sums")) {
    recorder.Fill(sums_, 0);
  }
  reserve(candidates_, num_surfels * sizeof(std::uint32_t), "fusion/overlap_candidates");
  reserve(num_candidates_, sizeof(std::uint32_t), "fusion/num_overlap_candidates");
  reserve(is_marked_, DivideRoundingUp(num_surfels, kSurfelsPerBlock) * sizeof(std::uint32_t),
          "fusion/marked_blocks");
  reserve(oldest_, NumTiles(params) * sizeof(std::uint32_t), "fusion/oldest_of_tile");
}

}  // namespace mono3d
