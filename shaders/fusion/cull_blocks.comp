// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// Marks the blocks of surfels that a view may see: those whose sphere reaches into its pyramid.
#include "fusion/view.glsl"

layout(binding = 0, rgba32f) uniform readonly imageBuffer bounds;  // per block: centre, radius;
                                                                   // in the anchor's frame
layout(binding = 1, r32ui) uniform readonly uimageBuffer anchor_of_block;
layout(binding = 2, rgba32f) uniform readonly imageBuffer anchors;  // two per anchor, see UseAnchor
layout(binding = 3, std430) buffer Seen { uint is_seen[]; };        // per block; 0 before

// Signed distance of a point from a plane through the camera, on whose inner side both
// coordinates weigh positive.
float Inside(float across, float z, float across_weight, float z_weight) {
  return (across_weight * across + z_weight * z) / length(vec2(across_weight, z_weight));
}

bool MaySee(vec4 sphere, int anchor) {
  if (sphere.w < 0.0) return false;
  UseAnchor(imageLoad(anchors, 2 * anchor), imageLoad(anchors, 2 * anchor + 1));
  const vec3 p = PointToCamera(sphere.xyz);
  const float left = Inside(p.x, p.z, params.fx, params.cx + 0.5);
  const float right =
      Inside(p.x, p.z, -params.fx, float(params.width_px) - 0.5 - params.cx);
  const float top = Inside(p.y, p.z, params.fy, params.cy + 0.5);
  const float bottom =
      Inside(p.y, p.z, -params.fy, float(params.height_px) - 0.5 - params.cy);
  return min(min(min(left, right), min(top, bottom)), p.z) >= -sphere.w * scale;
}

void main() {
  const uint block = ItemIndex();
  const uint num_blocks = (params.num_surfels + kSurfelsPerBlock - 1u) / kSurfelsPerBlock;
  if (block >= num_blocks) return;
  const int anchor = int(imageLoad(anchor_of_block, int(block)).x);
  if (MaySee(imageLoad(bounds, int(block)), anchor)) is_seen[block] = 1u;
}
