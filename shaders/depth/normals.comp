// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Normals: on a plane n.X = 1 inverse depth is affine in the pixel, w = (K^-T n).(x, y, 1). The
// affine function is fitted by least squares to nine pixels, the middle one and those 3 px away in
// rows and columns, as far as they belong to its surface: those whose inverse depth is near, the
// nearer the smaller the distance. (The pixels between them were smoothed together with these; they
// would add little but a shorter lever.)
// Camera frame, towards the camera; 0 where there is no depth or too little surface. Four pixels an
// invocation.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/normals.params.h"

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool kWholeTexels = true;  // rows are whole texels of pixels

layout(binding = 0, rgba32f) uniform readonly imageBuffer inverse_depth;  // 1/su; 0: no estimate
layout(binding = 1, std430) writeonly buffer Normals {                    // x y z of each pixel
  vec4 normals[];
};

#include "depth/normals.glsl"

void main() {
  const int group = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  if (4 * group >= int(params.width_px) || y >= int(params.height_px)) return;
  vec3 found[4];
  NormalsOfFour(group, y, found);
  StoreNormals(group, y, found);
}
