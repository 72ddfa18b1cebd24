// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// Each surfel looks up the pixel onto which it falls and asks what that pixel says of it: seen
// there (the pixel confirms it), seen through (the surface is behind it), or nothing (it is out of
// view, hidden, or the pixel has no estimate). The surfel asks, not the pixel: no surfel in view is
// left out, none is confirmed twice, and no two invocations write to one place.
#include "fusion/view.glsl"

layout(binding = 0, rgba32f) uniform readonly imageBuffer position_radius;  // per surfel
layout(binding = 1, rgba32f) uniform readonly imageBuffer normal_weight;  // per surfel
layout(binding = 2, r32f) uniform readonly imageBuffer depth;  // su, height x width
layout(binding = 3, rgba32f) uniform readonly imageBuffer candidate;  // per pixel
layout(binding = 4, std430) writeonly buffer Association { uint association[]; };  // per surfel

float DepthAt(ivec2 pixel) { return imageLoad(depth, pixel.y * int(params.width_px) + pixel.x).x; }

// A surfel is seen through only where all nine pixels around see past it: the outlines of things
// are uncertain by a pixel, and what lies behind them is no evidence.
bool SeenThrough(ivec2 pixel, float inverse_depth, float weight) {
  const ivec2 last = ivec2(int(params.width_px), int(params.height_px)) - 1;
  if (any(lessThan(pixel, ivec2(1))) || any(greaterThanEqual(pixel, last))) return false;
  for (int dv = -1; dv <= 1; ++dv) {
    for (int du = -1; du <= 1; ++du) {
      const float z = DepthAt(pixel + ivec2(du, dv));
      if (z <= 0.0) return false;
      const float measured = 1.0 / z;
      const float sigma = JointSigma(measured, inverse_depth, weight);
      if (inverse_depth - measured <= params.free_space_sigmas * sigma) return false;
    }
  }
  return true;
}

uint Associate(uint i) {
  const vec4 surfel_normal = imageLoad(normal_weight, int(i));
  if (surfel_normal.w <= 0.0) return kUnseen;
  const vec3 p_cam = PointToCamera(imageLoad(position_radius, int(i)).xyz);
  if (p_cam.z <= 0.0) return kUnseen;
  precise vec2 rounded = floor(Project(p_cam) + 0.5);
  if (any(lessThan(rounded, vec2(0.0))) || rounded.x >= float(params.width_px) ||
      rounded.y >= float(params.height_px)) {
    return kUnseen;
  }
  const ivec2 pixel = ivec2(rounded);
  const int pixel_index = pixel.y * int(params.width_px) + pixel.x;
  const vec4 measured_normal = imageLoad(candidate, pixel_index);
  if (measured_normal.w <= 0.0) return kUnseen;

  const float measured = 1.0 / DepthAt(pixel);
  precise float inverse_depth = 1.0 / p_cam.z;
  precise vec3 ray = vec3(p_cam.x / p_cam.z, p_cam.y / p_cam.z, 1.0);
  const float expected =
      TangentPlaneInverseDepth(measured_normal.xyz, Ray(rounded), measured, ray);
  const float sigma = JointSigma(measured, inverse_depth, surfel_normal.w);
  precise float difference = inverse_depth - expected;
  if (abs(difference) <= params.association_sigmas * sigma) {
    const float cosine = Dot(DirectionToCamera(surfel_normal.xyz), measured_normal.xyz);
    return cosine >= params.min_normal_cosine ? uint(pixel_index) : kUnseen;
  }
  return SeenThrough(pixel, inverse_depth, surfel_normal.w) ? kSeenThrough : kUnseen;
}

void main() {
  const uint i = ItemIndex();
  if (i < params.num_surfels) association[i] = Associate(i);
}
