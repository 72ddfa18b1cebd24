// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_EXT_control_flow_attributes : require

// Normal equations of the registration of a depth map with the model (paper, section 3.3): each
// surfel in view looks up the pixel onto which it falls. Two residuals, each over its sigma and
// with Huber's weight: its distance from the tangent plane of the pixel, and its grey value against
// the image's. Unknowns, in the camera's frame: rotation w, translation t of the surfels
// (p' = p + w x p + t), and the logarithm of the scale of the measured depths.
//
// Every invocation adds up its surfels and writes one row; the host adds up the rows.
#include "fusion/register.params.h"
#define MONO3D_FUSION_OWN_PARAMS
#include "fusion/surfel.glsl"
#include "fusion/view.glsl"
#include "fusion/nearest_cell.glsl"

layout(binding = 0, rgba32f) uniform readonly imageBuffer position_radius;  // per surfel
layout(binding = 1, rgba32f) uniform readonly imageBuffer normal_weight;    // per surfel
layout(binding = 2, rgba32ui) uniform readonly uimageBuffer history;        // per surfel
layout(binding = 3, r32f) uniform readonly imageBuffer depth;               // su, height x width
layout(binding = 4, rgba32f) uniform readonly imageBuffer candidate;        // per pixel
layout(binding = 5, r32f) uniform readonly imageBuffer grey;  // of the level, rows of its width
layout(binding = 6, r32ui) uniform readonly uimageBuffer blocks;  // to work on
layout(binding = 7, r32ui) uniform readonly uimageBuffer anchor_of_block;
layout(binding = 8, rgba32f) uniform readonly imageBuffer anchors;  // two per anchor, see UseAnchor
// Per row kVectorsPerRow: head, tail, depth, light, light2 of the accumulator.
layout(binding = 9, std430) writeonly buffer Sums { vec4 sums_of_row[]; };
// Per cell, where hidden surfels are left out: see register_nearest.comp.
layout(binding = 10, std430) readonly buffer Nearest { uint nearest[]; };

const uint kSurfelsPerRow = 16u;
const uint kVectorsPerRow = 14u;
const float kHuber = 1.345;  // 95 % as good as least squares where noise is normal (Huber 1964)

struct Row7 {
  vec4 head;  // derivatives by w.x w.y w.z t.x
  vec4 tail;  // by t.y t.z, log scale; the residual
};

struct Accumulator {
  vec4 head[4];  // head[k] = sum of J_k * J.head
  vec4 tail[7];  // tail[k] = sum of J_k * (J.tail | residual)
  vec4 depth;    // weighted sum of squares; agree; stand before; lie behind
  vec4 light;    // weighted sum of squares; number; sum of the image's grey; of the surfels' grey
  vec4 light2;   // sums of squares of image's and surfels' grey; of the weights of these sums; of
                 // their products
};

float HuberWeight(float residual) { return min(1.0, kHuber / max(abs(residual), 1e-12)); }

// Two residuals at once, so that the sums are read and written once.
void Add(inout Accumulator sums, Row7 depth, float depth_weight, Row7 light, float light_weight) {
  const vec4 a = depth_weight * depth.head, b = depth_weight * depth.tail;
  const vec4 c = light_weight * light.head, d = light_weight * light.tail;
  sums.head[0] += a.x * depth.head + c.x * light.head;
  sums.head[1] += a.y * depth.head + c.y * light.head;
  sums.head[2] += a.z * depth.head + c.z * light.head;
  sums.head[3] += a.w * depth.head + c.w * light.head;
  sums.tail[0] += a.x * depth.tail + c.x * light.tail;
  sums.tail[1] += a.y * depth.tail + c.y * light.tail;
  sums.tail[2] += a.z * depth.tail + c.z * light.tail;
  sums.tail[3] += a.w * depth.tail + c.w * light.tail;
  sums.tail[4] += b.x * depth.tail + d.x * light.tail;
  sums.tail[5] += b.y * depth.tail + d.y * light.tail;
  sums.tail[6] += b.z * depth.tail + d.z * light.tail;
}

