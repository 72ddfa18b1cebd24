// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Matching costs of fronto-parallel planes of the reference, all planes of one pixel an invocation.
// The homography of plane k takes the pixel to a source; its cost is that of plane_cost.glsl.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/plane_sweep.params.h"

layout(local_size_x = 64) in;

layout(binding = 0, rg32ui) uniform readonly uimageBuffer census;
layout(binding = 1, rgba32f) uniform readonly imageBuffer projections;
// Four costs a word; the planes of a pixel lie together, pixels in rows of width_px.
layout(binding = 2, std430) writeonly buffer Costs {
  uvec4 costs[];
};

#include "depth/sources.glsl"
#include "depth/plane_cost.glsl"
#include "depth/projections.glsl"

vec3 a[kMaxSources];  // A p of each source
vec3 b[kMaxSources];
ivec4 bounds[kMaxSources];
int stride_px;

// Once for a pixel, before Cost.
void PreparePixel(int x, int y) {
  stride_px = 4 * (int(params.width_px + 3u) / 4);
  census_pixels = stride_px * int(params.height_px);
  LoadReference(y * stride_px + x);
  const vec3 p = vec3(x, y, 1);
  const bool shown = ReferenceShows(p.xy);
  [[unroll]] for (int s = 0; s < kNumSources; ++s) {
    const Projection projection = LoadProjection(s);
    a[s] = shown ? projection.A * p : vec3(0, 0, -1);  // behind every source
    b[s] = shown ? projection.b : vec3(0);
    bounds[s] = ivec4(projection.bounds);
  }
}

View ViewFrom(int source, vec3 at) {
  const float scale = 1.0 / at.z;
  const int x = int(floor(at.x * scale + 0.5));
  const int y = int(floor(at.y * scale + 0.5));
  const ivec4 limits = bounds[source];
  const bool visible =
      at.z > 0.0 && x >= limits.x && y >= limits.y && x <= limits.z && y <= limits.w;
  return ViewOf(visible, (1 + source) * census_pixels + y * stride_px + x);
}

uint Cost(float w) {
  View views[kMaxSources];
  [[unroll]] for (int s = 0; s < kNumSources; ++s) views[s] = ViewFrom(s, a[s] + w * b[s]);
  return CostOf(views);
}

void main() {
  const int x = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  if (x >= int(params.width_px) || y >= int(params.height_px)) return;
  PreparePixel(x, y);
  // Read here, since drivers may not lift what does not change out of the loops.
  const float num_planes = float(params.num_planes);
  const float first_inverse_depth = params.inverse_depth;
  const float inverse_depth_step = params.inverse_depth_step;
  const uint num_chunks = params.padded_planes / 16u;
  const uint first = (uint(y) * params.width_px + uint(x)) * num_chunks;
  float k = 0.0;  // plane
  for (uint chunk = 0u;;) {
    uvec4 words;
    for (uint i = 0u;;) {
      uint word = 0u;
      [[unroll]] for (uint j = 0u; j < 4u; ++j) {
        const uint cost = Cost(first_inverse_depth + k * inverse_depth_step);
        word = (word >> 8) | ((k < num_planes ? cost : kInvalidCost) << 24);
        k += 1.0;
      }
      words = uvec4(words.yzw, word);
      if (++i == 4u) break;
    }
    costs[first + chunk] = words;
    if (++chunk >= num_chunks) break;
  }
}
