// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Writes its constants; the workgroup size is one of them, the other two sizes are numbers.
#version 450
layout(local_size_x_id = 0, local_size_y = 2) in;
layout(constant_id = 1) const uint kFirst = 7;
layout(constant_id = 2) const uint kSecond = 8;
layout(set = 0, binding = 0, std430) writeonly buffer Result { uvec4 result[]; };

void main() {
  const uint i = gl_GlobalInvocationID.y * gl_WorkGroupSize.x + gl_GlobalInvocationID.x;
  result[i] = uvec4(kFirst, kSecond, gl_WorkGroupSize.x, gl_WorkGroupSize.y);
}
