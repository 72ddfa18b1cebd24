// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The planes that each pixel of a level is matched on, from the depth and normals of the next
// coarser level. The level has one grid of planes; a pixel takes 16 of them around its prior, the
// depth of the coarse pixel that it lies in. The range is moved to include the depths of the
// neighbours as far as possible, so that a thin structure or a step that the coarse level lost can
// come back.
//
// SGM^sn: on a plane n.X = c inverse depth is affine in the pixel, and a step r of one pixel
// changes it by (1/Z) (n . K^-1 r) / (n . K^-1 p). For each direction of a path that change,
// rounded to planes, has no penalty. (Rounding the two inverse depths instead of their difference
// would fix where the change takes place, and with it the errors of the coarse level.) The four
// fine pixels of a coarse one are one invocation.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/padded_image.glsl"
#include "depth/prior.params.h"

layout(local_size_x = 64) in;

layout(binding = 0, rgba32f) uniform readonly imageBuffer coarse_depth;   // 1/su; 0: no estimate
layout(binding = 1, rgba32f) uniform readonly imageBuffer coarse_normal;  // three floats, or 0
layout(binding = 2, rgba32ui) uniform readonly uimageBuffer image;        // padded grey image, the first
// Two words of each pixel, in the order of fine_volume.glsl. The first: the first plane in bits
// 0..15, the grey value in bits 16..23, and kNarrow where the 8 planes in the middle hold the
// neighbourhood with a margin, so that the others need not be matched. The second: the change in
// planes from the previous pixel of a path to this one, 4 bits with sign for each direction.
layout(binding = 3, std430) writeonly buffer Ranges {
  uvec2 ranges[];
};

#define WORDS image
#include "depth/fine_volume.glsl"
#include "depth/three_words.glsl"

const float kNumPlanes = float(kFinePlanes);
// A coarse plane is two fine ones; an error of one coarse plane and the parabola's neighbour must
// fit on each side.
const float kMargin = 3.0;
// Surfaces steeper than one plane a pixel are hidden from one side or the other.
const float kSteepest = 1.0;
const float kMinCosine = 0.05;  // of normal and ray; more grazing surfaces have no usable slope

int width;  // of the coarse level
int height;

float Position(float w) { return (w - params.inverse_depth) / params.inverse_depth_step; }

// Of a pixel and those to its left and right; at the image's border its own stands for them.
vec3 DepthsAround(int x, int y) {
  const int first = y * width + x - 1;
  const int last_texel = (width * height - 1) >> 2;
  const vec3 depths = uintBitsToFloat(
      CutThreeWords(floatBitsToUint(imageLoad(coarse_depth, max(first >> 2, 0))),
                    floatBitsToUint(imageLoad(coarse_depth, min((first + 2) >> 2, last_texel))),
                    first));
  return vec3(x > 0 ? depths.x : depths.y, depths.y, x + 1 < width ? depths.z : depths.y);
}

// In planes of the fine level per pixel of the fine level.
vec2 Slope(int x, int y, float w) {
  const int index = 3 * (y * width + x);
  const vec3 n = uintBitsToFloat(
      CutThreeWords(floatBitsToUint(imageLoad(coarse_normal, index >> 2)),
                    floatBitsToUint(imageLoad(coarse_normal, (index + 2) >> 2)), index));
  const vec3 ray = vec3((float(x) - params.cx) / params.fx, (float(y) - params.cy) / params.fy, 1.0);
  const float cosine = dot(n, ray);
  if (params.follow_normals == 0u || cosine > -kMinCosine) return vec2(0);
  const vec2 slope = 0.5 * w / params.inverse_depth_step * vec2(n.x / params.fx, n.y / params.fy) /
                     cosine;
  return clamp(slope, vec2(-kSteepest), vec2(kSteepest));
}

uint Jump(vec2 slope, float dx, float dy, int direction) {
  const int jump = clamp(int(floor(dot(slope, vec2(dx, dy)) + 0.5)), -8, 7);
  return (uint(jump) & 15u) << (4 * direction);
}

void main() {
  const int column = int(gl_GlobalInvocationID.x);
  const int row = int(gl_GlobalInvocationID.y);
  width = int(params.coarse_width_px);
  height = int(params.coarse_height_px);
  if (column >= width || row >= height) return;
  float nearest = 0.0;
  float farthest = 3.4e38;
  float own = 0.0;
  [[unroll]] for (int dy = -1; dy <= 1; ++dy) {
    const vec3 depths = DepthsAround(column, clamp(row + dy, 0, height - 1));
    [[unroll]] for (int i = 0; i < 3; ++i) {
      nearest = max(nearest, depths[i]);
      farthest = min(farthest, depths[i] > 0.0 ? depths[i] : farthest);
    }
    if (dy == 0) own = depths.y;
  }
  const bool found = nearest > 0.0;
  const float w = own > 0.0 ? own : (found ? 0.5 * (nearest + farthest) : 0.0);
  const vec2 slope = own > 0.0 ? Slope(column, row, w) : vec2(0);
  const float coarse_position = found ? Position(w) : 0.5 * float(params.num_planes);
  const uint jumps = Jump(slope, 1, 0, 0) | Jump(slope, -1, 0, 1) |
                     Jump(slope, 0, 1, 2) | Jump(slope, 0, -1, 3) |
                     Jump(slope, 1, 1, 4) | Jump(slope, -1, -1, 5) |
                     Jump(slope, -1, 1, 6) | Jump(slope, 1, -1, 7);
  const float reach = 0.5 * kNumPlanes - kMargin;
  const float most = max(float(params.num_planes) - kNumPlanes, 0.0);
  const float around = 0.5 * (Position(nearest) + Position(farthest));
  const float spread = Position(nearest) - Position(farthest);

  // The middle of the neighbourhood, but never so that the prior's own margin is left.
  const float middle = found ? around : coarse_position;
  const float centre = clamp(middle, coarse_position - reach, coarse_position + reach);
  const float wanted = floor(centre - 0.5 * kNumPlanes + 1.0);
  const float first = clamp(wanted, 0.0, most);
  const bool narrow = found && first == wanted && spread <= 0.5 * kNumPlanes - 2.0 * kMargin;
  const uint range = uint(first) | (narrow ? kNarrow : 0u);

  const int words_per_row = int(PaddedWordsPerRow(params.width_px));
  [[unroll]] for (int i = 0; i < 2; ++i) {
    const int x = 2 * column;
    const int y = 2 * row + i;
    const int word = PaddedWordIndex(words_per_row, x >> 2, y);
    const uint greys = CutWord(imageLoad(image, word >> 2), word) >> (8 * (x & 2));
    if (y < int(params.height_px)) {
      const int pixel = FinePixel(x, y, int(params.height_px));
      ranges[pixel] = uvec2(range | ((greys & 0xffu) << 16), jumps);
      // In a column of pixels the next one is there, if only as a place that nobody reads.
      ranges[pixel + 1] = uvec2(range | ((greys & 0xff00u) << 8), jumps);
    }
  }
}
