// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The last step: removes the estimates where the mean DoG response of the census window, 9x7, is
// below the threshold, and turns inverse depth into depth. Four pixels are one invocation.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/texture_filter.params.h"

layout(local_size_x = 64) in;
layout(constant_id = 0) const bool kWholeTexels = true;  // rows of the maps are whole texels

// dog.comp: rows of whole texels of four pixels.
layout(binding = 0, rgba32ui) uniform readonly uimageBuffer response;
layout(binding = 1, rgba32f) uniform readonly imageBuffer inverse_depth;  // 1/su; 0: no estimate
layout(binding = 2, rgba32f) uniform readonly imageBuffer confidence;     // 0 to 1
layout(binding = 3, std430) writeonly buffer Depth {                      // su; 0: no estimate
  vec4 depth[];
};
layout(binding = 4, std430) writeonly buffer Filtered {  // confidence, 0 where there is no depth
  vec4 filtered_confidence[];
};

#include "depth/map_row.glsl"

void main() {
  const int width = int(params.width_px);
  const int height = int(params.height_px);
  const int groups_per_row = (width + 3) / 4;
  const int group = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  if (group >= groups_per_row || y >= height) return;
  const int last = width - 1;
  // Sums down the columns 4 * group - 4 to 4 * group + 7; outside the image its border is repeated.
  uint columns[12];
  [[unroll]] for (int i = 0; i < 12; ++i) columns[i] = 0u;
  uint last_column = 0u;
  [[unroll]] for (int dy = -3; dy <= 3; ++dy) {
    const int row = groups_per_row * clamp(y + dy, 0, height - 1);
    [[unroll]] for (int g = 0; g < 3; ++g) {
      const uvec4 texel = imageLoad(response, row + clamp(group + g - 1, 0, groups_per_row - 1));
      [[unroll]] for (int i = 0; i < 4; ++i) {
        columns[4 * g + i] += texel[i];
        if (4 * (group + g - 1) + i == last) last_column += texel[i];
      }
    }
  }
  [[unroll]] for (int i = 0; i < 4; ++i) columns[i] = group == 0 ? columns[4] : columns[i];
  [[unroll]] for (int i = 4; i < 12; ++i) {
    columns[i] = 4 * group - 4 + i > last ? last_column : columns[i];
  }
  float w[12], sure[12];
  LOAD_MAP_ROW(inverse_depth, width, height, group, y, w)
  LOAD_MAP_ROW(confidence, width, height, group, y, sure)
  vec4 depths, confidences;
  [[unroll]] for (int i = 0; i < 4; ++i) {
    uint sum = 0u;
    [[unroll]] for (int dx = 0; dx <= 8; ++dx) sum += columns[i + dx];
    const bool valid = w[4 + i] > 0.0 && sum >= params.min_response_sum;
    depths[i] = valid ? 1.0 / w[4 + i] : 0.0;
    confidences[i] = valid ? sure[4 + i] : 0.0;
  }
  STORE_FOUR(depth, width, 4 * group, y, depths)
  STORE_FOUR(filtered_confidence, width, 4 * group, y, confidences)
}
