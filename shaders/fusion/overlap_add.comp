// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// Each surfel that has found an older one in its place is added to it, and removed. Where that one
// is about to be removed itself, both wait for another view.
#include "fusion/overlap.glsl"

layout(binding = 0, rgba32f) uniform readonly imageBuffer position_radius;    // per surfel
layout(binding = 1, rgba32f) uniform readonly imageBuffer old_normal_weight;  // per surfel
layout(binding = 2, rgba32ui) uniform readonly uimageBuffer history;          // per surfel
layout(binding = 3, r32ui) uniform readonly uimageBuffer target;              // per surfel
layout(binding = 4, r32ui) uniform readonly uimageBuffer blocks;  // to work on
layout(binding = 5, rgba32f) uniform readonly imageBuffer anchors;  // two per anchor, see UseAnchor
// Per surfel: observations, confidence in steps, sum of shares, sum of shares * difference / sigma.
layout(binding = 6, std430) buffer Sums { uint sums[]; };
layout(binding = 7, std430) writeonly buffer NormalWeight { vec4 normal_weight[]; };  // per surfel
layout(binding = 8, std430) buffer Count { uint num_removed; };

void UseAnchorOf(uvec4 surfel_history) {
  const int anchor = int(Low16(surfel_history.w));
  UseAnchor(imageLoad(anchors, 2 * anchor), imageLoad(anchors, 2 * anchor + 1));
}

void main() {
  const uint i = SurfelOfBlock(imageLoad(blocks, int(WorkGroupIndex())).x);
  if (i >= params.num_surfels) return;
  const uint j = imageLoad(target, int(i)).x;
  if (j == kNoSurfel || imageLoad(target, int(j)).x != kNoSurfel) return;
  const vec4 own = imageLoad(old_normal_weight, int(i));
  const vec4 other = imageLoad(old_normal_weight, int(j));
  const uvec4 seen = imageLoad(history, int(i));
  UseAnchorOf(seen);
  const vec3 p_i = PointToCamera(imageLoad(position_radius, int(i)).xyz);
  const vec3 n_i = DirectionToCamera(own.xyz);
  const float weight_i = WeightToCamera(own.w);
  UseAnchorOf(imageLoad(history, int(j)));
  const vec3 p_j = PointToCamera(imageLoad(position_radius, int(j)).xyz);
  const float weight_j = WeightToCamera(other.w);
  const float w_j = 1.0 / p_j.z;
  const float expected = TangentPlaneInverseDepth(n_i, p_i / p_i.z, 1.0 / p_i.z, p_j * w_j);
  const float share = min(weight_i / weight_j, kMaxShare);
  const float difference =
      clamp((expected - w_j) / SurfelSigma(w_j, weight_j), -kMaxDifference, kMaxDifference);
  atomicAdd(sums[4u * j], Low16(seen.y));
  atomicAdd(sums[4u * j + 1u], High16(seen.w));
  atomicAdd(sums[4u * j + 2u], uint(share * kShareSteps + 0.5));
  // Two's complement: a negative sum wraps around and back.
  atomicAdd(sums[4u * j + 3u], uint(int(round(share * difference * kShareSteps))));
  normal_weight[i] = vec4(0.0);
  atomicAdd(num_removed, 1u);
}
