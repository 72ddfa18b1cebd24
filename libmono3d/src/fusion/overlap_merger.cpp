// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/overlap_merger.h"

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

OverlapMerger::OverlapMerger(const std::shared_ptr<Device>& device)
    : device_(device),
      overlap_oldest_(device, {"fusion/overlap_oldest", fusion_overlap_oldest_spirv}),
      overlap_candidates_(device, {"fusion/overlap_candidates", fusion_overlap_candidates_spirv}),
      overlap_target_(device, {"fusion/overlap_target", fusion_overlap_target_spirv}),
      overlap_add_(device, {"fusion/overlap_add", fusion_overlap_add_spirv}),
      overlap_apply_(device, {"fusion/overlap_apply", fusion_overlap_apply_spirv}) {}

std::uint32_t OverlapMerger::Merge(Recorder& recorder, const FusionKernels& kernels,
                                   const ViewParams& params, const AnchorTable& anchors,
                                   std::span<const std::uint32_t> end_of_older,
                                   const SurfelStorage& surfels, const BlockList& blocks,
                                   StageTimes* times) {
  if (surfels.size() == 0 || end_of_older.empty()) return 0;
  Reserve(recorder, params, surfels);
  Buffer end_of(device_, end_of_older.size_bytes(), "fusion/end_of_older");
  end_of.Upload(end_of_older);

  recorder.Fill(surfels.association(), kNoTarget);  // nothing is seen through, either
  kernels.DrawIndexMap(recorder, params, anchors, index_map_, surfels, blocks);
  recorder.Dispatch(overlap_oldest_, {index_map_, oldest_}, params,
                    GridFor(overlap_oldest_, NumTiles(params)));
  recorder.Fill(num_candidates_, 0);
  recorder.Dispatch(
      overlap_candidates_,
      {surfels.position_radius(), surfels.normal_weight(), surfels.history(), blocks.buffer(),
       end_of, oldest_, anchors.buffer(), candidates_, num_candidates_},
      params, blocks.grid());
  recorder.Submit(times);
  const std::uint32_t num_candidates = num_candidates_.Download<std::uint32_t>().front();

  recorder.Fill(is_marked_, 0);
  // What was the association is the target from here on.
  recorder.Dispatch(overlap_target_,
                    {surfels.position_radius(), surfels.normal_weight(), surfels.history(),
                     index_map_, candidates_, end_of, num_candidates_, anchors.buffer(),
                     blocks.buffer(), surfels.association(), is_marked_},
                    params, GridFor(overlap_target_, num_candidates));
  recorder.Submit(times);
  const std::uint32_t num_blocks = DivideRoundingUp(surfels.size(), kSurfelsPerBlock);
  marked_.SetFlagged(device_, is_marked_, num_blocks, blocks.numbers());

  recorder.Fill(num_removed_, 0);
  recorder.Dispatch(
      overlap_add_,
      {surfels.position_radius(), surfels.normal_weight(), surfels.history(), surfels.association(),
       marked_.buffer(), anchors.buffer(), sums_, surfels.normal_weight(), num_removed_},
      params, marked_.grid());
  recorder.Dispatch(overlap_apply_,
                    {sums_, surfels.position_radius(), surfels.normal_weight(), surfels.history(),
                     marked_.buffer(), anchors.buffer(), sums_, surfels.position_radius(),
                     surfels.normal_weight(), surfels.history()},
                    params, marked_.grid());
  recorder.Submit(times);
  return num_removed_.Download<std::uint32_t>().front();
}

void OverlapMerger::End() {
  index_map_ = Buffer();
  sums_ = Buffer();
  candidates_ = Buffer();
}

void OverlapMerger::Reserve(Recorder& recorder, const ViewParams& params,
                            const SurfelStorage& surfels) {
  const auto reserve = [&](Buffer& buffer, std::size_t bytes, const char* name) {
    const bool is_too_small = buffer.size_bytes() < bytes;
    if (is_too_small) buffer = Buffer(device_, bytes, name);
    return is_too_small;
  };
  const std::size_t num_surfels = surfels.size();
  const std::size_t num_cells =
      std::size_t{params.width_px} * params.height_px * kIndexCellsPerPixel * kIndexCellsPerPixel;
  reserve(index_map_, num_cells * 2 * sizeof(std::uint32_t), "fusion/overlap_index_map");
  if (reserve(sums_, num_surfels * 4 * sizeof(std::uint32_t), "fusion/overlap_sums")) {
    recorder.Fill(sums_, 0);
  }
  reserve(candidates_, num_surfels * sizeof(std::uint32_t), "fusion/overlap_candidates");
  reserve(num_candidates_, sizeof(std::uint32_t), "fusion/num_overlap_candidates");
  reserve(num_removed_, sizeof(std::uint32_t), "fusion/num_overlap_removed");
  reserve(is_marked_, DivideRoundingUp(num_surfels, kSurfelsPerBlock) * sizeof(std::uint32_t),
          "fusion/marked_blocks");
  reserve(oldest_, NumTiles(params) * sizeof(std::uint32_t), "fusion/oldest_of_tile");
}

}  // namespace mono3d
