// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Has a buffer in set 1.
#version 450
layout(local_size_x = 1) in;
layout(set = 1, binding = 0, std430) buffer Result { uint result[]; };

void main() { result[0] = 1; }
