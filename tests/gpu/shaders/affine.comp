// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// result = values * factors[0] * factors[1] + offset, read through a texel view.
#version 450
#extension GL_GOOGLE_include_directive : require
#include "gpu/shaders/affine.params.h"
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, r32ui) uniform readonly uimageBuffer values;
layout(set = 0, binding = 1, std430) writeonly buffer Result { uint result[]; };

void main() {
  const uint i = gl_GlobalInvocationID.x;
  if (i >= params.num_values) return;
  const uint value = imageLoad(values, int(i)).x;
  result[i] = value * params.factors[0] * params.factors[1] + uint(params.offset);
}
