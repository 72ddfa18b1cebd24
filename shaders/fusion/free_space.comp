// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// What this map says against a surfel. Each map that sees through it counts by its confidence. Maps
// in which it lies hidden behind a surface count as one at most: things do hide each other, but a
// surface that one map alone has seen is rather a mistake when another sees something before it.
// A surfel is removed (its weight becomes 0) when as much speaks against it as for it: what sees
// through it, and for a surfel of a single map also what hides it. A map of the past removes none:
// it may be the one that is wrong, and the next map will tell.
#include "fusion/surfel.glsl"
#include "fusion/view.glsl"

layout(binding = 0, r32ui) uniform readonly uimageBuffer association;  // per surfel
layout(binding = 1, rgba32ui) uniform readonly uimageBuffer old_history;  // per surfel
layout(binding = 2, r32ui) uniform readonly uimageBuffer blocks;  // to work on
layout(binding = 3, std430) writeonly buffer NormalWeight { vec4 normal_weight[]; };  // per surfel
layout(binding = 4, std430) writeonly buffer History { uvec4 history[]; };  // per surfel
layout(binding = 5, std430) buffer Count { uint num_removed; };

void main() {
  const uint i = SurfelOfBlock(imageLoad(blocks, int(WorkGroupIndex())).x);
  if (i < params.first_surfel || i >= params.num_surfels) return;
  const uint said = imageLoad(association, int(i)).x;
  if (!Says(said, kSeenThrough) && !Says(said, kHidden)) return;
  const uint confidence = said & 0xFFu;  // in 1/255
  const uvec4 old = imageLoad(old_history, int(i));
  uint seen_through = (old.y >> 16) & 0xFFu;
  uint hidden = old.y >> 24;
  if (Says(said, kSeenThrough)) {
    seen_through = min(seen_through + (8u * confidence + 127u) / 255u, 255u);
  } else {
    hidden = min(hidden + confidence, 255u);
  }
  const uint counts = Low16(old.y) | (seen_through << 16) | (hidden << 24);
  history[i] = uvec4(old.x, counts, old.zw);
  uint against = SeenThroughAgainst(counts);
  if (Low16(counts) == 1u) against += HiddenAgainst(counts);
  if (params.is_past != 0u || against < High16(old.w)) return;
  normal_weight[i] = vec4(0.0);
  atomicAdd(num_removed, 1u);
}
