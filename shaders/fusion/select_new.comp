// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// Which pixels become a surfel: those around which the index map has none that is the same surface.
// One bit per pixel; the host counts them, so that surfels are inserted in the order of the pixels.
#include "fusion/view.glsl"

layout(binding = 0, r32f) uniform readonly imageBuffer depth;  // su, height x width
layout(binding = 1, rgba32f) uniform readonly imageBuffer candidate;  // per pixel
layout(binding = 2, r32ui) uniform readonly uimageBuffer index_map;  // per cell: number, depth
layout(binding = 3, rgba32f) uniform readonly imageBuffer normal_weight;  // per surfel
layout(binding = 4, std430) buffer Selected { uint selected[]; };  // 32 pixels a word; zero before

const uint kNoSurfel = 0xFFFFFFFFu;

bool SameSurface(uint surfel, float inverse_depth, float expected, float measured, vec3 n_cam) {
  const vec4 surfel_normal = imageLoad(normal_weight, int(surfel));
  const float sigma = JointSigma(measured, inverse_depth, surfel_normal.w);
  return abs(inverse_depth - expected) <= params.association_sigmas * sigma &&
         Dot(DirectionToCamera(surfel_normal.xyz), n_cam) >= params.min_normal_cosine;
}

bool Covered(ivec2 pixel, vec3 n_cam, float measured) {
  const int cells = int(kIndexCellsPerPixel);
  const ivec2 size = ivec2(int(params.width_px), int(params.height_px)) * cells;
  const vec3 ray = Ray(vec2(pixel));
  float best = 3.4e38;
  uint best_cell = kNoSurfel;
  float best_expected = 0.0, best_inverse_depth = 0.0;
  // Cells beyond those of the pixel that are searched on each side. One cell for a radius of a
  // pixel: a surfel within one pixel covers this one, so surfels stay no closer than the pixels of
  // the finest view need.
  const int margin = cells * int(params.merge_radius_px) - 1;
  for (int dv = -margin; dv < cells + margin; ++dv) {
    for (int du = -margin; du < cells + margin; ++du) {
      const ivec2 cell = pixel * cells + ivec2(du, dv);
      const ivec2 inside = clamp(cell, ivec2(0), size - 1);
      const uint depth_bits = imageLoad(index_map, 2 * (inside.y * size.x + inside.x) + 1).x;
      if (depth_bits == kNoSurfel || inside != cell) continue;
      precise float inverse_depth = 1.0 / uintBitsToFloat(depth_bits);
      // From the centre of the cell, in pixels.
      precise vec2 at = (vec2(cell) + 0.5) / float(cells) - 0.5;
      const float expected = TangentPlaneInverseDepth(n_cam, ray, measured, Ray(at));
      precise float difference = abs(inverse_depth - expected);
      if (difference < best) {
        best = difference, best_cell = uint(inside.y * size.x + inside.x);
        best_expected = expected, best_inverse_depth = inverse_depth;
      }
    }
  }
  if (best_cell == kNoSurfel) return false;
  const uint surfel = imageLoad(index_map, int(2u * best_cell)).x;
  return SameSurface(surfel, best_inverse_depth, best_expected, measured, n_cam);
}

void main() {
  const uint i = ItemIndex();
  if (i >= params.width_px * params.height_px) return;
  const vec4 normal = imageLoad(candidate, int(i));
  if (normal.w <= 0.0) return;
  const ivec2 pixel = ivec2(int(i % params.width_px), int(i / params.width_px));
  const float measured = 1.0 / imageLoad(depth, int(i)).x;
  if (!Covered(pixel, normal.xyz, measured)) atomicOr(selected[i >> 5], 1u << (i & 31u));
}
