// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Depth of the surface through each pixel, and how sure it is: on a plane n.X = 1 inverse depth is
// affine in the pixel, w = (K^-T n).(x, y, 1). The affine function is fitted to the measurements of the 7x7
// window (photometric.comp) by least squares, weighted by their information and distance, over the
// pixels that belong to the surface of the middle one: those whose inverse depth is near, the nearer
// the smaller the distance. Two pixels, one above the other, an invocation.
//
// Confidence is 1 / (1 + e), where e is the error to be expected in 0.1 % of the depth:
//   2 e = (1 + s) / (q sqrt(a u)) - 1.
// s is a deviation in per cent of the depth, the sum of three: of the measurements and of the surface
// around its plane; of what a pixel of place makes on the slope of the 5x5 window, which at steps is
// large; and of the bends of the surface across the window in four directions, which the plane
// smoothes away. u says how much better the matching was than any other, a how much of the grey
// values the surface explains, and q how much of the window has depth: less of them, more doubt.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/surface.params.h"

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool kWithConfidence = true;  // else it is not written

// photometric.comp, with a border of three zeros.
layout(binding = 0, rgba32f) uniform readonly imageBuffer measurements;
layout(binding = 1, r32f) uniform readonly imageBuffer uniqueness;  // of the sweep, 0 to 1
layout(binding = 2, std430) writeonly buffer InverseDepth {         // 1/su; 0: no estimate
  float inverse_depth[];
};
layout(binding = 3, std430) writeonly buffer Confidence {  // 0 to 1
  float confidence[];
};

const int kRadius = 3;
const int kRowsPerInvocation = 2;  // as surface.cpp dispatches
// exp(-d^2 / (2 * 1.5^2)): half of the weight lies within 1.8 px.
const float kFalloff[4] = float[](1.0, 0.8007, 0.4111, 0.1353);
const float kWholeWindow = 13.6686;  // sum over the window
const float kWindowPixels = 49.0;
const float kPerCent = 0.01;

// Sums of the normal equations for v = g0 + gx dx + gy dy, in planes from the middle one; the sum of the
// supports; the pixels with an estimate; and the least and the greatest inverse depth of the 5x5 window, as the bits of positive
// floats, which have the same order: the least less 1, so that no estimate is the greatest number.
struct Sums {
  float n, x, y, xx, xy, yy, v, xv, yv, vv, support, found;
  uint nearest, farthest;
};

// One row of the window.
void AddRow(inout Sums s, vec4 row[7], float middle, int dy) {
  const float per_plane = 1.0 / params.inverse_depth_step;
  float n = 0.0, sx = 0.0, sxx = 0.0, sv = 0.0, sxv = 0.0, svv = 0.0, support = 0.0;
  [[unroll]] for (int dx = -kRadius; dx <= kRadius; ++dx) {
    const vec4 m = row[dx + kRadius];
    const float reach = float(max(max(abs(dx), abs(dy)), 1)) * params.inverse_depth_step;
    // Pixels without estimate have neither information nor support.
    const float falloff = abs(m.x - middle) <= reach ? kFalloff[abs(dx)] : 0.0;
    const float u = falloff * m.z;
    const float v = (m.y - middle) * per_plane;
    const float uv = u * v;
    n += u;
    sx += u * float(dx);
    sxx += u * float(dx * dx);
    sv += uv;
    sxv += uv * float(dx);
    svv += uv * v;
    support += falloff * m.w;
    if (kWithConfidence) s.found += m.x > 0.0 ? 1.0 : 0.0;
    if (kWithConfidence && max(abs(dx), abs(dy)) <= 2) {
      s.nearest = max(s.nearest, floatBitsToUint(m.x));
      s.farthest = min(s.farthest, floatBitsToUint(m.x) - 1u);
    }
  }
  const float falloff = kFalloff[abs(dy)];
  const float fdy = float(dy);
  s.n += falloff * n;
  s.x += falloff * sx;
  s.y += falloff * fdy * n;
  s.xx += falloff * sxx;
  s.xy += falloff * fdy * sx;
  s.yy += falloff * fdy * fdy * n;
  s.v += falloff * sv;
  s.xv += falloff * sxv;
  s.yv += falloff * fdy * sv;
  s.vv += falloff * svv;
  s.support += falloff * support;
}

