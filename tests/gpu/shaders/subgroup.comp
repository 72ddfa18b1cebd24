// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The size of the subgroup, as said and as counted.
#version 450
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_shuffle : require
layout(local_size_x = 128) in;
layout(set = 0, binding = 0, std430) writeonly buffer Result { uvec4 result[]; };

void main() {
  const uint last = subgroupShuffle(gl_SubgroupInvocationID, gl_SubgroupSize - 1);
  result[gl_GlobalInvocationID.x] =
      uvec4(gl_SubgroupSize, subgroupAdd(1), last, gl_NumSubgroups);
}
