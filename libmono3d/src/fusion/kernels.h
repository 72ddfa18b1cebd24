// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>
#include <optional>

#include "fusion/anchor_table.h"
#include "fusion/blocks.h"
#include "fusion/depth_map_buffers.h"
#include "fusion/storage.h"
#include "fusion/view.params.h"
#include "gpu/kernel.h"
#include "gpu/recorder.h"

namespace mono3d {

// The kernels of fusion; each method records one stage. What a stage does stands in its shader,
// shaders/fusion/<stage>.comp.
class FusionKernels {
 public:
  // `allow_int64_atomics` false makes the index map in two passes of 32 bits even where the device
  // could do it in one; the result is the same.
  explicit FusionKernels(const std::shared_ptr<Device>& device, bool allow_int64_atomics = true);

  // Reads depth and candidate of `map`; writes those of its candidates that have no normal.
  void Prepare(Recorder& recorder, const ViewParams& params, const DepthMapBuffers& map) const;
  // Where stages take `blocks`, these surfels alone are read and changed. `anchors`: where the
  // depth map's camera has the anchors of the model.

  // Reads the surfels from params.first_surfel on, depth, candidate; writes their association.
  void Associate(Recorder& recorder, const ViewParams& params, const AnchorTable& anchors,
                 const DepthMapBuffers& map, const SurfelStorage& surfels,
                 const BlockList& blocks) const;
  // Reads the surfels and association; writes index_map.
  void DrawIndexMap(Recorder& recorder, const ViewParams& params, const AnchorTable& anchors,
                    const Buffer& index_map, const SurfelStorage& surfels,
                    const BlockList& blocks) const;
  // Both of them, of all surfels of the blocks; in one pass where the device can. The result is the
  // same.
  void AssociateAndDraw(Recorder& recorder, const ViewParams& params, const AnchorTable& anchors,
                        const DepthMapBuffers& map, const Buffer& index_map,
                        const SurfelStorage& surfels, const BlockList& blocks) const;
  // Reads depth, candidate, `index_map`, into which the surfels of `blocks` were drawn, and these;
  // writes selected.
  void SelectNew(Recorder& recorder, const ViewParams& params, const AnchorTable& anchors,
                 const DepthMapBuffers& map, const Buffer& index_map, const SurfelStorage& surfels,
                 const BlockList& blocks) const;
  // Reads association, colour and the surfels' colours; writes `cells`, NumExposureCells of
  // ExposureCell.
  void ExposureCells(Recorder& recorder, const ViewParams& params, const DepthMapBuffers& map,
                     const Buffer& cells, const SurfelStorage& surfels,
                     const BlockList& blocks) const;
  // Reads association, depth, candidate, colour; changes the surfels that a pixel confirms, and
  // counts them per block in the storage's num_confirmed; does what ClearFreeSpace does with the
  // others.
  void Merge(Recorder& recorder, const ViewParams& params, const AnchorTable& anchors,
             const DepthMapBuffers& map, const Buffer& num_removed, const SurfelStorage& surfels,
             const BlockList& blocks) const;
  // Reads association; changes the surfels from params.first_surfel on that it speaks against, and
  // adds those that it removes to the one uint of num_removed.
  void ClearFreeSpace(Recorder& recorder, const ViewParams& params, const Buffer& num_removed,
                      const SurfelStorage& surfels, const BlockList& blocks) const;
  // Reads association; removes the surfels that a pixel confirms, and adds their number to the one
  // uint of num_removed.
  void GiveWay(Recorder& recorder, const ViewParams& params, const Buffer& num_removed,
               const SurfelStorage& surfels, const BlockList& blocks) const;
  // Reads depth, candidate, colour, params.num_new of new_pixels; writes new surfels into the
  // blocks, of which there must be as many as they need, and fills up the last one.
  void Insert(Recorder& recorder, const ViewParams& params, const DepthMapBuffers& map,
              const SurfelStorage& surfels, const BlockList& blocks) const;

 private:
  Kernel prepare_;
  Kernel associate_;
  Kernel exposure_cells_;
  std::optional<Kernel> index_map_;       // or the two below
  std::optional<Kernel> associate_draw_;  // there with index_map_
  std::optional<Kernel> index_map_depth_;
  std::optional<Kernel> index_map_id_;
  Kernel select_new_;
  Kernel merge_;
  Kernel free_space_;
  Kernel give_way_;
  Kernel insert_;
};

}  // namespace mono3d
