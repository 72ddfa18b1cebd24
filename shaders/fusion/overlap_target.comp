// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require

// Parts of the model that have moved over each other, seen from one view: for each surfel the older
// one, of another part, that is the same surface in the same place; or none.
#include "fusion/overlap.glsl"

layout(binding = 0, rgba32f) uniform readonly imageBuffer position_radius;  // per surfel
layout(binding = 1, rgba32f) uniform readonly imageBuffer normal_weight;    // per surfel
layout(binding = 2, rgba32ui) uniform readonly uimageBuffer history;        // per surfel
layout(binding = 3, r32ui) uniform readonly uimageBuffer index_map;  // per cell: number, depth
layout(binding = 4, std430) writeonly buffer Target { uint target[]; };  // per surfel

// Footprints of pixels lie apart by this share of a surfel's radius.
const float kFootprintPerRadius = 0.7071;

bool IsSamePlace(uint i, uint j, vec3 normal) {
  const vec4 a = imageLoad(position_radius, int(i)), b = imageLoad(position_radius, int(j));
  const vec3 offset = b.xyz - a.xyz;
  const vec3 along_surface = offset - Dot(offset, normal) * normal;
  return length(along_surface) <= kFootprintPerRadius * min(a.w, b.w);
}

uint FindTarget(uint i) {
  const vec4 surfel_normal = imageLoad(normal_weight, int(i));
  if (surfel_normal.w <= 0.0) return kNoSurfel;
  const vec3 p_cam = PointToCamera(imageLoad(position_radius, int(i)).xyz);
  const vec3 n_cam = DirectionToCamera(surfel_normal.xyz);
  if (p_cam.z <= 0.0 || Dot(n_cam, p_cam) >= 0.0) return kNoSurfel;
  const int cells = int(kIndexCellsPerPixel);
  const ivec2 size = ivec2(int(params.width_px), int(params.height_px)) * cells;
  const ivec2 own = ivec2(floor((Project(p_cam) + 0.5) * float(cells)));
  const uint anchor = imageLoad(history, int(i)).w & 0xFFFFu;
  const float inverse_depth = 1.0 / p_cam.z;
  const vec3 ray = p_cam * inverse_depth;
  uint best = kNoSurfel;
  float smallest = 3.4e38;
  for (int dv = -cells; dv <= cells; ++dv) {
    for (int du = -cells; du <= cells; ++du) {
      const ivec2 cell = own + ivec2(du, dv);
      if (any(lessThan(cell, ivec2(0))) || any(greaterThanEqual(cell, size))) continue;
      const int at = 2 * (cell.y * size.x + cell.x);
      const uint j = imageLoad(index_map, at).x;
      if (j >= i) continue;  // itself, younger, or none
      const uint other = imageLoad(history, int(j)).w & 0xFFFFu;
      if (max(anchor, other) - min(anchor, other) <= kMaxAnchorGap) continue;
      const vec4 other_normal = imageLoad(normal_weight, int(j));
      if (Dot(other_normal.xyz, surfel_normal.xyz) < params.min_normal_cosine) continue;
      const float other_inverse_depth = 1.0 / uintBitsToFloat(imageLoad(index_map, at + 1).x);
      const vec2 pixel = (vec2(cell) + 0.5) / float(cells) - 0.5;
      const float expected = TangentPlaneInverseDepth(n_cam, ray, inverse_depth, Ray(pixel));
      const float difference = abs(other_inverse_depth - expected);
      const float sigma = length(vec2(SurfelSigma(inverse_depth, surfel_normal.w),
                                      SurfelSigma(other_inverse_depth, other_normal.w)));
      if (difference > params.association_sigmas * sigma || difference >= smallest) continue;
      if (!IsSamePlace(i, j, surfel_normal.xyz)) continue;
      smallest = difference;
      best = j;
    }
  }
  return best;
}

void main() {
  const uint i = ItemIndex();
  if (i < params.num_surfels) target[i] = FindTarget(i);
}
