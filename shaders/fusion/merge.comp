// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors
#version 450
#extension GL_GOOGLE_include_directive : require
#extension GL_KHR_shader_subgroup_ballot : require

// Each surfel that a pixel confirms takes up what the pixel says, by its weight. It moves along the
// ray of this view only: errors of depth lie along rays, and surfels keep their spacing. Inverse
// depth is averaged, in which matching errors are symmetric. What the map says against the others
// is noted in the same pass (free_space.glsl), since it reads and writes the same.
#include "fusion/surfel.glsl"
#include "fusion/view.glsl"
#include "fusion/free_space.glsl"

layout(binding = 0, r32ui) uniform readonly uimageBuffer association;  // per surfel
layout(binding = 1, r32f) uniform readonly imageBuffer depth;  // su, height x width
layout(binding = 2, rgba32f) uniform readonly imageBuffer candidate;  // per pixel
layout(binding = 3, r32ui) uniform readonly uimageBuffer colour;  // per pixel, surfel.glsl
layout(binding = 4, rgba32f) uniform readonly imageBuffer old_position_radius;  // per surfel, as
layout(binding = 5, rgba32f) uniform readonly imageBuffer old_normal_weight;  // the three below
layout(binding = 6, rgba32ui) uniform readonly uimageBuffer old_history;
layout(binding = 7, r32ui) uniform readonly uimageBuffer blocks;  // to work on
layout(binding = 8, r32ui) uniform readonly uimageBuffer anchor_of_block;
layout(binding = 9, rgba32f) uniform readonly imageBuffer anchors;  // two per anchor, see UseAnchor
layout(binding = 10, std430) writeonly buffer PositionRadius { vec4 position_radius[]; };
layout(binding = 11, std430) writeonly buffer NormalWeight { vec4 normal_weight[]; };
layout(binding = 12, std430) writeonly buffer History { uvec4 history[]; };
layout(binding = 13, std430) buffer Confirmed { uint num_confirmed[]; };  // per block; 0 before
layout(binding = 14, std430) buffer Count { uint num_removed; };

// Channels of 10 bits from which on they are as bright as an image can be.
const float kClipped = 1020.0;

// How bright a clipped channel is, is not known: what is known stands.
vec3 MergedColour(vec3 old, vec3 measured, float share) {
  precise vec3 mean = old * (1.0 - share) + measured * share;
  const vec3 known = mix(mean, measured, greaterThanEqual(old, vec3(kClipped)));
  return mix(known, old, greaterThanEqual(measured, vec3(kClipped)));
}

uvec4 MergedHistory(uvec4 old, uint pixel, float share, float confidence) {
  const uint rgb8 = imageLoad(colour, int(pixel)).x;
  const vec3 measured = UnpackColour(Colour10From8(rgb8));
  return uvec4(PackColour(MergedColour(UnpackColour(old.x), measured, share)) |
                   CoarseMatchOf(old.x) | CoarseMatchOfPixel(rgb8),
               Pack16(Low16(old.y) + 1u, High16(old.y)), Pack16(Low16(old.z), params.map_index),
               Pack16(Low16(old.w), High16(old.w) + ConfidenceSteps(confidence)));
}

struct Surfel {
  vec4 position_radius;
  vec4 normal_weight;
};

// A surfel as the pixel that confirms it changes it; `share` of that is the pixel's.
Surfel Merged(uint i, uint block, uint pixel, vec4 measured_normal, out float share) {
  const int anchor = int(imageLoad(anchor_of_block, int(block)).x);
  UseAnchor(imageLoad(anchors, 2 * anchor), imageLoad(anchors, 2 * anchor + 1));

  const float measured_depth = imageLoad(depth, int(pixel)).x;
  const vec4 old_normal = imageLoad(old_normal_weight, int(i));
  const vec4 old_position = imageLoad(old_position_radius, int(i));
  const vec3 p_cam = PointToCamera(old_position.xyz);
  precise vec3 ray = vec3(p_cam.xy / p_cam.z, 1.0);
  const vec3 pixel_ray = Ray(vec2(PixelOf(pixel)));

  const float old_weight = WeightToCamera(old_normal.w);
  precise float w = 1.0 / p_cam.z;
  const float measured =
      TangentPlaneInverseDepth(measured_normal.xyz, pixel_ray, 1.0 / measured_depth, ray);
  // Information on depth, 1/su^2: sigma(z) = sigma(w) z^2.
  precise float sigma = InverseDepthSigma(measured) / (measured * measured);
  precise float weight = measured_normal.w / (sigma * sigma);
  precise float share_in_depth = weight / (weight + old_weight);
  share = share_in_depth;
  // In inverse depth information is z^4 times as much.
  precise float ratio = w / measured;
  precise float weight_here = weight * ratio * ratio * ratio * ratio;
  precise float share_in_inverse_depth = weight_here / (weight_here + old_weight);
  precise float merged = w + share_in_inverse_depth * (measured - w);
  precise vec3 p_merged = ray / merged;

  precise vec3 normal =
      old_normal.xyz * (1.0 - share) + DirectionToAnchor(measured_normal.xyz) * share;
  precise vec3 unit_normal = normal * (1.0 / sqrt(Dot(normal, normal)));
  precise float radius = SurfelRadius(measured_depth, measured_normal.xyz, pixel_ray) *
                         float(params.merge_radius_px) / scale;
  precise float sum_of_weights = old_normal.w + WeightToAnchor(weight);
  return Surfel(vec4(PointToAnchor(p_merged), min(old_position.w, radius)),
                vec4(unit_normal, sum_of_weights));
}

void main() {
  const uint block = imageLoad(blocks, int(WorkGroupIndex())).x;
  const uint i = SurfelOfBlock(block);
  if (i >= params.num_surfels) return;
  const uint said = imageLoad(association, int(i)).x;
  if (said == kUnseen) return;
  uvec4 of_surfel = imageLoad(old_history, int(i));
  if (SpeaksAgainst(said, of_surfel)) {
    history[i] = of_surfel;
    if (!IsRefuted(of_surfel)) return;
    normal_weight[i] = vec4(0.0);
    atomicAdd(num_removed, 1u);
    return;
  }
  // Those that are left, in one addition.
  const uint num_here = subgroupBallotBitCount(subgroupBallot(true));
  if (subgroupElect()) atomicAdd(num_confirmed[block], num_here);
  const vec4 measured_normal = imageLoad(candidate, int(said));
  float share;
  const Surfel merged = Merged(i, block, said, measured_normal, share);
  position_radius[i] = merged.position_radius;
  normal_weight[i] = merged.normal_weight;
  history[i] = MergedHistory(of_surfel, said, share, measured_normal.w);
}
