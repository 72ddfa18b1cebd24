// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Parts of the model that have moved over each other, seen from one view: for each surfel the older
// one, of another part, that is the same surface in the same place; or none. Marks the blocks of
// both.
#include "fusion/overlap.glsl"

layout(binding = 0, rgba32f) uniform readonly imageBuffer position_radius;  // per surfel
layout(binding = 1, rgba32f) uniform readonly imageBuffer normal_weight;    // per surfel
layout(binding = 2, rgba32ui) uniform readonly uimageBuffer history;        // per surfel
layout(binding = 3, r32ui) uniform readonly uimageBuffer index_map;  // per cell: place in the list, depth
layout(binding = 4, r32ui) uniform readonly uimageBuffer candidates;  // surfels to work on
// Per anchor the end of the surfels of other parts that are older, in the list.
layout(binding = 5, r32ui) uniform readonly uimageBuffer end_of_older;
layout(binding = 6, r32ui) uniform readonly uimageBuffer num_candidates;  // one
layout(binding = 7, rgba32f) uniform readonly imageBuffer anchors;  // two per anchor, see UseAnchor
layout(binding = 8, r32ui) uniform readonly uimageBuffer blocks;  // drawn in index_map
layout(binding = 9, std430) writeonly buffer Target { uint target[]; };  // kNoSurfel before
layout(binding = 10, std430) writeonly buffer Marked { uint is_marked[]; };  // per block; 0 before

// Footprints of pixels lie apart by this share of a surfel's radius.
const float kFootprintPerRadius = 0.7071;

// A surfel as the view sees it.
struct Seen {
  vec3 p_cam;
  float radius;
  vec3 n_cam;
  vec3 ray;
  float inverse_depth;
  float sigma;
};

// Of the older surfels around that lie about as deep, the cell of the one nearest in the image.
uint NearestCell(uint end, vec3 p_cam, Seen seen) {
  const int cells = int(kIndexCellsPerPixel);
  const ivec2 size = NumCells();
  const vec2 place = PlaceInCells(p_cam);
  const ivec2 own = ivec2(floor(place));
  // Of the inverse depth of the surfel's plane, per cell.
  const float along_ray = Dot(seen.n_cam, seen.ray);
  vec2 slope = seen.n_cam.xy / vec2(params.fx, params.fy) / float(cells);
  slope *= along_ray > -1e-3 ? 0.0 : seen.inverse_depth / along_ray;
  // That of the other surfel, older and thus surer, may be as large.
  const float reach = 2.0 * params.association_sigmas * seen.sigma;
  uint best = kNoSurfel;
  float nearest = 3.4e38;
  for (int dv = -kSearchCells; dv <= kSearchCells; ++dv) {
    [[unroll]] for (int du = -kSearchCells; du <= kSearchCells; ++du) {
      const ivec2 cell = own + ivec2(du, dv);
      const ivec2 inside = clamp(cell, ivec2(0), size - 1);
      const int at = inside.y * size.x + inside.x;
      const uint other = imageLoad(index_map, 2 * at).x;
      const float depth = uintBitsToFloat(imageLoad(index_map, 2 * at + 1).x);
      const vec2 offset = vec2(cell) + 0.5 - place;
      const float difference = abs(1.0 / depth - seen.inverse_depth - dot(slope, offset));
      const float distance = dot(offset, offset);
      const bool is_best =
          other < end && inside == cell && difference <= reach && distance < nearest;
      best = is_best ? uint(at) : best;
      nearest = is_best ? distance : nearest;
    }
  }
  return best;
}

int UseAnchorOf(uint surfel) {
  const int anchor = int(Low16(imageLoad(history, int(surfel)).w));
  UseAnchor(imageLoad(anchors, 2 * anchor), imageLoad(anchors, 2 * anchor + 1));
  return anchor;
}

bool IsSamePlace(Seen seen, vec3 other_p_cam, float other_radius) {
  const vec3 offset = other_p_cam - seen.p_cam;
  const vec3 along_surface = offset - Dot(offset, seen.n_cam) * seen.n_cam;
  return length(along_surface) <= kFootprintPerRadius * min(seen.radius, other_radius);
}

// The surfel in a cell.
uint SurfelIn(uint cell) {
  const uint listed = imageLoad(index_map, int(2u * cell)).x;
  const uint block = imageLoad(blocks, int(listed / kSurfelsPerBlock)).x;
  return block * kSurfelsPerBlock + listed % kSurfelsPerBlock;
}

bool IsSameSurface(Seen seen, uint cell) {
  const uint j = SurfelIn(cell);
  const float inverse_depth = 1.0 / uintBitsToFloat(imageLoad(index_map, int(2u * cell + 1u)).x);
  const vec4 other_normal = imageLoad(normal_weight, int(j));
  const vec4 other_position = imageLoad(position_radius, int(j));
  UseAnchorOf(j);
  const uint width = params.width_px * kIndexCellsPerPixel;
  const vec2 pixel =
      (vec2(float(cell % width), float(cell / width)) + 0.5) / float(kIndexCellsPerPixel) - 0.5;
  const float expected =
      TangentPlaneInverseDepth(seen.n_cam, seen.ray, seen.inverse_depth, Ray(pixel));
  const float sigma =
      length(vec2(seen.sigma, SurfelSigma(inverse_depth, WeightToCamera(other_normal.w))));
  return Dot(DirectionToCamera(other_normal.xyz), seen.n_cam) >= params.min_normal_cosine &&
         abs(inverse_depth - expected) <= params.association_sigmas * sigma &&
         IsSamePlace(seen, PointToCamera(other_position.xyz), other_position.w * scale);
}

uint FindTarget(uint i) {
  const vec4 surfel_normal = imageLoad(normal_weight, int(i));
  if (surfel_normal.w <= 0.0) return kNoSurfel;
  const int anchor = UseAnchorOf(i);
  const vec4 position = imageLoad(position_radius, int(i));
  const vec3 p_cam = PointToCamera(position.xyz);
  const vec3 n_cam = DirectionToCamera(surfel_normal.xyz);
  if (p_cam.z <= 0.0 || Dot(n_cam, p_cam) >= 0.0) return kNoSurfel;
  const float inverse_depth = 1.0 / p_cam.z;
  const Seen seen = Seen(p_cam, position.w * scale, n_cam, p_cam * inverse_depth, inverse_depth,
                         SurfelSigma(inverse_depth, WeightToCamera(surfel_normal.w)));
  const uint cell = NearestCell(imageLoad(end_of_older, anchor).x, p_cam, seen);
  if (cell == kNoSurfel || !IsSameSurface(seen, cell)) return kNoSurfel;
  return SurfelIn(cell);
}

void main() {
  if (ItemIndex() >= imageLoad(num_candidates, 0).x) return;
  const uint i = imageLoad(candidates, int(ItemIndex())).x;
  const uint found = FindTarget(i);
  if (found == kNoSurfel) return;
  target[i] = found;
  is_marked[i / kSurfelsPerBlock] = 1u;
  is_marked[found / kSurfelsPerBlock] = 1u;
}
