// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "gpu/buffer.h"
#include "mono3d/image/depth_map.h"

namespace mono3d {

// A depth map in the form that the kernels read, row by row.
struct PackedDepthMap {
  std::vector<float> depth;                             // su; 0: no estimate
  std::vector<std::array<float, 4>> normal_confidence;  // camera frame, 0: to be fitted; 0 to 1
  std::vector<std::uint32_t> colour;                    // 0xBBGGRR
  std::int64_t num_candidates =
      0;  // pixels with depth and confidence, which become or meet surfels
};

// What is no finite positive depth counts as no estimate; confidence is 1 where the map has none,
// colour grey where it has no image. No estimate either where the map's border is uncertain.
// Grazing views keep a part of their confidence. Without confidence every estimate has 1.
PackedDepthMap Pack(const DepthMap& map, bool with_confidence = true);

// The buffers of the size of a depth map: it and what the stages derive from it.
struct DepthMapBuffers {
  Buffer depth;              // float per pixel, su
  Buffer normal_confidence;  // 4 floats per pixel
  Buffer colour;             // uint per pixel
  Buffer candidate;          // 4 floats per pixel: unit normal in the camera frame, confidence
  Buffer index_map;          // 2 uints per cell: number of the surfel, bits of its depth
  Buffer selected;           // bit per pixel: becomes a surfel
  Buffer new_pixels;         // uint per pixel: numbers of those selected, as far as there are
  Buffer exposure_cells;     // ExposureCell per cell, see exposure.h
  Buffer num_removed;        // one uint

  DepthMapBuffers() = default;
  DepthMapBuffers(const std::shared_ptr<Device>& device, int width_px, int height_px);

  std::size_t num_pixels() const { return depth.size_bytes() / sizeof(float); }
  void Upload(const PackedDepthMap& map);  // of the size given to the constructor
};

}  // namespace mono3d
