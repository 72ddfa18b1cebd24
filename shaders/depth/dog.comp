// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Difference of Gaussians of the reference image, as magnitude in units of 1/256 grey level:
// binomial kernels of 5 and of 9 taps each way (standard deviations 1 and sqrt(2) px). Integers.
// Four pixels an invocation.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/dog.params.h"
#include "depth/padded_image.glsl"

layout(local_size_x = 64) in;

layout(binding = 0, rgba32ui) uniform readonly uimageBuffer image;  // padded image
layout(binding = 1, std430) writeonly buffer Response {          // rows of 4 * ceil(width / 4)
  uvec4 response[];
};

#define WORDS image
#include "depth/three_words.glsl"

const int kWide[9] = int[](1, 8, 28, 56, 70, 56, 28, 8, 1);
const int kNarrow[9] = int[](0, 0, 1, 4, 6, 4, 1, 0, 0);

void main() {
  const int groups_per_row = int(params.width_px + 3u) / 4;
  const int group = int(gl_GlobalInvocationID.x);
  const int row = int(gl_GlobalInvocationID.y);
  if (group >= groups_per_row || row >= int(params.height_px)) return;
  int wide[12];  // sums down the columns
  int narrow[12];
  [[unroll]] for (int i = 0; i < 12; ++i) {
    wide[i] = 0;
    narrow[i] = 0;
  }
  [[unroll]] for (int dy = 0; dy < 9; ++dy) {
    const uvec3 words = ThreeWords(PaddedWordIndex(groups_per_row + 2, group - 1, row + dy - 4));
    [[unroll]] for (int w = 0; w < 3; ++w) {
      const uint word = words[w];
      [[unroll]] for (int i = 0; i < 4; ++i) {
        const int grey = int((word >> (8 * i)) & 0xffu);
        wide[4 * w + i] += kWide[dy] * grey;
        narrow[4 * w + i] += kNarrow[dy] * grey;
      }
    }
  }
  uvec4 result;
  [[unroll]] for (int p = 0; p < 4; ++p) {
    int difference = 0;
    [[unroll]] for (int dx = 0; dx < 9; ++dx) {
      // 256 makes up for the smaller sum of the narrow kernel's weights.
      difference += 256 * kNarrow[dx] * narrow[p + dx] - kWide[dx] * wide[p + dx];
    }
    result[p] = uint(abs(difference)) >> 8;
  }
  response[row * groups_per_row + group] = result;
}
