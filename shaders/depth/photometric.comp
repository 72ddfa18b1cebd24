// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// One Gauss-Newton step of each pixel's inverse depth on the grey values of all sources, which
// sees fractions of a pixel that census transforms do not: the residual r of source i is the
// difference of detail (detail.comp) between where the source sees the point and the reference, and
// J = dr/dw. A residual that noise and a third of a pixel of motion do not explain counts less
// (Geman and McClure 1987), which takes occluded sources out. The step is damped as if the depth
// were known to one plane: without texture it stays where it is. A point in view of fewer than
// `min_views` sources loses its depth: where the true surface leaves the view of all sources, the
// sweep finds a false one that stays in view of one of them. Sixteen rows are one invocation and
// share the projections.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/photometric.params.h"

layout(local_size_x = 64) in;

// Words, read by fours: of the reference, and of the sources before it and after it.
layout(binding = 0, rgba32ui) uniform readonly uimageBuffer detail;
layout(binding = 1, rgba32ui) uniform readonly uimageBuffer detail_before;
layout(binding = 2, rgba32ui) uniform readonly uimageBuffer detail_after;
layout(binding = 3, rgba32f) uniform readonly imageBuffer projections;    // projections.glsl
layout(binding = 4, rgba32f) uniform readonly imageBuffer inverse_depth;  // 1/su; 0: no estimate
// measurement.glsl: inverse depth before the step; the step in planes; its information,
// 1 / (standard deviation in planes)^2; and the mean weight of the sources, 0 to 1. With a border
// of three zeros, for windows of 7x7.
layout(binding = 5, std430) writeonly buffer Measurements {
  uvec2 measurements[];
};

#include "depth/measurement.glsl"
#include "depth/projections.glsl"
#include "depth/sources.glsl"
#define WORDS detail
#include "depth/three_words.glsl"

const int kRowsPerInvocation = 16;  // as kernels.cpp dispatches

int stride;
int image_words;
float reference;
float noise_variance;
vec2 sums;  // of weight * J * r and of weight * J^2
float support;
float num_visible;

struct Source {
  vec3 a, row, b;  // A p in the first row, its change from row to row, and b
  vec4 bounds;
};

Source LoadSource(int source, vec3 p) {
  const Projection projection = LoadProjection(source);
  return Source(projection.A * p, projection.A[1], projection.b, projection.bounds);
}

void AddSource(Source from, int source, float row, float w) {
  const vec3 b = from.b;
  const vec3 at = from.a + row * from.row + w * b;
  const float scale = 1.0 / at.z;
  const vec2 u = at.xy * scale;
  const bool visible = at.z > 0.0 && u.x >= from.bounds.x && u.y >= from.bounds.y &&
                       u.x < from.bounds.z && u.y < from.bounds.w;
  const vec2 corner = visible ? floor(u) : vec2(0);
  const vec2 share = u - corner;
  const int place = int(corner.y) * stride + int(corner.x);
  const bool is_before = source < kSourcesPerSide;
  const int index = (is_before ? source : source - kSourcesPerSide) * image_words + place;
  const uvec4 texel =
      is_before ? imageLoad(detail_before, index >> 2) : imageLoad(detail_after, index >> 2);
  const uint word = CutWord(texel, index);
  const float v00 = float(word & 0xffu), v10 = float((word >> 8) & 0xffu);
  const float v01 = float((word >> 16) & 0xffu), v11 = float(word >> 24);
  const float top = v00 + share.x * (v10 - v00);
  const float bottom = v01 + share.x * (v11 - v01);
  const float value = top + share.y * (bottom - top);
  const vec2 gradient = vec2((v10 - v00) + share.y * ((v11 - v01) - (v10 - v00)), bottom - top);
  const vec2 motion = (b.xy - b.z * u) * (scale * params.inverse_depth_step);  // px per plane
  const float jacobian = dot(gradient, motion);
  const float residual = value - reference;
  const float variance = 2.0 * noise_variance + jacobian * jacobian / 9.0;
  const float relative = variance / (variance + residual * residual);
  const float weight = visible ? relative * relative : 0.0;
  sums += visible ? weight * vec2(jacobian * residual, jacobian * jacobian) : vec2(0);
  support += weight;
  num_visible += visible ? 1.0 : 0.0;
}

void Measure(Source sources[kMaxSources], int x, int y, float row) {
  const int width = int(params.width_px);
  const bool inside = x >= 0 && x < width && y >= 0 && y < int(params.height_px);
  const int pixel = inside ? y * width + x : 0;
  // As words: a load of the float alone would be a gather, which nothing overtakes.
  const uvec4 depths = floatBitsToUint(imageLoad(inverse_depth, pixel >> 2));
  const bool shown = inside && ReferenceShows(vec2(x, y));
  const float w = shown ? uintBitsToFloat(CutWord(depths, pixel)) : 0.0;
  const int place = inside ? y * stride + x : 0;
  reference = float(CutWord(imageLoad(detail, place >> 2), place) & 0xffu);
  sums = vec2(0);
  support = 0.0;
  num_visible = 0.0;
  [[unroll]] for (int s = 0; s < kNumSources; ++s) AddSource(sources[s], s, row, w);
  const float step = clamp(-sums.x / (sums.y + 2.0 * noise_variance), -1.0, 1.0);
  measurements[(y + kMeasurementBorder) * MeasurementsPerRow(params.width_px) + x +
               kMeasurementBorder] =
      w > 0.0 && num_visible >= params.min_views
          ? PackMeasurement(w, step, sums.y / (2.0 * noise_variance) + 1.0,
                            support / max(num_visible, 1.0))
          : uvec2(0);
}

void main() {
  const int column = int(gl_GlobalInvocationID.x);
  const int first_row = kRowsPerInvocation * int(gl_GlobalInvocationID.y);
  const int num_columns = int(params.width_px) + 2 * kMeasurementBorder;
  const int num_rows = int(params.height_px) + 2 * kMeasurementBorder;
  if (column >= num_columns || first_row >= num_rows) return;
  stride = 4 * (int(params.width_px + 3u) / 4);
  image_words = stride * int(params.height_px);
  noise_variance = params.noise * params.noise;
  const int x = column - kMeasurementBorder;
  const int y = first_row - kMeasurementBorder;
  const vec3 p = vec3(x, y, 1);
  Source sources[kMaxSources];
  [[unroll]] for (int s = 0; s < kNumSources; ++s) sources[s] = LoadSource(s, p);
  const int rows_here = min(kRowsPerInvocation, num_rows - first_row);
  for (int row = 0;;) {
    Measure(sources, x, y + row, float(row));
    if (++row >= rows_here) break;  // at the end: see fine_sweep.comp
  }
}
