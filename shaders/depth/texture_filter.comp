// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The very last step: removes the estimates where the mean DoG response of the census window, 9x7,
// is below the threshold, and turns inverse depth into depth. One pixel an invocation.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/texture_filter.params.h"

layout(local_size_x = 64) in;

layout(binding = 0, r32ui) uniform readonly uimageBuffer response;     // dog.comp
layout(binding = 1, r32f) uniform readonly imageBuffer inverse_depth;  // 1/su; 0: no estimate
layout(binding = 2, r32f) uniform readonly imageBuffer confidence;     // 0 to 1
layout(binding = 3, std430) writeonly buffer Depth {                   // su; 0: no estimate
  float depth[];
};
layout(binding = 4, std430) writeonly buffer Filtered {  // confidence, 0 where there is no depth
  float filtered_confidence[];
};

void main() {
  const int x = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  const int width = int(params.width_px);
  const int height = int(params.height_px);
  if (x >= width || y >= height) return;
  const int stride = 4 * ((width + 3) / 4);
  uint sum = 0u;
  for (int dy = -3; dy <= 3; ++dy) {
    const int row = stride * clamp(y + dy, 0, height - 1);
    [[unroll]] for (int dx = -4; dx <= 4; ++dx) {
      sum += imageLoad(response, row + clamp(x + dx, 0, width - 1)).x;
    }
  }
  const int pixel = y * width + x;
  const float w = imageLoad(inverse_depth, pixel).x;
  const bool valid = w > 0.0 && sum >= params.min_response_sum;
  depth[pixel] = valid ? 1.0 / w : 0.0;
  filtered_confidence[pixel] = valid ? imageLoad(confidence, pixel).x : 0.0;
}
