// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Inverse depth and confidence of the surface through each pixel. On a plane n.X = 1 inverse depth
// is affine in the pixel, w = (K^-T n).(x, y, 1). The affine function is fitted to the measurements
// of the 7x7 window (photometric.comp) by least squares, weighted by their information and
// distance, over the pixels on the surface of the middle one: those whose inverse depth differs by
// no more planes than their distance in pixels. Four pixels, 2x2, are one invocation.
//
// Confidence is 1 / (1 + e), where e is the expected error in units of 0.1 % of the depth:
//   2 e = (1 + s) / (q sqrt(a u)) - 1.
// s is a deviation in per cent of the depth, the sum of three: that of the measurements from the
// fitted plane; the change of depth over one pixel, from the range of the 5x5 window, which is
// large at steps; and the curvature of the surface across the window in four directions, which the
// fit smooths away. u is the uniqueness of the match, a the share of the grey values that the
// surface explains, and q the share of the window that has depth.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/surface.params.h"

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool kWithConfidence = true;  // else it is not written

// Pairs of measurement.glsl, of photometric.comp, with a border of three zeros.
layout(binding = 0, rgba32ui) uniform readonly uimageBuffer measurements;
layout(binding = 1, r32f) uniform readonly imageBuffer uniqueness;  // of the sweep, 0 to 1
layout(binding = 2, std430) writeonly buffer InverseDepth {         // 1/su; 0: no estimate
  float inverse_depth[];
};
layout(binding = 3, std430) writeonly buffer Confidence {  // 0 to 1
  float confidence[];
};

#include "depth/measurement.glsl"

const int kRadius = kMeasurementBorder;
const int kPixelsPerInvocation = 2;  // in a row, and rows, as kernels.cpp dispatches
// exp(-d^2 / (2 * 1.5^2)): half of the weight lies within 1.8 px.
const float kFalloff[4] = float[](1.0, 0.8007, 0.4111, 0.1353);
const float kWholeWindow = 13.6686;  // sum over the window
const float kWindowPixels = 49.0;
const float kPerCent = 0.01;

// Of the eight columns of the windows of two pixels. Without an estimate all is 0.
struct Row {
  float w[8], step[8], information[8], support[8];
};

// Sums of the normal equations for v = g0 + gx dx + gy dy, in planes from the middle one; the sum
// of the supports; the pixels with an estimate; the sum of the bends; and the greatest and the
// least inverse depth of the 5x5 window, as the bits of positive floats, which have the same order:
// the least less 1, so that no estimate is the greatest number.
struct Sums {
  float n, x, y, xx, xy, yy, v, xv, yv, vv, support, found;
  float above[3], bends;  // inverse depth at the left, middle and right of the first row
  uint nearest, farthest;
};

Row LoadRow(int first_texel) {
  Row row;
  [[unroll]] for (int i = 0; i < 4; ++i) {
    const uvec4 pair = imageLoad(measurements, first_texel + i);
    [[unroll]] for (int j = 0; j < 2; ++j) {
      const float w = uintBitsToFloat(pair[2 * j]);
      const uint fields = pair[2 * j + 1];
      row.w[2 * i + j] = w;
      row.step[2 * i + j] = StepOf(fields);
      row.information[2 * i + j] = w > 0.0 ? InformationOf(fields) : 0.0;
      row.support[2 * i + j] = kWithConfidence ? SupportOf(fields) : 0.0;
    }
  }
  return row;
}

// How far the middle is from the straight line between its neighbours to either side.
float Bend(float before, float after, float middle) {
  return before > 0.0 && after > 0.0 ? abs(0.5 * (before + after) - middle) : 0.0;
}

// The bends of the four directions across the window, whose ends are in three of its rows.
void AddBends(inout Sums s, Row row, int first, float middle, int dy) {
  const float left = row.w[first];
  const float here = row.w[first + kRadius];
  const float right = row.w[first + 2 * kRadius];
  if (dy == -kRadius) s.above = float[](left, here, right);
  if (dy == 0) s.bends += Bend(left, right, middle);
  if (dy == kRadius) {
    s.bends += Bend(s.above[1], here, middle) + Bend(s.above[0], right, middle) +
               Bend(s.above[2], left, middle);
  }
}

