// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <memory>
#include <span>

#include "fusion/anchor_map.h"
#include "fusion/anchor_table.h"
#include "fusion/depth_map_buffers.h"
#include "fusion/new_blocks.h"
#include "mono3d/image/depth_map.h"

namespace mono3d {

// A fused depth map as far as it can still speak of surfels that come later.
struct PastView {
  DepthMap map;              // without its images: camera, sigma
  std::uint32_t anchor = 0;  // its number
  DepthMapBuffers buffers;   // depth and candidate alone
  AnchorTable anchors;       // as it looks at the model, when it does
  BlockList new_blocks;      // that it may see then

  // At the surfels that depth map `number`, the latest anchor, adds in these blocks, of which these
  // are the spheres.
  void LookAt(const std::shared_ptr<Device>& device, const ViewParams& params,
              const AnchorMap& of_model, std::uint32_t number, std::span<const std::uint32_t> added,
              std::span<const BlockSphere> spheres);
};

// The last fused depth maps, on the device: 20 bytes a pixel each.
class PastViews {
 public:
  // Keeps `max_views`, fewer where they are large, at least one (unless max_views is 0).
  explicit PastViews(std::size_t max_views) : max_views_(max_views) {}

  const std::deque<PastView>& views() const { return views_; }
  std::deque<PastView>& views() { return views_; }
  void Clear() { views_.clear(); }

  // Takes depth and candidate out of `buffers`, which is given others, of undefined contents, for
  // the next depth map. Where there is no memory for those it lets the depth map go.
  void Push(const std::shared_ptr<Device>& device, const DepthMap& map, std::uint32_t anchor,
            DepthMapBuffers& buffers);

  // For a saved state; see state_archive.h.
  template <typename Archive>
  static void Exchange(Archive& archive, PastView& view, const std::shared_ptr<Device>& device);

 private:
  std::size_t max_views_;
  std::deque<PastView> views_;  // oldest first
};

}  // namespace mono3d
