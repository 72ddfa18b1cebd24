// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// One Gauss-Newton step of each pixel's inverse depth on the grey values of all four sources, which
// sees fractions of a pixel that census transforms do not: the residual r of source i is the
// difference of detail (detail.comp) between where the source sees the point and the reference, and
// J = dr/dw. A residual that noise and a third of a pixel of motion do not explain counts less
// (Geman and McClure 1987), which takes occluded sources out. The step is damped as if the depth
// were known to one plane: without texture it stays where it is.
#version 450
#extension GL_GOOGLE_include_directive : require

#include "depth/photometric.params.h"

layout(local_size_x = 64) in;

layout(binding = 0, r32ui) uniform readonly uimageBuffer detail;       // of five images
layout(binding = 1, r32f) uniform readonly imageBuffer projections;    // as in plane_cost.glsl
layout(binding = 2, r32f) uniform readonly imageBuffer inverse_depth;  // 1/su; 0: no estimate
// Inverse depth before and after the step; its information, 1 / (standard deviation in planes)^2;
// and the mean weight of the sources, 0 to 1.
layout(binding = 3, std430) writeonly buffer Measurements {
  vec4 measurements[];
};

#include "depth/projections.glsl"

int stride;
int image_words;
float reference;
float noise_variance;
vec2 sums;  // of weight * J * r and of weight * J^2
float support;
float num_visible;

void AddSource(int source, vec3 p, float w) {
  const vec3 b = LoadB(source);
  const vec3 at = LoadAp(source, p) + w * b;
  const float scale = 1.0 / at.z;
  const vec2 u = at.xy * scale;
  const bool visible = at.z > 0.0 && u.x >= 0.0 && u.y >= 0.0 &&
                       u.x < float(params.width_px - 1u) && u.y < float(params.height_px - 1u);
  const vec2 corner = visible ? floor(u) : vec2(0);
  const vec2 share = u - corner;
  const uint word =
      imageLoad(detail, (source + 1) * image_words + int(corner.y) * stride + int(corner.x)).x;
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

void main() {
  const int x = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  if (x >= int(params.width_px) || y >= int(params.height_px)) return;
  stride = 4 * (int(params.width_px + 3u) / 4);
  image_words = stride * int(params.height_px);
  const int pixel = y * int(params.width_px) + x;
  const float w = imageLoad(inverse_depth, pixel).x;
  reference = float(imageLoad(detail, y * stride + x).x & 0xffu);
  noise_variance = params.noise * params.noise;
  sums = vec2(0);
  support = 0.0;
  num_visible = 0.0;
  const vec3 p = vec3(x, y, 1);
  AddSource(0, p, w);
  AddSource(1, p, w);
  AddSource(2, p, w);
  AddSource(3, p, w);
  const float step = clamp(-sums.x / (sums.y + 2.0 * noise_variance), -1.0, 1.0);
  measurements[pixel] =
      w > 0.0 ? vec4(w, w + step * params.inverse_depth_step, sums.y / (2.0 * noise_variance) + 1.0,
                     support / max(num_visible, 1.0))
              : vec4(0);
}
