// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// The depth of the nearest surfel of each cell of kNearestCell_px pixels, for register.comp.
// Surfaces hide what is behind them from whichever side they are seen.
#include "fusion/register.params.h"
#define MONO3D_FUSION_OWN_PARAMS
#include "fusion/surfel.glsl"
#include "fusion/view.glsl"
#include "fusion/nearest_cell.glsl"

layout(binding = 0, rgba32f) uniform readonly imageBuffer position_radius;  // per surfel
layout(binding = 1, rgba32f) uniform readonly imageBuffer normal_weight;    // per surfel
layout(binding = 2, r32ui) uniform readonly uimageBuffer blocks;            // to work on
layout(binding = 3, r32ui) uniform readonly uimageBuffer anchor_of_block;
layout(binding = 4, rgba32f) uniform readonly imageBuffer anchors;
// Per cell, the bits of a depth, which sort as it does; all bits set: empty, not a number.
layout(binding = 5, std430) buffer Nearest { uint nearest[]; };

void main() {
  const uint block = imageLoad(blocks, int(WorkGroupIndex())).x;
  const uint i = SurfelOfBlock(block);
  if (i >= params.num_surfels || imageLoad(normal_weight, int(i)).w <= 0.0) return;
  const int anchor = int(imageLoad(anchor_of_block, int(block)).x);
  UseAnchor(imageLoad(anchors, 2 * anchor), imageLoad(anchors, 2 * anchor + 1));
  const vec3 p_cam = PointToCamera(imageLoad(position_radius, int(i)).xyz);
  if (p_cam.z <= 0.0) return;
  precise vec2 rounded = floor(Project(p_cam) + 0.5);
  if (any(lessThan(rounded, vec2(0.0))) || rounded.x >= float(params.width_px) ||
      rounded.y >= float(params.height_px)) {
    return;
  }
  atomicMin(nearest[NearestCellOf(rounded)], floatBitsToUint(p_cam.z));
}
