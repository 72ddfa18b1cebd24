// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Inverse depth and confidence of a coarse level at full resolution: bilinear among those of the
// four coarse pixels around that agree with the nearest one, so that depth steps stay steps.
#version 450
#extension GL_EXT_control_flow_attributes : require
#extension GL_GOOGLE_include_directive : require

#include "depth/upsample.params.h"

layout(local_size_x = 64) in;

layout(binding = 0, r32f) uniform readonly imageBuffer coarse_depth;       // 1/su; 0: no estimate
layout(binding = 1, r32f) uniform readonly imageBuffer coarse_confidence;  // 0 to 1
layout(binding = 2, std430) writeonly buffer InverseDepth {
  float inverse_depth[];
};
layout(binding = 3, std430) writeonly buffer Confidence {
  float confidence[];
};

void main() {
  const int x = int(gl_GlobalInvocationID.x);
  const int y = int(gl_GlobalInvocationID.y);
  if (x >= int(params.width_px) || y >= int(params.height_px)) return;
  const int width = int(params.coarse_width_px);
  const int height = int(params.coarse_height_px);
  const float factor = float(params.factor);
  const vec2 at = (vec2(x, y) + 0.5) / factor - 0.5;
  const int left = int(floor(at.x));
  const int top = int(floor(at.y));
  const vec2 share = at - vec2(left, top);
  const int nearest_x = min(x / int(params.factor), width - 1);
  const int nearest_y = min(y / int(params.factor), height - 1);
  const float nearest = imageLoad(coarse_depth, nearest_y * width + nearest_x).x;
  float depth_sum = 0.0;
  float confidence_sum = 0.0;
  float weight_sum = 0.0;
  [[unroll]] for (int i = 0; i < 4; ++i) {
    const int column = clamp(left + (i & 1), 0, width - 1);
    const int row = clamp(top + (i >> 1), 0, height - 1);
    const float w = imageLoad(coarse_depth, row * width + column).x;
    const float weight = ((i & 1) == 1 ? share.x : 1.0 - share.x) *
                         ((i >> 1) == 1 ? share.y : 1.0 - share.y);
    const bool agrees = w > 0.0 && abs(w - nearest) <= params.tolerance;
    depth_sum += agrees ? weight * w : 0.0;
    confidence_sum += agrees ? weight * imageLoad(coarse_confidence, row * width + column).x : 0.0;
    weight_sum += agrees ? weight : 0.0;
  }
  const bool valid = nearest > 0.0 && weight_sum > 0.0;
  const int pixel = y * int(params.width_px) + x;
  inverse_depth[pixel] = valid ? depth_sum / weight_sum : 0.0;
  confidence[pixel] = valid ? confidence_sum / weight_sum : 0.0;
}
