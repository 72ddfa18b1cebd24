// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// What a depth map says of each surfel; how, stands in associate.glsl.
#include "fusion/associate.glsl"

layout(binding = 7, std430) writeonly buffer Association { uint association[]; };  // per surfel

void main() {
  const uint block = imageLoad(blocks, int(WorkGroupIndex())).x;
  const uint i = SurfelOfBlock(block);
  Placed placed;
  if (i >= params.first_surfel && i < params.num_surfels) association[i] = Associate(i, block, placed);
}
