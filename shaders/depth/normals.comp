// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Normals: on a plane n.X = 1 inverse depth is affine in the pixel, w = (K^-T n).(x, y, 1). The affine
// function is fitted by least squares over the 7x7 window, to the pixels that belong to the surface
// of the middle one: those whose inverse depth is near, the nearer the smaller the distance.
// Camera frame, towards the camera; 0 where there is no depth or too little surface.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/normals.params.h"

layout(local_size_x = 64) in;

layout(binding = 0, r32f) uniform readonly imageBuffer inverse_depth;  // 1/su; 0: no estimate
layout(binding = 1, std430) writeonly buffer Normals {                 // x y z of each pixel
  float normals[];
};

const int kRadius = 3;

void main() {
  const int x = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  const int width = int(params.width_px);
  const int height = int(params.height_px);
  if (x >= width || y >= height) return;
  const int pixel = y * width + x;
  const float middle = imageLoad(inverse_depth, pixel).x;

  // Sums of the normal equations for w - middle = g0 + gx dx + gy dy.
  float n = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0, syy = 0.0;
  float sw = 0.0, sxw = 0.0, syw = 0.0;
  for (int dy = -kRadius; dy <= kRadius; ++dy) {
    const int row = y + dy;
    [[unroll]] for (int dx = -kRadius; dx <= kRadius; ++dx) {
      const int column = x + dx;
      const bool inside = row >= 0 && row < height && column >= 0 && column < width;
      const float w = imageLoad(inverse_depth, inside ? row * width + column : pixel).x;
      const float difference = w - middle;
      const float reach = params.tolerance * float(max(max(abs(dx), abs(dy)), 1));
      const float u = inside && w > 0.0 && abs(difference) <= reach ? 1.0 : 0.0;
      const float fdx = float(dx);
      const float fdy = float(dy);
      n += u;
      sx += u * fdx;
      sy += u * fdy;
      sxx += u * fdx * fdx;
      sxy += u * fdx * fdy;
      syy += u * fdy * fdy;
      const float scaled = u * difference / params.tolerance;  // near 1, whatever the scale
      sw += scaled;
      sxw += scaled * fdx;
      syw += scaled * fdy;
    }
  }
  // Gradient by Cramer's rule on the centred moments.
  const float cxx = n * sxx - sx * sx;
  const float cxy = n * sxy - sx * sy;
  const float cyy = n * syy - sy * sy;
  const float cxw = n * sxw - sx * sw;
  const float cyw = n * syw - sy * sw;
  const float determinant = cxx * cyy - cxy * cxy;
  vec3 normal = vec3(0);
  // A third of the window, spread in both directions: full, cxx is 49 * 196.
  if (middle > 0.0 && n >= 16.0 && determinant > 1e-3 * cxx * cyy && cxx > 0.0 && cyy > 0.0) {
    const float gx = params.tolerance * (cxw * cyy - cyw * cxy) / determinant;
    const float gy = params.tolerance * (cyw * cxx - cxw * cxy) / determinant;
    const float g0 = middle + (params.tolerance * sw - gx * sx - gy * sy) / n;
    const float at_origin = g0 - gx * float(x) - gy * float(y);
    const vec3 outwards =
        vec3(params.fx * gx, params.fy * gy, params.cx * gx + params.cy * gy + at_origin);
    // Surfaces seen more edge-on than the axis allows have no normal towards the camera plane.
    if (outwards.z > 0.0) normal = -normalize(outwards);
  }
  normals[3 * pixel] = normal.x;
  normals[3 * pixel + 1] = normal.y;
  normals[3 * pixel + 2] = normal.z;
}
