// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Depth of the surface through each pixel, and how sure it is: on a plane n.X = 1 inverse depth is
// affine in the pixel, w = (K^-T n).(x, y, 1). The affine function is fitted to the measurements of the 7x7
// window (photometric.comp) by least squares, weighted by their information and distance, over the
// pixels that belong to the surface of the middle one: those whose inverse depth is near, the nearer
// the smaller the distance. Confidence is sqrt(a) / (1 + s): a is the share of the window's pixels and sources that
// agree; s is the standard deviation of the depth in per cent, that of the measurements and of the
// surface around its plane plus what a pixel of place makes on the slope of the 5x5 window, which at
// steps is large.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/surface.params.h"

layout(local_size_x = 64) in;

layout(binding = 0, rgba32f) uniform readonly imageBuffer measurements;  // photometric.comp
layout(binding = 1, std430) writeonly buffer InverseDepth {              // 1/su; 0: no estimate
  float inverse_depth[];
};
layout(binding = 2, std430) writeonly buffer Confidence {  // 0 to 1
  float confidence[];
};

const int kRadius = 3;
// exp(-d^2 / (2 * 1.5^2)): half of the weight lies within 1.8 px.
const float kFalloff[4] = float[](1.0, 0.8007, 0.4111, 0.1353);
const float kWholeWindow = 13.6686;  // sum over the window
const float kHalfConfidence = 0.01;  // standard deviation over depth

void main() {
  const int x = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  const int width = int(params.width_px);
  const int height = int(params.height_px);
  if (x >= width || y >= height) return;
  const int pixel = y * width + x;
  const vec4 middle = imageLoad(measurements, pixel);
  const float per_plane = 1.0 / params.inverse_depth_step;

  // Sums of the normal equations for v = g0 + gx dx + gy dy, in planes from the middle one.
  float n = 0.0, sx = 0.0, sy = 0.0, sxx = 0.0, sxy = 0.0, syy = 0.0;
  float sv = 0.0, sxv = 0.0, syv = 0.0, svv = 0.0, support = 0.0;
  float nearest = 0.0, farthest = 3.4e38;
  for (int dy = -kRadius; dy <= kRadius; ++dy) {
    const int row = y + dy;
    const float fdy = float(dy);
    const float falloff_y = kFalloff[abs(dy)];
    [[unroll]] for (int dx = -kRadius; dx <= kRadius; ++dx) {
      const int column = x + dx;
      const bool inside = row >= 0 && row < height && column >= 0 && column < width;
      const vec4 m = imageLoad(measurements, inside ? row * width + column : pixel);
      const float reach = float(max(max(abs(dx), abs(dy)), 1));
      const bool member =
          inside && m.x > 0.0 && abs(m.x - middle.x) * per_plane <= reach;
      const float falloff = member ? falloff_y * kFalloff[abs(dx)] : 0.0;
      const bool near = inside && max(abs(dx), abs(dy)) <= 2;
      nearest = near ? max(nearest, m.x) : nearest;
      farthest = near && m.x > 0.0 ? min(farthest, m.x) : farthest;
      const float u = falloff * m.z;
      const float v = (m.y - middle.x) * per_plane;
      const float fdx = float(dx);
      support += falloff * m.w;
      n += u;
      sx += u * fdx;
      sy += u * fdy;
      sxx += u * fdx * fdx;
      sxy += u * fdx * fdy;
      syy += u * fdy * fdy;
      sv += u * v;
      sxv += u * v * fdx;
      syv += u * v * fdy;
      svv += u * v * v;
    }
  }
  // Gradient by Cramer's rule on the centred moments.
  const float cxx = n * sxx - sx * sx;
  const float cxy = n * sxy - sx * sy;
  const float cyy = n * syy - sy * sy;
  const float cxv = n * sxv - sx * sv;
  const float cyv = n * syv - sy * sv;
  const float determinant = cxx * cyy - cxy * cxy;
  float w = middle.x;
  float sure = 0.0;
  if (w > 0.0 && determinant > 1e-3 * cxx * cyy && cxx > 0.0 && cyy > 0.0) {
    const float gx = (cxv * cyy - cyv * cxy) / determinant;
    const float gy = (cyv * cxx - cxv * cxy) / determinant;
    const float g0 = (sv - gx * sx - gy * sy) / n;
    w = max(middle.x + params.inverse_depth_step * clamp(g0, -1.0, 1.0), 0.5 * middle.x);
    const float misfit = max(svv - g0 * sv - gx * sxv - gy * syv, 0.0);
    const float slope = (nearest - farthest) / 4.0;
    const float deviation = sqrt((1.0 + misfit) / n) * params.inverse_depth_step + slope;
    sure = sqrt(support / kWholeWindow) / (1.0 + deviation / (kHalfConfidence * w));
  }
  inverse_depth[pixel] = w;
  // An isolated pixel keeps its depth, with the least confidence there is.
  confidence[pixel] = w > 0.0 ? clamp(sure, 1e-3, 1.0) : 0.0;
}