// How far the middle is from the straight line between its neighbours `step` texels to either side.
float Bend(int texel, int step, float middle) {
  const float before = imageLoad(measurements, texel - step).x;
  const float after = imageLoad(measurements, texel + step).x;
  return before > 0.0 && after > 0.0 ? abs(0.5 * (before + after) - middle) : 0.0;
}

// Of the four directions across the window.
float Bends(int texel, int stride, float middle) {
  return Bend(texel, kRadius, middle) + Bend(texel, kRadius * stride, middle) +
         Bend(texel, kRadius * (stride + 1), middle) + Bend(texel, kRadius * (stride - 1), middle);
}

void Store(Sums s, float middle, int x, int y) {
  const int pixel = y * int(params.width_px) + x;
  const int stride = int(params.width_px) + 2 * kRadius;
  // Gradient by Cramer's rule on the centred moments.
  const float cxx = s.n * s.xx - s.x * s.x;
  const float cxy = s.n * s.xy - s.x * s.y;
  const float cyy = s.n * s.yy - s.y * s.y;
  const float cxv = s.n * s.xv - s.x * s.v;
  const float cyv = s.n * s.yv - s.y * s.v;
  const float determinant = cxx * cyy - cxy * cxy;
  float w = middle;
  float sure = 0.0;
  if (w > 0.0 && determinant > 1e-3 * cxx * cyy && cxx > 0.0 && cyy > 0.0) {
    const float gx = (cxv * cyy - cyv * cxy) / determinant;
    const float gy = (cyv * cxx - cxv * cxy) / determinant;
    const float g0 = (s.v - gx * s.x - gy * s.y) / s.n;
    w = max(middle + params.inverse_depth_step * clamp(g0, -1.0, 1.0), 0.5 * middle);
    const float misfit = max(s.vv - g0 * s.v - gx * s.xv - gy * s.yv, 0.0);
    const float slope = (uintBitsToFloat(s.nearest) - uintBitsToFloat(s.farthest + 1u)) / 4.0;
    if (kWithConfidence) {
      const float bends = Bends((y + kRadius) * stride + x + kRadius, stride, middle);
      const float deviation =
          sqrt((1.0 + misfit) / s.n) * params.inverse_depth_step + slope + bends;
      const float explained = s.support / kWholeWindow;
      const float evidence =
          s.found / kWindowPixels * sqrt(explained * imageLoad(uniqueness, pixel).x);
      sure = 2.0 * evidence / (evidence + 1.0 + deviation / (kPerCent * w));
    }
  }
  inverse_depth[pixel] = w;
  // An isolated pixel keeps its depth, with the least confidence there is.
  if (kWithConfidence) confidence[pixel] = w > 0.0 ? clamp(sure, 1e-3, 1.0) : 0.0;
}

void main() {
  const int x = int(gl_GlobalInvocationID.x);
  const int y = kRowsPerInvocation * int(gl_GlobalInvocationID.y);
  const int width = int(params.width_px);
  const int height = int(params.height_px);
  if (x >= width || y >= height) return;
  const int stride = width + 2 * kRadius;
  const int first = y * stride + x;  // of the window, whose corner the border moves to the pixel
  // Of an odd number of rows the last has none below.
  const int last_row = height + 2 * kRadius - 1;
  const float middle = imageLoad(measurements, first + kRadius * stride + kRadius).x;
  const float middle_below =
      imageLoad(measurements, min(y + kRadius + 1, last_row) * stride + x + kRadius).x;
  Sums above = Sums(0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0u, 0xffffffffu);
  Sums below = above;
  [[unroll]] for (int i = 0; i < 8; ++i) {
    vec4 row[7];
    const int start = min(y + i, last_row) * stride + x;
    [[unroll]] for (int dx = 0; dx < 7; ++dx) row[dx] = imageLoad(measurements, start + dx);
    if (i < 7) AddRow(above, row, middle, i - kRadius);
    if (i > 0) AddRow(below, row, middle_below, i - 1 - kRadius);
  }
  Store(above, middle, x, y);
  if (y + 1 < height) Store(below, middle_below, x, y + 1);
}
