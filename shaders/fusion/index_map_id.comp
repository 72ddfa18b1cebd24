// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// Second of the two passes that make the index map where 64-bit atomics are missing: which surfels
// have the depth that won.
#include "fusion/index_map.glsl"

// Two words per cell, the place of the surfel in the list and its depth; all bits set: empty.
layout(binding = 6, std430) buffer IndexMap { uint index_map[]; };

void main() {
  const uint i = ThisSurfel();
  if (i >= params.num_surfels) return;
  uint depth_bits;
  const uint cell = IndexCell(i, depth_bits);
  if (cell == kNoCell || index_map[2u * cell + 1u] != depth_bits) return;
  atomicMin(index_map[2u * cell], ItemIndex());
}
