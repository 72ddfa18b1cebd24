// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Candidates are the normal and the confidence of a pixel. Those without a normal (0, 0, 0) get one
// here: a plane is fitted to the inverse depths around, which are affine in the pixel on a plane
// (1/z = a + b u + c v gives n ~ (fx b, fy c, ray of the pixel times the rest)). The window leaves
// out whatever lies across a depth step.
#include "fusion/view.glsl"

layout(binding = 0, r32f) uniform readonly imageBuffer depth;  // su, height x width
layout(binding = 1, rgba32f) uniform readonly imageBuffer given;  // candidates, as below
layout(binding = 2, r32ui) uniform readonly uimageBuffer blocks;  // of pixels, to work on
// Per pixel: unit normal in the camera's frame, confidence; all 0: none.
layout(binding = 3, std430) writeonly buffer Candidate { vec4 candidate[]; };

// 7x7 brings the normal of a map with half a pixel of matching noise to some 15 degrees.
const int kNormalRadiusPx = 3;
const float kMinSamples = 6.0;  // twice what a plane has unknowns

// Largest difference of inverse depth that still is one surface, without its slope.
const float kStepSigmas = 3.0;

vec3 FittedNormal(ivec2 pixel, float inverse_depth, vec3 ray) {
  const float noise = kStepSigmas * kSqrt2 * InverseDepthSigma(inverse_depth);
  const float slope = params.max_slope_per_px * inverse_depth;
  const ivec2 last = ivec2(int(params.width_px), int(params.height_px)) - 1;
  float n = 0.0, su = 0.0, sv = 0.0, suu = 0.0, suv = 0.0, svv = 0.0;
  float sw = 0.0, suw = 0.0, svw = 0.0;
  // A device that runs branches for lanes which do not take them leaves a loop that none takes.
  [[dont_unroll]] for (int dv = -kNormalRadiusPx; dv <= kNormalRadiusPx; ++dv) {
    [[dont_unroll]] for (int du = -kNormalRadiusPx; du <= kNormalRadiusPx; ++du) {
      const ivec2 at = pixel + ivec2(du, dv);
      const ivec2 inside = clamp(at, ivec2(0), last);
      const float z = imageLoad(depth, inside.y * int(params.width_px) + inside.x).x;
      const float w = 1.0 / z - inverse_depth;
      const float reach = noise + slope * float(abs(du) + abs(dv));
      const bool use = inside == at && z > 0.0 && abs(w) <= reach;
      const float one = use ? 1.0 : 0.0;
      const float relative = use ? w / inverse_depth : 0.0;
      const float u = float(du), v = float(dv);
      n += one, su += one * u, sv += one * v;
      suu += one * u * u, suv += one * u * v, svv += one * v * v;
      sw += relative, suw += relative * u, svw += relative * v;
    }
  }
  // Least squares of relative = a + b u + c v, about the means.
  const float inverse_n = 1.0 / max(n, 1.0);
  const float cuu = suu - su * su * inverse_n, cuv = suv - su * sv * inverse_n;
  const float cvv = svv - sv * sv * inverse_n;
  const float cuw = suw - su * sw * inverse_n, cvw = svw - sv * sw * inverse_n;
  const float determinant = cuu * cvv - cuv * cuv;
  // All samples on one line: no plane. Sums are of whole pixels, so 0 would be exact but for
  // rounding.
  if (n < kMinSamples || determinant < 0.5) return -ray;
  const float b = (cuw * cvv - cvw * cuv) / determinant;
  const float c = (cvw * cuu - cuw * cuv) / determinant;
  const float a = (sw - b * su - c * sv) * inverse_n;
  // n.K^-1 (u0 + du, v0 + dv, 1) ~ 1 + a + b du + c dv, looking away from the camera.
  const vec2 xy = vec2(params.fx * b, params.fy * c);
  const vec3 away = vec3(xy, 1.0 + a - dot(xy, ray.xy));
  return -away;
}

void main() {
  const uint i = PixelOfBlock(imageLoad(blocks, int(WorkGroupIndex())).x);
  if (i >= params.width_px * params.height_px) return;
  const vec4 normal_confidence = imageLoad(given, int(i));
  if (normal_confidence.w <= 0.0 || normal_confidence.xyz != vec3(0.0)) return;
  const float z = imageLoad(depth, int(i)).x;
  const ivec2 pixel = ivec2(PixelOf(i));
  const vec3 normal = FittedNormal(pixel, 1.0 / z, Ray(vec2(pixel)));
  candidate[i] = vec4(normalize(normal), normal_confidence.w);
}
