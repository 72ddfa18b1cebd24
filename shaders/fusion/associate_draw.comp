// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_atomic_int64 : require

// associate.comp and index_map.comp in one: a surfel is read, placed and projected once for both.
#include "fusion/associate.glsl"
#include "fusion/index_cell.glsl"

layout(binding = 7, std430) writeonly buffer Association { uint association[]; };  // per surfel
// Per cell; all bits set: empty.
layout(binding = 8, std430) buffer IndexMap { uint64_t index_map[]; };

void main() {
  const uint block = imageLoad(blocks, int(WorkGroupIndex())).x;
  const uint i = SurfelOfBlock(block);
  if (i >= params.num_surfels) return;
  Placed placed;
  const uint said = Associate(i, block, placed);
  association[i] = said;
  if (Says(said, kSeenThrough)) return;
  const uint cell = IndexCellOf(placed.p_cam, placed.n_cam);
  if (cell == kNoCell) return;
  atomicMin(index_map[cell], (uint64_t(floatBitsToUint(placed.p_cam.z)) << 32) | uint64_t(ItemIndex()));
}
