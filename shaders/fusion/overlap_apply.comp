// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// Each surfel to which others were added becomes their mean by weight, along the ray of the view.
// Leaves the sums 0.
#include "fusion/overlap.glsl"

layout(binding = 0, r32ui) uniform readonly uimageBuffer sums;  // four per surfel, see overlap_add
layout(binding = 1, rgba32f) uniform readonly imageBuffer old_position_radius;  // per surfel
layout(binding = 2, rgba32f) uniform readonly imageBuffer old_normal_weight;    // per surfel
layout(binding = 3, rgba32ui) uniform readonly uimageBuffer old_history;        // per surfel
layout(binding = 4, r32ui) uniform readonly uimageBuffer blocks;  // to work on
layout(binding = 5, rgba32f) uniform readonly imageBuffer anchors;  // two per anchor, see UseAnchor
layout(binding = 6, std430) writeonly buffer NextSums { uvec4 next_sums[]; };
layout(binding = 7, std430) writeonly buffer PositionRadius { vec4 position_radius[]; };
layout(binding = 8, std430) writeonly buffer NormalWeight { vec4 normal_weight[]; };
layout(binding = 9, std430) writeonly buffer History { uvec4 history[]; };

void main() {
  const uint i = SurfelOfBlock(imageLoad(blocks, int(WorkGroupIndex())).x);
  if (i >= params.num_surfels) return;
  const uint observations = imageLoad(sums, int(4u * i)).x;
  if (observations == 0u) return;
  const uint confidence = imageLoad(sums, int(4u * i + 1u)).x;
  const float share = float(imageLoad(sums, int(4u * i + 2u)).x) / kShareSteps;
  const float shift = float(int(imageLoad(sums, int(4u * i + 3u)).x)) / kShareSteps;
  const vec4 normal = imageLoad(old_normal_weight, int(i));
  const vec4 position = imageLoad(old_position_radius, int(i));
  const uvec4 old = imageLoad(old_history, int(i));
  const int anchor = int(Low16(old.w));
  UseAnchor(imageLoad(anchors, 2 * anchor), imageLoad(anchors, 2 * anchor + 1));
  const vec3 p_cam = PointToCamera(position.xyz);
  const float w = 1.0 / p_cam.z;
  const float merged = w + SurfelSigma(w, WeightToCamera(normal.w)) * shift / (1.0 + share);
  position_radius[i] = vec4(PointToAnchor(p_cam * (w / merged)), position.w);
  normal_weight[i] = vec4(normal.xyz, normal.w * (1.0 + share));
  history[i] = uvec4(old.x, Pack16(Low16(old.y) + observations, High16(old.y)), old.z,
                     Pack16(Low16(old.w), High16(old.w) + confidence));
  next_sums[i] = uvec4(0u);
}
