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
layout(binding = 4, r32ui) uniform readonly uimageBuffer anchor_of_block;
layout(binding = 5, rgba32f) uniform readonly imageBuffer anchors;  // two per anchor, see UseAnchor
layout(binding = 6, std430) buffer Selected { uint selected[]; };  // 32 pixels a word; zero before

const uint kNoSurfel = 0xFFFFFFFFu;

bool SameSurface(uint surfel, float inverse_depth, float expected, float measured, vec3 n_cam) {
  const vec4 surfel_normal = imageLoad(normal_weight, int(surfel));
  const int anchor = int(imageLoad(anchor_of_block, int(surfel / kSurfelsPerBlock)).x);
  UseAnchor(imageLoad(anchors, 2 * anchor), imageLoad(anchors, 2 * anchor + 1));
  const float sigma = JointSigma(measured, inverse_depth, WeightToCamera(surfel_normal.w));
  return abs(inverse_depth - expected) <= params.association_sigmas * sigma &&
         Dot(DirectionToCamera(surfel_normal.xyz), n_cam) >= params.min_normal_cosine;
}

// One coordinate of the ray through the centre of a cell.
float CellRay(int cell, float centre, float focal) {
  precise float at = (float(cell) + 0.5) / float(kIndexCellsPerPixel) - 0.5;
  precise float coordinate = (at - centre) / focal;
  return coordinate;
}

bool Covered(ivec2 pixel, vec3 n_cam, float measured) {
  const int cells = int(kIndexCellsPerPixel);
  const ivec2 size = ivec2(int(params.width_px), int(params.height_px)) * cells;
  // TangentPlaneInverseDepth, of which most is the same for all cells of a row.
  precise float at_measurement = Dot(n_cam, Ray(vec2(pixel)));
  float best = 3.4e38;
  uint best_cell = kNoSurfel;
  float best_expected = 0.0, best_inverse_depth = 0.0;
  // Cells beyond those of the pixel that are searched on each side. One cell for a radius of a
  // pixel: a surfel within one pixel covers this one, so surfels stay no closer than the pixels of
  // the finest view need.
  const int margin = cells * int(params.merge_radius_px) - 1;
  const ivec2 first = max(pixel * cells - margin, ivec2(0));
  const ivec2 last = min(pixel * cells + cells + margin, size) - 1;
  for (int v = first.y; v <= last.y; ++v) {
    const float y = CellRay(v, params.cy, params.fy);
    precise float along_y = n_cam.y * y;
    for (int u = first.x; u <= last.x; ++u) {
      const uint depth_bits = imageLoad(index_map, 2 * (v * size.x + u) + 1).x;
      precise float inverse_depth = 1.0 / uintBitsToFloat(depth_bits);
      precise float along_ray = n_cam.x * CellRay(u, params.cx, params.fx) + along_y + n_cam.z;
      precise float on_plane = measured * (along_ray / at_measurement);
      const float expected =
          at_measurement > -1e-3 || along_ray > -1e-3 ? measured : on_plane;
      precise float difference = abs(inverse_depth - expected);
      const bool is_better = depth_bits != kNoSurfel && difference < best;
      best = is_better ? difference : best;
      best_cell = is_better ? uint(v * size.x + u) : best_cell;
      best_expected = is_better ? expected : best_expected;
      best_inverse_depth = is_better ? inverse_depth : best_inverse_depth;
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
