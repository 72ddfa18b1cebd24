// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Has bindings 0 and 2.
#version 450
layout(local_size_x = 1) in;
layout(set = 0, binding = 0, std430) readonly buffer Values { uint values[]; };
layout(set = 0, binding = 2, std430) buffer Result { uint result[]; };

void main() { result[0] = values[0]; }
