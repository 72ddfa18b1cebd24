// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// What was matched, at half the resolution: of 2x2 pixels the mean inverse depth and confidence,
// weighted by confidence. Estimates that the texture filter takes away count little, but they
// count: where texture is weak their mean is still right. In the sky nothing does: what was
// matched there is the surface before it, by the width of the census window. Where nothing is left
// by that filter and a plane is known, that is the data. One pixel of half the resolution is one invocation.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/inference_data.params.h"
#include "depth/padded_image.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, r32f) uniform readonly imageBuffer depth;          // su; 0: filtered out
layout(binding = 1, r32f) uniform readonly imageBuffer inverse_depth;  // 1/su; 0: no estimate
layout(binding = 2, r32f) uniform readonly imageBuffer confidence;     // 0 to 1, of both
layout(binding = 3, rgba32ui) uniform readonly uimageBuffer image;     // padded, half resolution
layout(binding = 4, rgba32f) uniform readonly imageBuffer cells;       // inference.glsl
layout(binding = 5, std430) writeonly buffer Data {
  vec4 data[];
};
// At full resolution: the inverse depth of what was matched, before anything is inferred.
layout(binding = 6, std430) writeonly buffer Whole {
  float whole[];
};

#include "depth/inference.glsl"
#define WORDS image
#include "depth/three_words.glsl"

const float kMatchedWeight = 0.3;
const float kConfidenceWeight = 4.0;  // added, times the confidence
const float kUntexturedWeight = 0.05;
const float kPlaneWeight = 1.0;  // of 2x2 pixels, as much as matched ones have at least
const float kUntexturedConfidence = 0.25;  // share of it that is kept

void main() {
  const int x = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  const int width = int(params.width_px + 1u) / 2;
  const int height = int(params.height_px + 1u) / 2;
  if (x >= width || y >= height) return;
  const vec4 cell = imageLoad(cells, CellAt(2 * x, 2 * y, params.width_px));
  vec3 sums = vec3(0);  // of weights, of weighted inverse depths and confidences
  bool any_textured = false;
  [[unroll]] for (int i = 0; i < 4; ++i) {
    const int column = 2 * x + (i & 1);
    const int row = 2 * y + (i >> 1);
    const bool inside = column < int(params.width_px) && row < int(params.height_px);
    const int pixel = inside ? row * int(params.width_px) + column : 0;
    const float w = imageLoad(inverse_depth, pixel).x;
    const float sure = imageLoad(confidence, pixel).x;
    const float matched = imageLoad(depth, pixel).x;
    const bool textured = matched > 0.0;
    any_textured = any_textured || (inside && textured);
    if (inside) whole[pixel] = textured ? 1.0 / matched : 0.0;
    const float weight = textured ? kMatchedWeight + kConfidenceWeight * sure : kUntexturedWeight;
    if (inside && w > 0.0) {
      sums += weight * vec3(1.0, w, textured ? sure : kUntexturedConfidence * sure);
    }
  }
  if (cell.w > 0.0 && !any_textured) {
    const float plane = cell.x + float(2 * (x & 1) - 1) * cell.y + float(2 * (y & 1) - 1) * cell.z;
    sums = kPlaneWeight * vec3(1.0, plane, ConfidenceOf(cell));
  }
  if (cell.w < 0.0) sums = vec3(0);
  const int word = PaddedWordIndex(int(PaddedWordsPerRow(uint(width))), x >> 2, y);
  const uint grey = (CutWord(imageLoad(image, word >> 2), word) >> (8 * (x & 3))) & 0xffu;
  const float share = sums.x > 0.0 ? 1.0 / sums.x : 0.0;
  data[y * width + x] = vec4(share * sums.y, sums.x, share * sums.z, float(grey));
}
