// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// A sphere around the surfels of each listed block, in the frame of its anchor, a negative radius
// where it has none; and how many it has.
#include "fusion/bound_blocks.params.h"
#include "fusion/item.glsl"

layout(binding = 0, rgba32f) uniform readonly imageBuffer position_radius;  // per surfel
layout(binding = 1, rgba32f) uniform readonly imageBuffer normal_weight;    // per surfel
layout(binding = 2, r32ui) uniform readonly uimageBuffer blocks;            // numbers of blocks
layout(binding = 3, std430) writeonly buffer Bounds { vec4 bounds[]; };  // per block: centre, radius
layout(binding = 4, std430) writeonly buffer There { uint num_there[]; };  // per block

void main() {
  const uint item = ItemIndex();
  if (item >= params.num_blocks) return;
  const uint block = imageLoad(blocks, int(item)).x;
  vec3 smallest = vec3(3.4e38), largest = vec3(-3.4e38);
  const uint first = block * kSurfelsPerBlock;
  const uint end = min(first + kSurfelsPerBlock, params.num_surfels);
  uint count = 0u;
  for (uint i = first; i < end; ++i) {
    const vec3 p = imageLoad(position_radius, int(i)).xyz;
    const bool is_there = imageLoad(normal_weight, int(i)).w > 0.0;
    count += is_there ? 1u : 0u;
    smallest = is_there ? min(smallest, p) : smallest;
    largest = is_there ? max(largest, p) : largest;
  }
  const bool is_empty = smallest.x > largest.x;
  // A little more, for rounding; a view has a margin as well.
  const float radius = 0.501 * length(largest - smallest);
  num_there[block] = count;
  bounds[block] = is_empty ? vec4(0.0, 0.0, 0.0, -1.0) : vec4(0.5 * (smallest + largest), radius);
}
