// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "fusion/anchor_table.h"
#include "fusion/storage.h"
#include "fusion/view.params.h"
#include "gpu/buffer.h"
#include "gpu/kernel.h"
#include "gpu/recorder.h"
#include "mono3d/core/timing.h"

namespace mono3d {

// Surfels are worked on in blocks of 64 that follow each other, a workgroup each. Those of one
// block were mostly neighbours in one depth map, so that a view sees most of it or nothing: what a
// depth map costs depends on what it sees, not on the size of the model.
class BlockList {
 public:
  // Replaces the numbers of the blocks. Not while a recorder still has to work on the list.
  void Set(const std::shared_ptr<Device>& device, std::span<const std::uint32_t> numbers);
  // The blocks that hold surfels `first` to `end` - 1.
  void SetRange(const std::shared_ptr<Device>& device, std::uint32_t first, std::uint32_t end);
  // Of these blocks, all of which are below `end`, those whose flag is not 0; a uint each.
  void SetFlagged(const std::shared_ptr<Device>& device, const Buffer& flags, std::uint32_t end,
                  std::span<const std::uint32_t> blocks);

  std::uint32_t size() const { return size_; }
  const std::vector<std::uint32_t>& numbers() const { return numbers_; }
  // Of a kernel with a workgroup per block.
  std::array<std::uint32_t, 3> grid() const { return grid_; }
  // uint per workgroup; those beyond size() have a number beyond any model.
  const Buffer& buffer() const { return buffer_; }

 private:
  Buffer buffer_;
  std::vector<std::uint32_t> numbers_;
  std::uint32_t size_ = 0;
  std::array<std::uint32_t, 3> grid_ = {0, 0, 1};
};

// A view as it looks at the model.
struct ModelView {
  const ViewParams& params;
  const AnchorTable& anchors;
};

// Finds the blocks that views may see.
class BlockCuller {
 public:
  explicit BlockCuller(const std::shared_ptr<Device>& device);

  // shaders/fusion/bound_blocks.comp: what surrounds the surfels of these blocks, which have moved
  // or were removed, and how many there are. Up to `num_surfels`.
  void Bound(Recorder& recorder, const BlockList& blocks, std::uint32_t num_surfels,
             const SurfelStorage& surfels) const;

  // shaders/fusion/cull_blocks.comp: lists the blocks that one of the views may see, none that it
  // sees left out, in the order of the model; `margin_px` is added around its image. Bounds blocks
  // first whose surfels are new, and brings to the device what is not there. Submits. Throws Error
  // (kOutOfMemory) where the device has no room for all that is seen.
  void FindVisible(Recorder& recorder, std::span<const ModelView> views, std::uint32_t margin_px,
                   SurfelStorage& surfels, BlockList& visible, StageTimes* times);

 private:
  void Cull(Recorder& recorder, std::span<const ModelView> views, std::uint32_t margin_px,
            SurfelStorage& surfels, BlockList& visible, StageTimes* times);

  std::shared_ptr<Device> device_;
  Kernel bound_;
  Kernel cull_;
  BlockList new_blocks_;
  Buffer is_seen_;
};

}  // namespace mono3d
