// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/host/host_kernels.h"
#include "fusion/host/view_host.h"

#if MONO3D_HAS_AVX2
#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#endif

namespace mono3d {

#if MONO3D_HAS_AVX2
namespace {

using host::Dot;
using host::Select;
using host::Splat;

// The bindings of merge.comp. Three of them are there twice, to read and to write.
struct MergeBuffers {
  explicit MergeBuffers(const HostDispatch& dispatch)
      : association(dispatch.BufferAs<const std::uint32_t>(0)),
        depth(dispatch.BufferAs<const float>(1)),
        candidate(dispatch.BufferAs<const float>(2)),
        colour(dispatch.BufferAs<const std::uint32_t>(3)),
        blocks(dispatch.BufferAs<const std::uint32_t>(7)),
        anchor_of_block(dispatch.BufferAs<const std::uint32_t>(8)),
        anchors(dispatch.BufferAs<const float>(9)),
        position_radius(dispatch.BufferAs<float>(10)),
        normal_weight(dispatch.BufferAs<float>(11)),
        history(dispatch.BufferAs<Surfels::Uint4>(12)),
        num_confirmed(dispatch.BufferAs<std::uint32_t>(13)),
        num_removed(dispatch.BufferAs<std::uint32_t>(14)) {}

  const std::uint32_t* association;
  const float* depth;
  const float* candidate;
  const std::uint32_t* colour;
  const std::uint32_t* blocks;
  const std::uint32_t* anchor_of_block;
  const float* anchors;
  float* position_radius;
  float* normal_weight;
  Surfels::Uint4* history;
  std::uint32_t* num_confirmed;
  std::uint32_t* num_removed;
};

std::uint32_t Packed16(std::uint32_t low, std::uint32_t high) {
  return std::min(low, 0xFFFFU) | std::min(high, 0xFFFFU) << 16;
}

// SpeaksAgainst of free_space.glsl, for an association that does.
void NoteAgainst(std::uint32_t said, Surfels::Uint4& history) {
  const std::uint32_t confidence = said & 0xFFU;  // in 1/255
  std::uint32_t seen_through = (history[1] >> 16) & 0xFFU;
  std::uint32_t hidden = history[1] >> 24;
  if (Says(said, kSeenThrough)) {
    seen_through = std::min(seen_through + (8 * confidence + 127) / 255, 255U);
  } else {
    hidden = std::min(hidden + confidence, 255U);
  }
  history[1] = Low16(history[1]) | seen_through << 16 | hidden << 24;
}

bool IsRefuted(const Surfels::Uint4& history) {
  std::uint32_t against = SeenThroughAgainst(history);
  if (Low16(history[1]) == 1) against += HiddenAgainst(history);
  return against >= ConfidenceFor(history);
}

// MergedColour of merge.comp, of one channel of 10 bits.
std::uint32_t MergedChannel(std::uint32_t old, std::uint32_t measured, float share) {
  constexpr std::uint32_t kClipped = 1020;
  const auto before = static_cast<float>(old);
  const auto now = static_cast<float>(measured);
  float merged = before * (1.0F - share) + now * share;
  if (old >= kClipped) merged = now;
  if (measured >= kClipped) merged = before;
  return static_cast<std::uint32_t>(std::clamp(merged, 0.0F, 1023.0F) + 0.5F);
}

// `colour`: of the pixel, as insert.comp reads it.
Surfels::Uint4 MergedHistory(const Surfels::Uint4& old, std::uint32_t colour, float share,
                             float confidence, std::uint32_t map_index) {
  std::uint32_t merged = (old[0] | colour << 6) & kCoarseMatch;
  for (std::uint32_t channel = 0; channel < 3; ++channel) {
    const std::uint32_t measured = 4 * (colour >> (8 * channel) & 0xFFU);
    merged |= MergedChannel(old[0] >> (10 * channel) & 0x3FFU, measured, share) << (10 * channel);
  }
  const auto steps = static_cast<std::uint32_t>(confidence * 256.0F + 0.5F);
  return {merged, Packed16(Low16(old[1]) + 1, High16(old[1])), Packed16(Low16(old[2]), map_index),
          Packed16(Low16(old[3]), High16(old[3]) + steps)};
}

// Merged of merge.comp, of those of the eight surfels from `first` on that have a pixel.
MONO3D_AVX2 inline void MergeSurfels(const ViewParams& view, const MergeBuffers& buffers,
                                     const host::CameraFromAnchor& from, std::size_t first,
                                     unsigned lanes) {
  alignas(32) std::array<std::int32_t, host::kLanes> pixels{};
  for (unsigned left = lanes; left != 0; left &= left - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(left));
    pixels[i] = static_cast<std::int32_t>(buffers.association[first + i]);
  }
  const __m256i pixel = _mm256_load_si256(reinterpret_cast<const __m256i*>(pixels.data()));
  const host::Vec4 measured_normal = host::GatherVec4(buffers.candidate, pixels.data());
  const __m256 measured_depth = _mm256_i32gather_ps(buffers.depth, pixel, 4);
  const host::Vec4 old_normal = host::LoadVec4(buffers.normal_weight + 4 * first);
  const host::Vec4 old_position = host::LoadVec4(buffers.position_radius + 4 * first);

