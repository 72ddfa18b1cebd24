// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// A surfel that this map sees through has one more witness against it. With as many against it as
// for it, it is removed: its weight becomes 0.
#include "fusion/surfel.glsl"
#include "fusion/view.glsl"

layout(binding = 0, r32ui) uniform readonly uimageBuffer association;  // per surfel
layout(binding = 1, rgba32ui) uniform readonly uimageBuffer old_history;  // per surfel
layout(binding = 2, std430) writeonly buffer NormalWeight { vec4 normal_weight[]; };  // per surfel
layout(binding = 3, std430) writeonly buffer History { uvec4 history[]; };  // per surfel
layout(binding = 4, std430) buffer Count { uint num_removed; };

void main() {
  const uint i = ItemIndex();
  if (i >= params.num_surfels || imageLoad(association, int(i)).x != kSeenThrough) return;
  const uvec4 old = imageLoad(old_history, int(i));
  const uint against = High16(old.y) + 1u;
  history[i] = uvec4(old.x, Pack16(Low16(old.y), against), old.zw);
  if (against < Low16(old.y)) return;
  normal_weight[i] = vec4(0.0);
  atomicAdd(num_removed, 1u);
}
