// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// One step of a prefix sum: each value plus the one `stride` before it.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "gpu/shaders/prefix_sum_step.params.h"
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, std430) readonly buffer Values { uint values[]; };
layout(set = 0, binding = 1, std430) writeonly buffer Sums { uint sums[]; };

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= params.num_values) return;
  sums[i] = values[i] + (i >= params.stride ? values[i - params.stride] : 0);
}
