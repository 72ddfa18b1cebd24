// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// 5x5 median of inverse depth over the pixels with an estimate, the upper one where their number is
// even; outside the image its border is repeated. A pixel keeps, or gets, an estimate when enough of
// the window agrees with the median: that fills pinholes and removes speckles. Confidence is the
// mean over the agreeing pixels times their share of the window.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/median.params.h"

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool kWithConfidence = true;  // else it is 0

layout(binding = 0, r32f) uniform readonly imageBuffer inverse_depth;  // 1/su; 0: no estimate
layout(binding = 1, r32f) uniform readonly imageBuffer confidence;     // 0 to 1
layout(binding = 2, std430) writeonly buffer MedianDepth {             // as inverse_depth
  float median_depth[];
};
layout(binding = 3, std430) writeonly buffer MedianConfidence {  // as confidence
  float median_confidence[];
};

const float kInfinity = 3.4e38;

void main() {
  const int x = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  const int width = int(params.width_px);
  const int height = int(params.height_px);
  if (x >= width || y >= height) return;

  // Pixels without estimate become plus and minus infinity in turn, so that the middle of all 25 is
  // the middle of the rest.
  float value[25];
  bool odd = false;
  [[unroll]] for (int i = 0; i < 25; ++i) {
    const int column = clamp(x + i % 5 - 2, 0, width - 1);
    const int row = clamp(y + i / 5 - 2, 0, height - 1);
    const float w = imageLoad(inverse_depth, row * width + column).x;
    value[i] = w > 0.0 ? w : (odd ? -kInfinity : kInfinity);
    odd = w > 0.0 ? odd : !odd;
  }
  // Forgetful selection: of 14 values neither the least nor the greatest can be the median of 25.
  float kept[14];
  [[unroll]] for (int i = 0; i < 14; ++i) kept[i] = value[i];
  [[unroll]] for (int n = 14; n >= 3; --n) {
    [[unroll]] for (int i = 1; i < 14; ++i) {
      if (i < n) {
        const float less = min(kept[0], kept[i]);
        kept[i] = max(kept[0], kept[i]);
        kept[0] = less;
      }
    }
    [[unroll]] for (int i = 1; i < 13; ++i) {
      if (i < n - 1) {
        const float greater = max(kept[i], kept[n - 1]);
        kept[i] = min(kept[i], kept[n - 1]);
        kept[n - 1] = greater;
      }
    }
    if (n > 3) kept[0] = value[28 - n];
  }
  const float median = kept[1];

  uint support = 0u;
  float sum = 0.0;
  [[unroll]] for (int i = 0; i < 25; ++i) {
    const int column = clamp(x + i % 5 - 2, 0, width - 1);
    const int row = clamp(y + i / 5 - 2, 0, height - 1);
    const bool agrees = abs(value[i] - median) <= params.tolerance;
    support += agrees ? 1u : 0u;
    if (kWithConfidence) sum += agrees ? imageLoad(confidence, row * width + column).x : 0.0;
  }
  const bool valid = abs(median) < kInfinity && support >= params.min_support;
  const int pixel = y * width + x;
  median_depth[pixel] = valid ? median : 0.0;
  median_confidence[pixel] = valid ? sum / 25.0 : 0.0;
}
