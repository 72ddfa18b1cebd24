// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The smallest 64-bit value, as the index map needs it.
#version 450
#extension GL_EXT_shader_explicit_arithmetic_types_int64 : require
#extension GL_EXT_shader_atomic_int64 : require
layout(local_size_x = 64) in;
layout(set = 0, binding = 0, std430) readonly buffer Values { uint64_t values[]; };
layout(set = 0, binding = 1, std430) buffer Smallest { uint64_t smallest; };

void main() { atomicMin(smallest, values[gl_GlobalInvocationID.x]); }
