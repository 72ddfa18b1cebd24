// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Asks for 64-bit floats, which the library does not turn on.
#version 450
layout(local_size_x = 1) in;
layout(set = 0, binding = 0, std430) buffer Result { double result[]; };

void main() { result[0] = result[0] * 2.0LF; }
