// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// Turns the selected pixels into surfels, in the listed blocks, in the order of the pixels.
// The depth map is their anchor: they lie in its camera's frame. The last block is filled up with
// slots that count as removed.
#include "fusion/surfel.glsl"
#include "fusion/view.glsl"

layout(binding = 0, r32f) uniform readonly imageBuffer depth;  // su, height x width
layout(binding = 1, rgba32f) uniform readonly imageBuffer candidate;  // per pixel
layout(binding = 2, r32ui) uniform readonly uimageBuffer colour;  // per pixel, surfel.glsl
layout(binding = 3, r32ui) uniform readonly uimageBuffer new_pixels;  // in their order
layout(binding = 4, r32ui) uniform readonly uimageBuffer blocks;  // to fill
layout(binding = 5, std430) writeonly buffer PositionRadius { vec4 position_radius[]; };
layout(binding = 6, std430) writeonly buffer NormalWeight { vec4 normal_weight[]; };
layout(binding = 7, std430) writeonly buffer History { uvec4 history[]; };

void main() {
  const uint num_blocks = (params.num_new + kSurfelsPerBlock - 1u) / kSurfelsPerBlock;
  if (WorkGroupIndex() >= num_blocks) return;
  const uint slot = SurfelOfBlock(imageLoad(blocks, int(WorkGroupIndex())).x);
  if (ItemIndex() >= params.num_new) {
    position_radius[slot] = normal_weight[slot] = vec4(0.0);
    history[slot] = uvec4(0u, 0u, 0u, params.map_index);
    return;
  }
  const uint i = imageLoad(new_pixels, int(ItemIndex())).x;
  const float z = imageLoad(depth, int(i)).x;
  const vec4 normal = imageLoad(candidate, int(i));
  const vec3 ray = Ray(vec2(PixelOf(i)));
  const float sigma = InverseDepthSigma(1.0 / z) * z * z;
  position_radius[slot] =
      vec4(ray * z, SurfelRadius(z, normal.xyz, ray) * float(params.merge_radius_px));
  normal_weight[slot] = vec4(normal.xyz, normal.w / (sigma * sigma));
  const uint rgb8 = imageLoad(colour, int(i)).x;
  history[slot] = uvec4(Colour10From8(rgb8) | CoarseMatchOfPixel(rgb8), Pack16(1u, 0u),
                        Pack16(params.map_index, params.map_index),
                        Pack16(params.map_index, ConfidenceSteps(normal.w)));
}
