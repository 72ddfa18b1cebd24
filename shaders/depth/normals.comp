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

layout(binding = 0, rgba32f) uniform readonly imageBuffer inverse_depth;  // 1/su; 0: no estimate
layout(binding = 1, std430) writeonly buffer Normals {                    // x y z of each pixel
  float normals[];
};

#include "depth/map_row.glsl"

const int kRadius = 3;
const float kMinSupport = 4.0;  // pixels, which then do not lie on one line
const float kNone = -3e38;  // nowhere near any inverse depth

// Sums of the normal equations for w - middle = g0 + gx dx + gy dy.
struct Sums {
  float n, x, y, xx, xy, yy, w, xw, yw;
};

vec3 NormalOf(Sums s, float middle, float x, float y) {
  const float per_tolerance = 1.0 / params.tolerance;  // brings w near 1, whatever the scale
  const float sw = s.w * per_tolerance;
  // Gradient by Cramer's rule on the centred moments.
  const float cxx = s.n * s.xx - s.x * s.x;
  const float cxy = s.n * s.xy - s.x * s.y;
  const float cyy = s.n * s.yy - s.y * s.y;
  const float cxw = s.n * (s.xw * per_tolerance) - s.x * sw;
  const float cyw = s.n * (s.yw * per_tolerance) - s.y * sw;
  const float determinant = cxx * cyy - cxy * cxy;
  if (!(middle > 0.0 && s.n >= kMinSupport && determinant > 1e-3 * cxx * cyy && cxx > 0.0 && cyy > 0.0)) {
    return vec3(0);
  }
  const float gx = params.tolerance * (cxw * cyy - cyw * cxy) / determinant;
  const float gy = params.tolerance * (cyw * cxx - cxw * cxy) / determinant;
  const float g0 = middle + (params.tolerance * sw - gx * s.x - gy * s.y) / s.n;
  const float at_origin = g0 - gx * x - gy * y;
  const vec3 outwards =
      vec3(params.fx * gx, params.fy * gy, params.cx * gx + params.cy * gy + at_origin);
  // Surfaces seen more edge-on than the axis allows have no normal towards the camera plane.
  return outwards.z > 0.0 ? -normalize(outwards) : vec3(0);
}

void main() {
  const int width = int(params.width_px);
  const int height = int(params.height_px);
  const int group = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  if (4 * group >= width || y >= height) return;
  float row[12];
  LOAD_MAP_ROW(inverse_depth, width, height, group, y, row)
  const vec4 middle = vec4(row[4], row[5], row[6], row[7]);

  Sums sums[4];
  [[unroll]] for (int p = 0; p < 4; ++p) sums[p] = Sums(0, 0, 0, 0, 0, 0, 0, 0, 0);
  [[unroll]] for (int dy = -kRadius; dy <= kRadius; dy += kRadius) {
    LOAD_MAP_ROW(inverse_depth, width, height, group, clamp(y + dy, 0, height - 1), row)
    const bool row_inside = y + dy >= 0 && y + dy < height;
    [[unroll]] for (int i = 1; i < 11; ++i) {
      const int column = 4 * group - 4 + i;
      const bool inside = row_inside && column >= 0 && column < width;
      row[i] = inside && row[i] > 0.0 ? row[i] : kNone;
    }
    const float fdy = float(dy);
    const float distance_y = max(abs(fdy), 1.0);
    [[unroll]] for (int p = 0; p < 4; ++p) {
      float n = 0.0, sx = 0.0, sxx = 0.0, sw = 0.0, sxw = 0.0;  // of this row
      [[unroll]] for (int dx = -kRadius; dx <= kRadius; dx += kRadius) {
        const float difference = row[p + 4 + dx] - middle[p];
        const bool near = abs(difference) <= params.tolerance * max(float(abs(dx)), distance_y);
        const float u = near ? 1.0 : 0.0;
        const float w = near ? difference : 0.0;
        n += u;
        sx += u * float(dx);
        sxx += u * float(dx * dx);
        sw += w;
        sxw += w * float(dx);
      }
      sums[p].n += n;
      sums[p].x += sx;
      sums[p].y += n * fdy;
      sums[p].xx += sxx;
      sums[p].xy += sx * fdy;
      sums[p].yy += n * fdy * fdy;
      sums[p].w += sw;
      sums[p].xw += sxw;
      sums[p].yw += sw * fdy;
    }
  }
  [[unroll]] for (int p = 0; p < 4; ++p) {
    const int x = 4 * group + p;
    const vec3 normal = NormalOf(sums[p], middle[p], float(x), float(y));
    if (x < width) {
      const int pixel = y * width + x;
      normals[3 * pixel] = normal.x;
      normals[3 * pixel + 1] = normal.y;
      normals[3 * pixel + 2] = normal.z;
    }
  }
}
