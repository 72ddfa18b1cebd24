// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// 5x5 median of inverse depth over the pixels with an estimate, the upper one where their number is
// even; outside the image its border is repeated. A pixel keeps, or gets, an estimate when enough
// of the window agrees with the median: that fills pinholes and removes speckles. Confidence is the
// mean over the agreeing pixels times their share of the window. Four pixels an invocation.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/median.params.h"

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool kWithConfidence = true;  // else it is not written
layout(constant_id = 1) const bool kWholeTexels = true;     // rows are whole texels

layout(binding = 0, rgba32f) uniform readonly imageBuffer inverse_depth;  // 1/su; 0: no estimate
layout(binding = 1, rgba32f) uniform readonly imageBuffer confidence;     // 0 to 1
layout(binding = 2, std430) writeonly buffer MedianDepth {                // as inverse_depth
  vec4 median_depth[];
};
layout(binding = 3, std430) writeonly buffer MedianConfidence {  // as confidence
  vec4 median_confidence[];
};

#include "depth/map_row.glsl"

// Positive floats are in the order of their bits, which are faster to compare. The ends of that
// order stand for no estimate.
const int kInfinity = 0x7f7fffff;
const int kMinusInfinity = -1;

// Of the 25 values whose middle is the median.
int MedianOf(int value[25]) {
  // Forgetful selection: of 14 values neither the least nor the greatest can be the median of 25.
  int kept[14];
  [[unroll]] for (int i = 0; i < 14; ++i) kept[i] = value[i];
  [[unroll]] for (int n = 14; n >= 3; --n) {
    [[unroll]] for (int i = 1; i < 14; ++i) {
      if (i < n) {
        const int less = min(kept[0], kept[i]);
        kept[i] = max(kept[0], kept[i]);
        kept[0] = less;
      }
    }
    [[unroll]] for (int i = 1; i < 13; ++i) {
      if (i < n - 1) {
        const int greater = max(kept[i], kept[n - 1]);
        kept[i] = min(kept[i], kept[n - 1]);
        kept[n - 1] = greater;
      }
    }
    if (n > 3) kept[0] = value[28 - n];
  }
  return kept[1];
}

// Columns left and right of the image become those at its border.
void RepeatBorder(int first_column, int width, inout float row[12]) {
  [[unroll]] for (int i = 3; i >= 2; --i) row[i] = first_column + i < 0 ? row[i + 1] : row[i];
  [[unroll]] for (int i = 5; i < 10; ++i) row[i] = first_column + i >= width ? row[i - 1] : row[i];
}

void main() {
  const int width = int(params.width_px);
  const int height = int(params.height_px);
  const int group = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  if (4 * group >= width || y >= height) return;
  float rows[5][12];
  float confidences[5][12];
  [[unroll]] for (int dy = 0; dy < 5; ++dy) {
    const int row = clamp(y + dy - 2, 0, height - 1);
    LOAD_MAP_ROW(inverse_depth, width, height, group, row, rows[dy])
    RepeatBorder(4 * group - 4, width, rows[dy]);
    if (kWithConfidence) {
      LOAD_MAP_ROW(confidence, width, height, group, row, confidences[dy])
      RepeatBorder(4 * group - 4, width, confidences[dy]);
    }
  }
  vec4 medians, means;
  [[unroll]] for (int p = 0; p < 4; ++p) {
    // Pixels without estimate become plus and minus infinity in turn, so that the middle of all 25
    // is the middle of the rest.
    int value[25];
    int none = kInfinity;
    [[unroll]] for (int i = 0; i < 25; ++i) {
      const float w = rows[i / 5][p + 2 + i % 5];
      value[i] = w > 0.0 ? floatBitsToInt(w) : none;
      none = w > 0.0 ? none : none ^ (kInfinity ^ kMinusInfinity);
    }
    const int middle = MedianOf(value);
    const float median = intBitsToFloat(middle);
    uint support = 0u;
    float sum = 0.0;
    [[unroll]] for (int i = 0; i < 25; ++i) {
      // With an estimate of its own, which 0 is not.
      const float w = rows[i / 5][p + 2 + i % 5];
      const bool agrees = abs(w - median) <= params.tolerance && w > 0.0;
      support += agrees ? 1u : 0u;
      if (kWithConfidence) sum += agrees ? confidences[i / 5][p + 2 + i % 5] : 0.0;
    }
    const bool valid = middle > 0 && middle < kInfinity && support >= params.min_support;
    medians[p] = valid ? median : 0.0;
    means[p] = valid ? sum / 25.0 : 0.0;
  }
  STORE_FOUR(median_depth, width, 4 * group, y, medians)
  if (kWithConfidence) STORE_FOUR(median_confidence, width, 4 * group, y, means)
}
