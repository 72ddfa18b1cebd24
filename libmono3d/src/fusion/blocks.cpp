// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/blocks.h"

#include <algorithm>
#include <cstddef>
#include <iterator>
#include <numeric>

#include "fusion/bound_blocks.params.h"
#include "fusion/bound_blocks.spirv.h"
#include "fusion/cull_blocks.spirv.h"
#include "fusion/grid.h"

namespace mono3d {
namespace {

constexpr std::uint32_t kNoBlock = 0xFFFFFFFFU;  // its surfels are beyond any model

ViewParams Enlarged(const ViewParams& view, std::uint32_t margin_px, std::uint32_t num_surfels) {
  ViewParams larger = view;
  larger.width_px += 2 * margin_px;
  larger.height_px += 2 * margin_px;
  larger.cx += static_cast<float>(margin_px);
  larger.cy += static_cast<float>(margin_px);
  larger.num_surfels = num_surfels;
  return larger;
}

}  // namespace

void BlockList::Set(const std::shared_ptr<Device>& device, std::span<const std::uint32_t> numbers) {
  numbers_.assign(numbers.begin(), numbers.end());
  size_ = static_cast<std::uint32_t>(numbers.size());
  grid_ = GroupGrid(size_);
  std::vector<std::uint32_t> padded(std::max<std::size_t>(std::size_t{grid_[0]} * grid_[1], 1),
                                    kNoBlock);
  std::copy(numbers.begin(), numbers.end(), padded.begin());
  const std::size_t bytes = padded.size() * sizeof(std::uint32_t);
  if (buffer_.size_bytes() < bytes) {
    buffer_ = Buffer(device, bytes + bytes / 2, "fusion/block_list");
  }
  buffer_.Upload(std::span<const std::uint32_t>(padded));
}

void BlockList::SetRange(const std::shared_ptr<Device>& device, std::uint32_t first,
                         std::uint32_t end) {
  std::vector<std::uint32_t> numbers;
  if (first < end) {
    const std::uint32_t first_block = first / kSurfelsPerBlock;
    numbers.resize(DivideRoundingUp(end, kSurfelsPerBlock) - first_block);
    std::iota(numbers.begin(), numbers.end(), first_block);
  }
  Set(device, numbers);
}

void BlockList::SetFlagged(const std::shared_ptr<Device>& device, const Buffer& flags,
                           std::uint32_t num_blocks) {
  std::vector<std::uint32_t> is_flagged(num_blocks);
  flags.Download(std::span(is_flagged));
  std::vector<std::uint32_t> numbers;
  for (std::uint32_t block = 0; block < num_blocks; ++block) {
    if (is_flagged[block] != 0) numbers.push_back(block);
  }
  Set(device, numbers);
}

BlockCuller::BlockCuller(const std::shared_ptr<Device>& device)
    : device_(device),
      bound_(device, {"fusion/bound_blocks", fusion_bound_blocks_spirv}),
      cull_(device, {"fusion/cull_blocks", fusion_cull_blocks_spirv}) {}

void BlockCuller::Bound(Recorder& recorder, const BlockList& blocks, std::uint32_t num_surfels,
                        const SurfelStorage& surfels) const {
  if (blocks.size() == 0) return;
  BoundBlocksParams params{};
  params.num_blocks = blocks.size();
  params.num_surfels = num_surfels;
  recorder.Dispatch(
      bound_,
      {surfels.position_radius(), surfels.normal_weight(), blocks.buffer(), surfels.bounds()},
      params, GridFor(bound_, blocks.size()));
}

void BlockCuller::FindVisible(Recorder& recorder, std::span<const ModelView> views,
                              std::uint32_t margin_px, SurfelStorage& surfels, BlockList& visible,
                              StageTimes* times) {
  const std::uint32_t num_blocks = DivideRoundingUp(surfels.size(), kSurfelsPerBlock);
  if (num_blocks == 0) {
    visible.Set(device_, {});
    return;
  }
  if (surfels.num_bounded() < surfels.size()) {
    new_blocks_.SetRange(device_, surfels.num_bounded(), surfels.size());
    Bound(recorder, new_blocks_, surfels.size(), surfels);
    surfels.SetBounded(surfels.size());
  }
  if (is_seen_.size_bytes() < num_blocks * sizeof(std::uint32_t)) {
    is_seen_ = Buffer(device_, num_blocks * sizeof(std::uint32_t) * 3 / 2, "fusion/seen_blocks");
  }
  recorder.Fill(is_seen_, 0);
  for (const ModelView& view : views) {
    recorder.Dispatch(
        cull_, {surfels.bounds(), surfels.anchor_of_block(), view.anchors.buffer(), is_seen_},
        Enlarged(view.params, margin_px, surfels.size()), GridFor(cull_, num_blocks));
  }
  recorder.Submit(times);
  visible.SetFlagged(device_, is_seen_, num_blocks);
}

}  // namespace mono3d
