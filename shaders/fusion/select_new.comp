// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require
#extension GL_KHR_shader_subgroup_arithmetic : require
#extension GL_KHR_shader_subgroup_ballot : require

// Which pixels become a surfel: those around which the index map has none that is the same surface.
// One bit per pixel; the host counts them, so that surfels are inserted in the order of the pixels.
#include "fusion/view.glsl"

layout(binding = 0, r32f) uniform readonly imageBuffer depth;  // su, height x width
layout(binding = 1, rgba32f) uniform readonly imageBuffer candidate;  // per pixel
layout(binding = 2, r32ui) uniform readonly uimageBuffer index_map;  // per cell: place in the list, depth
layout(binding = 3, rgba32f) uniform readonly imageBuffer normal_weight;  // per surfel
layout(binding = 4, r32ui) uniform readonly uimageBuffer anchor_of_block;
layout(binding = 5, rgba32f) uniform readonly imageBuffer anchors;  // two per anchor, see UseAnchor
layout(binding = 6, r32ui) uniform readonly uimageBuffer blocks;  // of pixels, to work on
layout(binding = 7, r32ui) uniform readonly uimageBuffer surfel_blocks;  // drawn in index_map
layout(binding = 8, std430) buffer Selected { uint selected[]; };  // 32 pixels a word; zero before

const uint kNoSurfel = 0xFFFFFFFFu;

bool SameSurface(uint surfel, float inverse_depth, float difference, float measured, vec3 n_cam) {
  const vec4 surfel_normal = imageLoad(normal_weight, int(surfel));
  const int anchor = int(imageLoad(anchor_of_block, int(surfel / kSurfelsPerBlock)).x);
  UseAnchor(imageLoad(anchors, 2 * anchor), imageLoad(anchors, 2 * anchor + 1));
  const float sigma = JointSigma(measured, inverse_depth, WeightToCamera(surfel_normal.w));
  return difference <= params.association_sigmas * sigma &&
         Dot(DirectionToCamera(surfel_normal.xyz), n_cam) >= params.min_normal_cosine;
}

// One coordinate of the ray through the centre of a cell.
float CellRay(int cell, float centre, float focal) {
  precise float at = (float(cell) + 0.5) / float(kIndexCellsPerPixel) - 0.5;
  precise float coordinate = (at - centre) / focal;
  return coordinate;
}

// What is looked for around a pixel, and the cell that comes nearest to it.
struct Search {
  vec3 n_cam;
  float measured;        // inverse depth
  float at_measurement;  // TangentPlaneInverseDepth, of which this is the same for all cells
  float difference;      // of inverse depth, the least so far
  float inverse_depth;   // there
  uint cell;
};

// `along_ray`: normal times ray of the cell. The row's `first_cell` is in the index map, as is
// column u where `is_inside`.
void LookAt(inout Search search, int first_cell, int u, bool is_inside, float along_ray) {
  const int cell = first_cell + u;
  const uint depth_bits = imageLoad(index_map, 2 * cell + 1).x;
  precise float inverse_depth = 1.0 / uintBitsToFloat(depth_bits);
  precise float on_plane = search.measured * (along_ray / search.at_measurement);
  const float expected =
      search.at_measurement > -1e-3 || along_ray > -1e-3 ? search.measured : on_plane;
  precise float difference = abs(inverse_depth - expected);
  const bool is_better =
      is_inside && depth_bits != kNoSurfel && difference < search.difference;
  search.difference = is_better ? difference : search.difference;
  search.inverse_depth = is_better ? inverse_depth : search.inverse_depth;
  search.cell = is_better ? uint(cell) : search.cell;
}

float Along(float n, int cell, float centre, float focal) {
  precise float along = n * CellRay(cell, centre, focal);
  return along;
}

// The four by four cells from `first` on, in order, without a loop: a CPU device spends more on the
// steps of one than on what is done in them.
void LookAround(inout Search search, ivec2 first, ivec2 size) {
  float along_x[4];
  [[unroll]] for (int k = 0; k < 4; ++k) {
    along_x[k] = Along(search.n_cam.x, first.x + k, params.cx, params.fx);
  }
  [[unroll]] for (int row = 0; row < 4; ++row) {
    const int v = first.y + row;
    const bool has_row = v >= 0 && v < size.y;
    const int first_cell = clamp(v, 0, size.y - 1) * size.x;
    const float along_y = Along(search.n_cam.y, v, params.cy, params.fy);
    [[unroll]] for (int k = 0; k < 4; ++k) {
      const int u = first.x + k;
      precise float along_ray = along_x[k] + along_y + search.n_cam.z;
      LookAt(search, first_cell, clamp(u, 0, size.x - 1), has_row && u >= 0 && u < size.x,
             along_ray);
    }
  }
}

// `margin` cells beyond those of the pixel on each side.
void LookFarther(inout Search search, ivec2 first, int margin, ivec2 size) {
  const ivec2 from = max(first, ivec2(0));
  const ivec2 end = min(first + int(kIndexCellsPerPixel) + 2 * margin, size);
  [[dont_unroll]] for (int v = from.y; v < end.y; ++v) {
    const float along_y = Along(search.n_cam.y, v, params.cy, params.fy);
    [[dont_unroll]] for (int u = from.x; u < end.x; ++u) {
      precise float along_ray =
          Along(search.n_cam.x, u, params.cx, params.fx) + along_y + search.n_cam.z;
      LookAt(search, v * size.x, u, true, along_ray);
    }
  }
}

bool Covered(ivec2 pixel, vec3 n_cam, float measured) {
  const int cells = int(kIndexCellsPerPixel);
  const ivec2 size = ivec2(int(params.width_px), int(params.height_px)) * cells;
  precise float at_measurement = Dot(n_cam, Ray(vec2(pixel)));
  Search search = Search(n_cam, measured, at_measurement, 3.4e38, 0.0, kNoSurfel);
  // One cell for a radius of a pixel: a surfel within one pixel covers this one, so surfels stay no
  // closer than the pixels of the finest view need.
  const int margin = cells * int(params.merge_radius_px) - 1;
  const ivec2 first = pixel * cells - margin;
  if (params.merge_radius_px == 1u) {
    LookAround(search, first, size);
  } else {
    LookFarther(search, first, margin, size);
  }
  if (search.cell == kNoSurfel) return false;
  const uint listed = imageLoad(index_map, int(2u * search.cell)).x;
  const uint block = imageLoad(surfel_blocks, int(listed / kSurfelsPerBlock)).x;
  const uint surfel = block * kSurfelsPerBlock + listed % kSurfelsPerBlock;
  return SameSurface(surfel, search.inverse_depth, search.difference, measured, n_cam);
}

// The bits of a subgroup that go into one word, in one step.
void Select(uint pixel) {
  const uint word = pixel >> 5;
  bool is_left = true;
  [[dont_unroll]] while (is_left) {
    if (word != subgroupBroadcastFirst(word)) continue;
    const uint bits = subgroupOr(1u << (pixel & 31u));
    if (subgroupElect()) atomicOr(selected[word], bits);
    is_left = false;
  }
}

void main() {
  const uint i = PixelOfBlock(imageLoad(blocks, int(WorkGroupIndex())).x);
  if (i >= params.width_px * params.height_px) return;
  const vec4 normal = imageLoad(candidate, int(i));
  if (normal.w <= 0.0) return;
  const ivec2 pixel = ivec2(PixelOf(i));
  const float measured = 1.0 / imageLoad(depth, int(i)).x;
  if (!Covered(pixel, normal.xyz, measured)) Select(i);
}
