// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_atomic_int64 : require

// The index map in one pass: depth and number of the surfel in one 64-bit word, the smallest wins.
// Of two surfels at one depth that is the one that comes first in the list of blocks, in whatever
// order they come.
#include "fusion/index_map.glsl"

// Per cell; all bits set: empty.
layout(binding = 6, std430) buffer IndexMap { uint64_t index_map[]; };

void main() {
  const uint i = ThisSurfel();
  if (i >= params.num_surfels) return;
  uint depth_bits;
  const uint cell = IndexCell(i, depth_bits);
  if (cell == kNoCell) return;
  atomicMin(index_map[cell], (uint64_t(depth_bits) << 32) | uint64_t(ItemIndex()));
}
