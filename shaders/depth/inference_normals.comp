// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// normals.comp in the tiles where something may have been inferred: a tile is a workgroup, of which
// each invocation has four pixels.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/normals.params.h"

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool kWholeTexels = true;  // rows are whole texels of pixels

layout(binding = 0, r32ui) uniform readonly uimageBuffer tiles;           // inference_tiles.glsl
layout(binding = 1, rgba32f) uniform readonly imageBuffer inverse_depth;  // 1/su; 0: no estimate
layout(binding = 2, std430) writeonly buffer Normals {                    // x y z of each pixel
  vec4 normals[];
};

#include "depth/inference_tiles.glsl"
#include "depth/normals.glsl"

void main() {
  const ivec2 corner = TileCorner(params.width_px);
  const int local = int(gl_LocalInvocationID.x);
  const int group = (corner.x >> 2) + (local & 7);
  const int y = corner.y + (local >> 3);
  if (4 * group >= int(params.width_px) || y >= int(params.height_px)) return;
  vec3 found[4];
  NormalsOfFour(group, y, found);
  StoreNormals(group, y, found);
}
