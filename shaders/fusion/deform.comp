// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// Moves each surfel with the views around its anchor: a deformation graph (Sumner, Schmid, Pauly
// 2007) whose nodes are the depth maps, neighbours in the order in which they were fused. Each node
// is a similarity about its centre; a surfel takes their mean, by its distance from the centres and
// by how many depth maps lie between, so that neighbouring surfels move alike.
#include "fusion/deform.params.h"
#include "fusion/item.glsl"

layout(binding = 0, rgba32f) uniform readonly imageBuffer old_position_radius;  // per surfel
layout(binding = 1, rgba32f) uniform readonly imageBuffer old_normal_weight;    // per surfel
layout(binding = 2, rgba32ui) uniform readonly uimageBuffer history;            // per surfel
// Per node: three rows of [scale * rotation | centre afterwards], then centre before and scale; su.
layout(binding = 3, rgba32f) uniform readonly imageBuffer nodes;
layout(binding = 4, std430) writeonly buffer PositionRadius { vec4 position_radius[]; };
layout(binding = 5, std430) writeonly buffer NormalWeight { vec4 normal_weight[]; };

void main() {
  const uint i = ItemIndex();
  if (i >= params.num_surfels) return;
  const vec4 old_normal = imageLoad(old_normal_weight, int(i));
  if (old_normal.w <= 0.0) return;
  const vec4 old_position = imageLoad(old_position_radius, int(i));
  const int anchor = int(imageLoad(history, int(i)).w & 0xFFFFu);
  const int first = max(anchor - int(params.window), 0);
  const int last = min(anchor + int(params.window), int(params.num_nodes) - 1);

  float farthest = 0.0;
  for (int node = first; node <= last; ++node) {
    const vec3 offset = old_position.xyz - imageLoad(nodes, 4 * node + 3).xyz;
    farthest = max(farthest, dot(offset, offset));
  }
  // A little farther than the farthest, which thus counts hardly at all but is never alone with 0.
  const float reach = max(1.01 * farthest, 1e-30);
  float sum = 0.0, scale = 0.0;
  vec3 position = vec3(0.0), normal = vec3(0.0);
  for (int node = first; node <= last; ++node) {
    const vec4 x = imageLoad(nodes, 4 * node), y = imageLoad(nodes, 4 * node + 1);
    const vec4 z = imageLoad(nodes, 4 * node + 2), centre = imageLoad(nodes, 4 * node + 3);
    const vec3 offset = old_position.xyz - centre.xyz;
    const float nearness = 1.0 - dot(offset, offset) / reach;
    const float steps = float(node - anchor) / float(params.window + 1u);
    const float weight = nearness * nearness * (1.0 - steps * steps);
    sum += weight;
    scale += weight * centre.w;
    position += weight * vec3(dot(x.xyz, offset) + x.w, dot(y.xyz, offset) + y.w,
                              dot(z.xyz, offset) + z.w);
    normal += weight * vec3(dot(x.xyz, old_normal.xyz), dot(y.xyz, old_normal.xyz),
                            dot(z.xyz, old_normal.xyz));
  }
  scale /= sum;
  position_radius[i] = vec4(position / sum, old_position.w * scale);
  // Information on depth, 1/su^2.
  normal_weight[i] = vec4(normalize(normal), old_normal.w / (scale * scale));
}
