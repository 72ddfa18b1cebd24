// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// What a map says against surfels, see free_space.glsl. merge.comp does the same for those that it
// looks at.
#include "fusion/surfel.glsl"
#include "fusion/view.glsl"
#include "fusion/free_space.glsl"

layout(binding = 0, r32ui) uniform readonly uimageBuffer association;  // per surfel
layout(binding = 1, rgba32ui) uniform readonly uimageBuffer old_history;  // per surfel
layout(binding = 2, r32ui) uniform readonly uimageBuffer blocks;  // to work on
layout(binding = 3, std430) writeonly buffer NormalWeight { vec4 normal_weight[]; };  // per surfel
layout(binding = 4, std430) writeonly buffer History { uvec4 history[]; };  // per surfel
layout(binding = 5, std430) buffer Count { uint num_removed; };

void main() {
  const uint i = SurfelOfBlock(imageLoad(blocks, int(WorkGroupIndex())).x);
  if (i < params.first_surfel || i >= params.num_surfels) return;
  uvec4 counted = imageLoad(old_history, int(i));
  if (!SpeaksAgainst(imageLoad(association, int(i)).x, counted)) return;
  history[i] = counted;
  if (params.is_past != 0u || !IsRefuted(counted)) return;
  normal_weight[i] = vec4(0.0);
  atomicAdd(num_removed, 1u);
}