// Grey value and its change per pixel of the full image, by hand from the four pixels around.
// False outside.
bool SampleGrey(vec2 pixel, out vec3 value_gradient) {
  value_gradient = vec3(0.0);
  const float shrink = exp2(-float(params.grey_level));
  const ivec2 size = ivec2(uvec2(params.width_px, params.height_px) >> params.grey_level);
  const vec2 at = (pixel + 0.5) * shrink - 0.5;
  const vec2 base = floor(at);
  if (any(lessThan(base, vec2(0.0))) || any(greaterThanEqual(ivec2(base) + 1, size))) return false;
  const vec2 f = at - base;
  const int first = int(base.y) * size.x + int(base.x);
  const float a = imageLoad(grey, first).x, b = imageLoad(grey, first + 1).x;
  const float c = imageLoad(grey, first + size.x).x, d = imageLoad(grey, first + size.x + 1).x;
  const float top = mix(a, b, f.x), bottom = mix(c, d, f.x);
  value_gradient = vec3(mix(top, bottom, f.y), shrink * mix(b - a, d - c, f.y),
                        shrink * mix(c - a, d - b, f.x));
  return true;
}

float SurfelGrey(uint rgb10) { return dot(UnpackColour(rgb10), vec3(0.299, 0.587, 0.114)) / 4.0; }

// How bright a place is that is as bright, or as dark, as can be, is not known.
bool IsClipped(float value) { return value > 254.0 || value < 1.0; }

// For gain and bias: what fits them as they are counts.
void AddExposure(inout Accumulator sums, float of_image, float of_surfel, float weight) {
  sums.light.zw += weight * vec2(of_image, of_surfel);
  sums.light2 += weight * vec4(of_image * of_image, of_surfel * of_surfel, 1.0,
                               of_image * of_surfel);
}

// The grey residual and its weight, 0 where there is none to compare.
Row7 Light(inout Accumulator sums, vec3 p_cam, uint rgb10, out float weight) {
  weight = 0.0;
  const Row7 none = Row7(vec4(0.0), vec4(0.0));
  vec3 seen;
  if (!SampleGrey(Project(p_cam), seen)) return none;
  const float of_surfel = SurfelGrey(rgb10);
  if (IsClipped(seen.x) || IsClipped(of_surfel)) return none;
  sums.light.y += 1.0;
  if (params.grey_gain <= 0.0) {
    AddExposure(sums, seen.x, of_surfel, 1.0);
    return none;
  }
  const float shift = params.grey_shift_px;
  const float sigma = sqrt(params.grey_noise * params.grey_noise +
                           shift * shift * dot(seen.yz, seen.yz));
  const float residual =
      (seen.x - params.grey_gain * of_surfel - params.grey_bias) / sigma;
  const vec2 g = seen.yz * vec2(params.fx, params.fy) / (p_cam.z * sigma);
  const vec3 by_point = vec3(g, -dot(g, p_cam.xy) / p_cam.z);
  weight = HuberWeight(residual);
  sums.light.x += weight * residual * residual;
  AddExposure(sums, seen.x, of_surfel, weight);
  return Row7(vec4(cross(p_cam, by_point), by_point.x), vec4(by_point.yz, 0.0, residual));
}

// Whether the model itself hides a surfel: what lies behind its own nearest surface says nothing
// against a depth map that shows that surface. A surface that runs away from the camera does not
// hide itself: its inverse depth changes evenly over the cell.
bool IsHidden(vec3 p_cam, vec3 n_surfel, vec2 pixel, float sigma) {
  const float nearest_depth = uintBitsToFloat(nearest[NearestCellOf(pixel)]);
  const float slope = (abs(n_surfel.x) / params.fx + abs(n_surfel.y) / params.fy) /
                      max(abs(Dot(n_surfel, p_cam)), 1e-12);
  const float margin = params.association_sigmas * sigma + float(kNearestCell_px) * slope;
  return 1.0 / nearest_depth > 1.0 / p_cam.z + margin;
}

