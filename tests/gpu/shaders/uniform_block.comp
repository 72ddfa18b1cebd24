// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Has a binding of a kind that the library does not know.
#version 450
layout(local_size_x = 1) in;
layout(set = 0, binding = 0, std140) uniform Block { uint value; } block;
layout(set = 0, binding = 1, std430) buffer Result { uint result[]; };

void main() { result[0] = block.value; }
