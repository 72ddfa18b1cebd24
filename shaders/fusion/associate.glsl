// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Each surfel looks up the pixel onto which it falls and asks what that pixel says of it: seen
// there (the pixel confirms it), seen through (the surface is behind it), hidden (the surface is
// before it), or nothing (it is out of view, or the pixel has no estimate). The surfel asks, not the pixel: no surfel in view is
// left out, none is confirmed twice, and no two invocations write to one place.
#include "fusion/view.glsl"

layout(binding = 0, rgba32f) uniform readonly imageBuffer position_radius;  // per surfel
layout(binding = 1, rgba32f) uniform readonly imageBuffer normal_weight;  // per surfel
layout(binding = 2, r32f) uniform readonly imageBuffer depth;  // su, height x width
layout(binding = 3, rgba32f) uniform readonly imageBuffer candidate;  // per pixel
layout(binding = 4, r32ui) uniform readonly uimageBuffer blocks;  // to work on
layout(binding = 5, r32ui) uniform readonly uimageBuffer anchor_of_block;
layout(binding = 6, rgba32f) uniform readonly imageBuffer anchors;  // two per anchor, see UseAnchor

float DepthAt(ivec2 pixel) { return imageLoad(depth, pixel.y * int(params.width_px) + pixel.x).x; }

// A surfel is seen through, or hidden, only where all nine pixels around say so: the outlines of
// things are uncertain by a pixel, and what lies behind them is no evidence. As sure as the least
// sure of the nine. A surfel that faces away is no surprise where it is hidden.
uint EvidenceAgainst(ivec2 pixel, float inverse_depth, float weight, bool faces_away) {
  const ivec2 last = ivec2(int(params.width_px), int(params.height_px)) - 1;
  if (any(lessThan(pixel, ivec2(1))) || any(greaterThanEqual(pixel, last))) return kUnseen;
  bool seen_through = true;
  bool hidden = !faces_away;
  float confidence = 1.0;
  // A device that runs branches for lanes which do not take them leaves a loop that none takes.
  [[dont_unroll]] for (int k = 0; k < 9; ++k) {
    const ivec2 at = pixel + ivec2(k % 3, k / 3) - 1;
    const float z = DepthAt(at);
    if (z <= 0.0) return kUnseen;
    const float measured = 1.0 / z;
    const float limit = params.free_space_sigmas * JointSigma(measured, inverse_depth, weight);
    precise float in_front = inverse_depth - measured;
    seen_through = seen_through && in_front > limit;
    hidden = hidden && -in_front > limit;
    if (!seen_through && !hidden) return kUnseen;
    confidence = min(confidence, imageLoad(candidate, at.y * int(params.width_px) + at.x).w);
  }
  precise float steps = confidence * 255.0;
  return (seen_through ? kSeenThrough : kHidden) | uint(steps + 0.5);
}

// Where the surfel is in the camera's frame, and which way it looks; p_cam is (0, 0, 0) where it was
// removed.
struct Placed {
  vec3 p_cam;
  vec3 n_cam;
};

uint Associate(uint i, uint block, out Placed placed) {
  placed.p_cam = placed.n_cam = vec3(0.0);
  const vec4 surfel_normal = imageLoad(normal_weight, int(i));
  if (surfel_normal.w <= 0.0) return kUnseen;
  const int anchor = int(imageLoad(anchor_of_block, int(block)).x);
  UseAnchor(imageLoad(anchors, 2 * anchor), imageLoad(anchors, 2 * anchor + 1));
  const float weight = WeightToCamera(surfel_normal.w);
  const vec3 p_cam = PointToCamera(imageLoad(position_radius, int(i)).xyz);
  const vec3 n_cam = DirectionToCamera(surfel_normal.xyz);
  placed.p_cam = p_cam;
  placed.n_cam = n_cam;
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
  const float sigma = JointSigma(measured, inverse_depth, weight);
  precise float difference = inverse_depth - expected;
  if (abs(difference) <= params.association_sigmas * sigma) {
    return Dot(n_cam, measured_normal.xyz) >= params.min_normal_cosine ? uint(pixel_index)
                                                                       : kUnseen;
  }
  return EvidenceAgainst(pixel, inverse_depth, weight, Dot(n_cam, p_cam) >= 0.0);
}