void AddSurfel(inout Accumulator sums, uint i, uint block) {
  const vec4 surfel_normal = imageLoad(normal_weight, int(i));
  if (surfel_normal.w <= 0.0) return;
  const int anchor = int(imageLoad(anchor_of_block, int(block)).x);
  UseAnchor(imageLoad(anchors, 2 * anchor), imageLoad(anchors, 2 * anchor + 1));
  const vec3 p_cam = PointToCamera(imageLoad(position_radius, int(i)).xyz);
  const vec3 n_surfel = DirectionToCamera(surfel_normal.xyz);
  if (p_cam.z <= 0.0 || Dot(n_surfel, p_cam) >= 0.0) return;
  precise vec2 rounded = floor(Project(p_cam) + 0.5);
  if (any(lessThan(rounded, vec2(0.0))) || rounded.x >= float(params.width_px) ||
      rounded.y >= float(params.height_px)) {
    return;
  }
  const int pixel = int(rounded.y) * int(params.width_px) + int(rounded.x);
  const vec4 n_pixel = imageLoad(candidate, pixel);
  if (n_pixel.w <= 0.0) return;

  const float measured_depth = imageLoad(depth, pixel).x;
  precise float measured = 1.0 / measured_depth;
  precise float inverse_depth = 1.0 / p_cam.z;
  precise vec3 ray = p_cam * inverse_depth;
  const vec3 pixel_ray = Ray(rounded);
  const float expected = TangentPlaneInverseDepth(n_pixel.xyz, pixel_ray, measured, ray);
  const float sigma = JointSigma(measured, inverse_depth, WeightToCamera(surfel_normal.w));
  precise float difference = inverse_depth - expected;
  if (abs(difference) > params.association_sigmas * sigma) {
    if (params.leaves_out_hidden != 0u && difference < 0.0 &&
        IsHidden(p_cam, n_surfel, rounded, sigma)) {
      return;
    }
    sums.depth.zw += difference > 0.0 ? vec2(1.0, 0.0) : vec2(0.0, 1.0);
    return;
  }
  if (Dot(n_surfel, n_pixel.xyz) < params.min_normal_cosine) return;

  // A depth error dz moves the tangent plane by (n.ray) dz, and dz = z^2 dw.
  const vec3 n = n_pixel.xyz;
  const float per_sigma = 1.0 / (max(-Dot(n, ray), 1e-3) * p_cam.z * p_cam.z * sigma);
  const float residual = per_sigma * Dot(n, p_cam - measured_depth * pixel_ray);
  const float weight = HuberWeight(residual);
  const vec3 by_rotation = per_sigma * cross(p_cam, n);
  const vec3 by_point = per_sigma * n;
  const float by_scale = -per_sigma * measured_depth * Dot(n, pixel_ray);
  sums.depth.xy += vec2(weight * residual * residual, 1.0);
  float light_weight;
  const Row7 light = Light(sums, p_cam, imageLoad(history, int(i)).x, light_weight);
  Add(sums, Row7(vec4(by_rotation, by_point.x), vec4(by_point.yz, by_scale, residual)), weight,
      light, light_weight);
}

void main() {
  const uint row = ItemIndex();
  const uint num_listed = params.num_blocks * kSurfelsPerBlock;
  const uint num_sampled = (num_listed + params.stride - 1u) / params.stride;
  const uint num_rows = (num_sampled + kSurfelsPerRow - 1u) / kSurfelsPerRow;
  if (row >= num_rows) return;
  Accumulator sums;
  [[unroll]] for (int k = 0; k < 4; ++k) sums.head[k] = vec4(0.0);
  [[unroll]] for (int k = 0; k < 7; ++k) sums.tail[k] = vec4(0.0);
  sums.depth = sums.light = sums.light2 = vec4(0.0);
  // Neighbours in one round, so that they read neighbouring memory.
  for (uint round = 0u; round < kSurfelsPerRow; ++round) {
    const uint sample_index = round * num_rows + row;
    if (sample_index >= num_sampled) continue;
    const uint listed = sample_index * params.stride;
    const uint block = imageLoad(blocks, int(listed / kSurfelsPerBlock)).x;
    const uint i = block * kSurfelsPerBlock + listed % kSurfelsPerBlock;
    if (i < params.num_surfels) AddSurfel(sums, i, block);
  }
  const uint first = row * kVectorsPerRow;
  [[unroll]] for (uint k = 0u; k < 4u; ++k) sums_of_row[first + k] = sums.head[k];
  [[unroll]] for (uint k = 0u; k < 7u; ++k) sums_of_row[first + 4u + k] = sums.tail[k];
  sums_of_row[first + 11u] = sums.depth;
  sums_of_row[first + 12u] = sums.light;
  sums_of_row[first + 13u] = sums.light2;
}
