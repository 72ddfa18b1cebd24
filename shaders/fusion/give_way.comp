// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// Inferred surfels where a depth map has matched the same surface are removed: its pixels are
// surfels of their own, and a guess adds nothing to them.
#include "fusion/view.glsl"

layout(binding = 0, r32ui) uniform readonly uimageBuffer association;  // per surfel
layout(binding = 1, r32ui) uniform readonly uimageBuffer blocks;  // to work on
layout(binding = 2, rgba32f) uniform readonly imageBuffer old_normal_weight;  // per surfel
layout(binding = 3, std430) writeonly buffer NormalWeight { vec4 normal_weight[]; };  // per surfel
layout(binding = 4, std430) buffer Count { uint num_removed; };

void main() {
  const uint i = SurfelOfBlock(imageLoad(blocks, int(WorkGroupIndex())).x);
  if (i >= params.num_surfels) return;
  if (imageLoad(old_normal_weight, int(i)).w <= 0.0) return;
  if (!IsPixel(imageLoad(association, int(i)).x)) return;
  normal_weight[i] = vec4(0.0);
  atomicAdd(num_removed, 1u);
}