  const __m256 one = Splat(1.0F);
  const host::Vec3 n_cam = {measured_normal.x, measured_normal.y, measured_normal.z};
  const host::Vec3 p_cam =
      host::PointToCamera(from, {old_position.x, old_position.y, old_position.z});
  const host::Vec3 ray = {p_cam.x / p_cam.z, p_cam.y / p_cam.z, one};
  const host::Vec3 pixel_ray = host::RayOf(view, host::ColumnAndRow(view, pixel));

  const __m256 old_weight = host::WeightToCamera(from, old_normal.w);
  const __m256 w = one / p_cam.z;
  const __m256 measured =
      host::TangentPlaneInverseDepth(n_cam, pixel_ray, one / measured_depth, ray);
  // Information on depth, 1/su^2: sigma(z) = sigma(w) z^2.
  const __m256 sigma = host::InverseDepthSigma(view, measured) / (measured * measured);
  const __m256 weight = measured_normal.w / (sigma * sigma);
  const __m256 share = weight / (weight + old_weight);
  // In inverse depth information is z^4 times as much.
  const __m256 ratio = w / measured;
  const __m256 weight_here = weight * ratio * ratio * ratio * ratio;
  const __m256 share_in_inverse_depth = weight_here / (weight_here + old_weight);
  const __m256 merged = w + share_in_inverse_depth * (measured - w);

  const host::Vec3 to_anchor = host::DirectionToAnchor(from, n_cam);
  const __m256 rest = one - share;
  const host::Vec3 normal = {old_normal.x * rest + to_anchor.x * share,
                             old_normal.y * rest + to_anchor.y * share,
                             old_normal.z * rest + to_anchor.z * share};
  const __m256 over_length = one / _mm256_sqrt_ps(Dot(normal, normal));
  // SurfelRadius of view.glsl.
  const __m256 cosine = _mm256_xor_ps(Dot(n_cam, pixel_ray), Splat(-0.0F)) /
                        _mm256_sqrt_ps(Dot(pixel_ray, pixel_ray));
  const __m256 radius = Splat(1.41421356F) * measured_depth / Splat(std::min(view.fx, view.fy)) /
                        _mm256_max_ps(cosine, Splat(1.0F / 4.0F)) *
                        Splat(static_cast<float>(view.merge_radius_px));
  const host::Vec3 position =
      host::PointToAnchor(from, {ray.x / merged, ray.y / merged, ray.z / merged});
  host::StoreVec4(
      buffers.position_radius + 4 * first,
      {position.x, position.y, position.z, _mm256_min_ps(old_position.w, radius / from.scale)},
      lanes);
  host::StoreVec4(buffers.normal_weight + 4 * first,
                  {normal.x * over_length, normal.y * over_length, normal.z * over_length,
                   old_normal.w + host::WeightToAnchor(from, weight)},
                  lanes);
  alignas(32) std::array<float, host::kLanes> shares;
  alignas(32) std::array<float, host::kLanes> confidences;
  _mm256_store_ps(shares.data(), share);
  _mm256_store_ps(confidences.data(), measured_normal.w);
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(lanes));
    Surfels::Uint4& history = buffers.history[first + i];
    history = MergedHistory(history, buffers.colour[pixels[i]], shares[i], confidences[i],
                            view.map_index);
  }
}

MONO3D_AVX2 void MergeBlocks(const HostDispatch& dispatch, std::uint32_t part,
                             std::uint32_t num_parts) {
  const auto view = dispatch.PushAs<ViewParams>();
  const MergeBuffers buffers(dispatch);
  std::uint32_t num_removed = 0;
  const HostShare share = ShareOf(dispatch.num_workgroups, 1, part, num_parts);
  for (std::uint32_t listed = share.first; listed < share.end; ++listed) {
    const std::uint32_t block = buffers.blocks[listed];
    const std::uint64_t first_of_block = std::uint64_t{block} * kSurfelsPerBlock;
    if (first_of_block >= view.num_surfels) continue;
    const host::CameraFromAnchor from =
        host::FromAnchor(buffers.anchors, buffers.anchor_of_block[block]);
    std::uint32_t num_confirmed = 0;
    for (std::uint32_t lane = 0; lane < kSurfelsPerBlock; lane += host::kLanes) {
      const auto first = static_cast<std::uint32_t>(first_of_block) + lane;
      unsigned confirmed = 0;
      for (std::uint32_t i = 0; i < host::kLanes && first + i < view.num_surfels; ++i) {
        const std::uint32_t said = buffers.association[first + i];
        if (IsPixel(said)) {
          confirmed |= 1U << i;
        } else if (said != kUnseen) {
          Surfels::Uint4& history = buffers.history[first + i];
          NoteAgainst(said, history);
          if (!IsRefuted(history)) continue;
          std::fill_n(buffers.normal_weight + 4 * std::size_t{first + i}, 4, 0.0F);
          ++num_removed;
        }
      }
      if (confirmed == 0) continue;
      num_confirmed += static_cast<std::uint32_t>(std::popcount(confirmed));
      MergeSurfels(view, buffers, from, first, confirmed);
    }
    if (num_confirmed > 0) buffers.num_confirmed[block] += num_confirmed;
  }
  if (num_removed > 0) __atomic_fetch_add(buffers.num_removed, num_removed, __ATOMIC_RELAXED);
}

}  // namespace

const HostKernel kMergeOnHost = MergeBlocks;
#else
const HostKernel kMergeOnHost = nullptr;
#endif

}  // namespace mono3d
