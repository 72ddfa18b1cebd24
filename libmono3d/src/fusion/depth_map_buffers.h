// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "fusion/blocks.h"
#include "gpu/buffer.h"
#include "mono3d/image/depth_map.h"

namespace mono3d {

// A depth map in the form that the kernels read, row by row.
struct PackedPixels {
  std::span<float> depth;  // su; 0: no estimate
  // Unit normal in the camera's frame, 0: to be fitted; confidence, 0 to 1. All 0: no candidate.
  std::span<std::array<float, 4>> normal_confidence;
  std::span<std::uint32_t> colour;  // 0xBBGGRR
};

// Blocks of kSurfelsPerBlock pixels that follow each other, in their order.
struct PackedBlocks {
  std::int64_t num_candidates =
      0;  // pixels with depth and confidence, which become or meet surfels
  std::vector<std::uint32_t> with_candidates;
  std::vector<std::uint32_t> to_fit;  // with a candidate whose normal is to be fitted
};

// What is no finite positive depth counts as no estimate; confidence is 1 where the map has none,
// colour grey where it has no image. No estimate either where the map's border is uncertain.
// Grazing views keep a part of their confidence. Without confidence every estimate has 1.
PackedBlocks Pack(const DepthMap& map, bool with_confidence, const PackedPixels& to);
// The same of those estimates alone that the map infers, which are few: `pixels` are those that the
// last call with this `to` wrote, and become those of this one; all others of `to` have no
// estimate. `colours`: of all pixels, instead of those of the map's image; empty: grey.
PackedBlocks PackInferred(const DepthMap& map, bool with_confidence,
                          std::span<const std::uint32_t> colours, const PackedPixels& to,
                          std::vector<std::uint32_t>& pixels);

// A packed depth map in memory of its own.
struct PackedDepthMap {
  std::vector<float> depth;
  std::vector<std::array<float, 4>> normal_confidence;
  std::vector<std::uint32_t> colour;
  PackedBlocks blocks;
};
PackedDepthMap Pack(const DepthMap& map, bool with_confidence = true);

// The buffers of the size of a depth map: it and what the stages derive from it.
struct DepthMapBuffers {
  Buffer depth;           // float per pixel, su
  Buffer colour;          // uint per pixel
  Buffer candidate;       // 4 floats per pixel: unit normal in the camera frame, confidence
  Buffer index_map;       // 2 uints per cell: number of the surfel, bits of its depth
  Buffer selected;        // bit per pixel: becomes a surfel
  Buffer new_pixels;      // uint per pixel: numbers of those selected, as far as there are
  Buffer exposure_cells;  // ExposureCell per cell, see exposure.h
  Buffer num_removed;     // one uint
  BlockList blocks;       // of pixels, as those of PackedDepthMap
  BlockList blocks_to_fit;

  DepthMapBuffers() = default;
  DepthMapBuffers(const std::shared_ptr<Device>& device, int width_px, int height_px);

  std::size_t num_pixels() const { return depth.size_bytes() / sizeof(float); }
  // Has depth, colour, candidate and the lists of blocks written, of the size given to the
  // constructor, and returns the number of candidates. Those without a normal wait for the stage
  // `prepare`.
  using PackPixels = std::function<PackedBlocks(const PackedPixels& to)>;
  std::int64_t Write(const std::shared_ptr<Device>& device, const PackPixels& pack);
  // What was written last.
  std::span<const float> depths() { return depth.BeginWrite(copies.depth); }

  PackedDepthMap copies;  // of what is written, where the host does not see the buffers
};

}  // namespace mono3d