// One row of the window that begins in column `first`.
void AddRow(inout Sums s, Row row, int first, float middle, int dy) {
  const float per_plane = 1.0 / params.inverse_depth_step;
  float n = 0.0, sx = 0.0, sxx = 0.0, sv = 0.0, sxv = 0.0, svv = 0.0, support = 0.0;
  [[unroll]] for (int dx = -kRadius; dx <= kRadius; ++dx) {
    const int i = first + dx + kRadius;
    const float w = row.w[i];
    const float reach = float(max(max(abs(dx), abs(dy)), 1));
    const float planes = (w - middle) * per_plane;
    // Pixels without estimate have neither information nor support.
    const float falloff = abs(planes) <= reach ? kFalloff[abs(dx)] : 0.0;
    const float u = falloff * row.information[i];
    const float v = planes + row.step[i];
    const float uv = u * v;
    n += u;
    sx += u * float(dx);
    sxx += u * float(dx * dx);
    sv += uv;
    sxv += uv * float(dx);
    if (kWithConfidence) {
      svv += uv * v;
      support += falloff * row.support[i];
      s.found += w > 0.0 ? 1.0 : 0.0;
      if (max(abs(dx), abs(dy)) <= 2) {
        s.nearest = max(s.nearest, floatBitsToUint(w));
        s.farthest = min(s.farthest, floatBitsToUint(w) - 1u);
      }
    }
  }
  if (kWithConfidence) AddBends(s, row, first, middle, dy);
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

void Store(Sums s, float middle, int x, int y) {
  const int pixel = min(y * int(params.width_px) + x, int(params.width_px * params.height_px) - 1);
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
      const float deviation =
          sqrt((1.0 + misfit) / s.n) * params.inverse_depth_step + slope + s.bends;
      const float explained = s.support / kWholeWindow;
      const float evidence =
          s.found / kWindowPixels * sqrt(explained * imageLoad(uniqueness, pixel).x);
      sure = 2.0 * evidence / (evidence + 1.0 + deviation / (kPerCent * w));
    }
  }
  if (x >= int(params.width_px) || y >= int(params.height_px)) return;
  inverse_depth[pixel] = w;
  // An isolated pixel keeps its depth, with the least confidence there is.
  if (kWithConfidence) confidence[pixel] = w > 0.0 ? clamp(sure, 1e-3, 1.0) : 0.0;
}

void main() {
  const int x = kPixelsPerInvocation * int(gl_GlobalInvocationID.x);
  const int y = kPixelsPerInvocation * int(gl_GlobalInvocationID.y);
  if (x >= int(params.width_px) || y >= int(params.height_px)) return;
  const int texels_per_row = MeasurementsPerRow(params.width_px) / 2;
  // Of an odd number of rows the last has none below.
  const int last_row = int(params.height_px) + 2 * kRadius - 1;
  // The border moves the windows' corner to the pixel.
  const int first = y * texels_per_row + (x >> 1);
  const int last = last_row * texels_per_row + (x >> 1);
  float middle[4];
  [[unroll]] for (int i = 0; i < 2; ++i) {
    const int row = min(first + (kRadius + i) * texels_per_row, last);
    middle[2 * i] = uintBitsToFloat(imageLoad(measurements, row + kRadius / 2).z);
    middle[2 * i + 1] = uintBitsToFloat(imageLoad(measurements, row + kRadius / 2 + 1).x);
  }
  Sums sums[4];
  [[unroll]] for (int i = 0; i < 4; ++i) {
    sums[i] = Sums(0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, float[](0, 0, 0), 0, 0u, 0xffffffffu);
  }
  [[unroll]] for (int i = 0; i < 8; ++i) {
    const Row row = LoadRow(min(first + i * texels_per_row, last));
    [[unroll]] for (int j = 0; j < 2; ++j) {
      if (i < 7) AddRow(sums[j], row, j, middle[j], i - kRadius);
      if (i > 0) AddRow(sums[2 + j], row, j, middle[2 + j], i - 1 - kRadius);
    }
  }
  Store(sums[0], middle[0], x, y);
  Store(sums[1], middle[1], x + 1, y);
  Store(sums[2], middle[2], x, y + 1);
  Store(sums[3], middle[3], x + 1, y + 1);
}
