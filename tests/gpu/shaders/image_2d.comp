// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Reads an image that is no texel buffer.
#version 450
layout(local_size_x = 1) in;
layout(set = 0, binding = 0, r32ui) uniform readonly uimage2D picture;
layout(set = 0, binding = 1, std430) buffer Result { uint result[]; };

void main() { result[0] = imageLoad(picture, ivec2(0)).x; }
