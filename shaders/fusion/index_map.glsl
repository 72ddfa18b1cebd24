// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Where a surfel falls in the index map: the model drawn into the camera of the depth map, with
// kIndexCellsPerPixel cells per pixel, the nearest surfel in each cell. Surfels that face away, and
// those that the depth map sees through, are not drawn.
#include "fusion/view.glsl"
#include "fusion/index_cell.glsl"

layout(binding = 0, rgba32f) uniform readonly imageBuffer position_radius;  // per surfel
layout(binding = 1, rgba32f) uniform readonly imageBuffer normal_weight;  // per surfel
layout(binding = 2, r32ui) uniform readonly uimageBuffer association;  // per surfel
layout(binding = 3, r32ui) uniform readonly uimageBuffer blocks;  // to work on
layout(binding = 4, r32ui) uniform readonly uimageBuffer anchor_of_block;
layout(binding = 5, rgba32f) uniform readonly imageBuffer anchors;  // two per anchor, see UseAnchor

uint ThisSurfel() { return SurfelOfBlock(imageLoad(blocks, int(WorkGroupIndex())).x); }

// The cell of surfel i and its depth, as bits that order like the positive number they are.
uint IndexCell(uint i, out uint depth_bits) {
  depth_bits = 0u;
  const vec4 surfel_normal = imageLoad(normal_weight, int(i));
  if (surfel_normal.w <= 0.0) return kNoCell;
  if (Says(imageLoad(association, int(i)).x, kSeenThrough)) return kNoCell;
  const int anchor = int(imageLoad(anchor_of_block, int(i / kSurfelsPerBlock)).x);
  UseAnchor(imageLoad(anchors, 2 * anchor), imageLoad(anchors, 2 * anchor + 1));
  const vec3 p_cam = PointToCamera(imageLoad(position_radius, int(i)).xyz);
  depth_bits = floatBitsToUint(p_cam.z);
  return IndexCellOf(p_cam, DirectionToCamera(surfel_normal.xyz));
}
