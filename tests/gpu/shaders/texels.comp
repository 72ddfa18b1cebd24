// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Sums one texel of each format.
#version 450
layout(local_size_x = 1) in;
layout(set = 0, binding = 0, r32f) uniform readonly imageBuffer a;
layout(set = 0, binding = 1, rgba32f) uniform readonly imageBuffer b;
layout(set = 0, binding = 2, rgba32ui) uniform readonly uimageBuffer c;
layout(set = 0, binding = 3, r32i) uniform readonly iimageBuffer d;
layout(set = 0, binding = 4, rgba32i) uniform readonly iimageBuffer e;
layout(set = 0, binding = 5, rg32ui) uniform readonly uimageBuffer f;
layout(set = 0, binding = 6, rg32f) uniform readonly imageBuffer g;
layout(set = 0, binding = 7, std430) writeonly buffer Result { vec4 result[]; };

void main() {
  const int i = int(gl_GlobalInvocationID.x);
  result[i] = imageLoad(a, i).xxxx + imageLoad(b, i) + vec4(imageLoad(c, i)) +
              vec4(imageLoad(d, i).xxxx) + vec4(imageLoad(e, i)) +
              vec4(imageLoad(f, i)) + imageLoad(g, i);
}
