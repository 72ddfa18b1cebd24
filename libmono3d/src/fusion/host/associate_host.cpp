// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/host/host_kernels.h"
#include "fusion/host/view_host.h"

#if MONO3D_HAS_AVX2
#include <algorithm>
#include <array>
#include <bit>
#endif

namespace mono3d {

#if MONO3D_HAS_AVX2
namespace {

using host::Dot;
using host::Less;
using host::LessOrEqual;
using host::Select;
using host::Splat;

// The bindings of associate.comp and of associate_draw.comp.
struct AssociateBuffers {
  explicit AssociateBuffers(const HostDispatch& dispatch)
      : position_radius(dispatch.BufferAs<const float>(0)),
        normal_weight(dispatch.BufferAs<const float>(1)),
        depth(dispatch.BufferAs<const float>(2)),
        candidate(dispatch.BufferAs<const float>(3)),
        blocks(dispatch.BufferAs<const std::uint32_t>(4)),
        anchor_of_block(dispatch.BufferAs<const std::uint32_t>(5)),
        anchors(dispatch.BufferAs<const float>(6)),
        association(dispatch.BufferAs<std::uint32_t>(7)) {}

  const float* position_radius;
  const float* normal_weight;
  const float* depth;
  const float* candidate;
  const std::uint32_t* blocks;
  const std::uint32_t* anchor_of_block;
  const float* anchors;
  std::uint32_t* association;
};

// EvidenceAgainst of associate.glsl, of one surfel.
std::uint32_t EvidenceAgainst(const ViewParams& view, const AssociateBuffers& buffers,
                              std::int32_t pixel, float inverse_depth, float weight,
                              bool faces_away) {
  const auto width = static_cast<std::int32_t>(view.width_px);
  const std::int32_t x = pixel % width;
  const std::int32_t y = pixel / width;
  if (x < 1 || y < 1 || x >= width - 1 || y >= static_cast<std::int32_t>(view.height_px) - 1) {
    return kUnseen;
  }
  bool seen_through = true;
  bool hidden = !faces_away;
  float confidence = 1.0F;
  for (std::int32_t v = y - 1; v <= y + 1; ++v) {
    for (std::int32_t u = x - 1; u <= x + 1; ++u) {
      const std::ptrdiff_t at = std::ptrdiff_t{v} * width + u;
      const float z = buffers.depth[at];
      if (!(z > 0)) return kUnseen;
      const float measured = 1.0F / z;
      const float limit =
          view.free_space_sigmas * host::JointSigma(view, measured, inverse_depth, weight);
      const float in_front = inverse_depth - measured;
      seen_through = seen_through && in_front > limit;
      hidden = hidden && -in_front > limit;
      if (!seen_through && !hidden) return kUnseen;
      confidence = std::min(confidence, buffers.candidate[4 * at + 3]);
    }
  }
  return (seen_through ? kSeenThrough : kHidden) |
         static_cast<std::uint32_t>(confidence * 255.0F + 0.5F);
}

// Eight surfels of one anchor.
struct PlacedSurfels {
  __m256 exists;  // was not removed
  host::Vec3 p_cam, n_cam;
  host::Vec2 at;  // where they fall, px
  __m256 weight;
};

MONO3D_AVX2 inline PlacedSurfels Place(const ViewParams& view, const AssociateBuffers& buffers,
                                       const host::CameraFromAnchor& from, std::size_t first) {
  const host::Vec4 normal = host::LoadVec4(buffers.normal_weight + 4 * first);
  const host::Vec4 position = host::LoadVec4(buffers.position_radius + 4 * first);
  PlacedSurfels placed;
  placed.exists = Less(_mm256_setzero_ps(), normal.w);
  placed.p_cam = host::PointToCamera(from, {position.x, position.y, position.z});
  placed.n_cam = host::DirectionToCamera(from, {normal.x, normal.y, normal.z});
  placed.at = host::Project(view, placed.p_cam);
  placed.weight = host::WeightToCamera(from, normal.w);
  return placed;
}

// What the pixels on which they fall say of them, to `said`.
MONO3D_AVX2 inline void Associate(const ViewParams& view, const AssociateBuffers& buffers,
                                  const PlacedSurfels& placed, std::uint32_t* said) {
  const __m256 zero = _mm256_setzero_ps();
  const auto width = static_cast<float>(view.width_px);
  const auto height = static_cast<float>(view.height_px);
  const host::Vec2 rounded = {_mm256_floor_ps(placed.at.x + Splat(0.5F)),
                              _mm256_floor_ps(placed.at.y + Splat(0.5F))};
  __m256 asks = _mm256_and_ps(placed.exists, Less(zero, placed.p_cam.z));
  asks = _mm256_and_ps(asks,
                       _mm256_and_ps(LessOrEqual(zero, rounded.x), Less(rounded.x, Splat(width))));
  asks = _mm256_and_ps(asks,
                       _mm256_and_ps(LessOrEqual(zero, rounded.y), Less(rounded.y, Splat(height))));
  const __m256i unseen = Splat(-1);
  auto* const to = reinterpret_cast<__m256i*>(said);
  if (host::BitsOf(asks) == 0) {
    _mm256_storeu_si256(to, unseen);
    return;
  }
  const __m256i pixels =
      _mm256_and_si256(_mm256_castps_si256(asks),
                       _mm256_add_epi32(_mm256_mullo_epi32(_mm256_cvttps_epi32(rounded.y),
                                                           Splat(static_cast<int>(view.width_px))),
                                        _mm256_cvttps_epi32(rounded.x)));
  alignas(32) std::array<std::int32_t, host::kLanes> pixel;
  _mm256_store_si256(reinterpret_cast<__m256i*>(pixel.data()), pixels);
  const host::Vec4 candidate = host::GatherVec4(buffers.candidate, pixel.data());
  const host::Vec3 measured_normal = {candidate.x, candidate.y, candidate.z};
  asks = _mm256_and_ps(asks, Less(zero, candidate.w));

  const __m256 one = Splat(1.0F);
  const __m256 measured = one / _mm256_i32gather_ps(buffers.depth, pixels, 4);
  const __m256 inverse_depth = one / placed.p_cam.z;
  const host::Vec3 ray = {placed.p_cam.x / placed.p_cam.z, placed.p_cam.y / placed.p_cam.z, one};
  const __m256 expected =
      host::TangentPlaneInverseDepth(measured_normal, host::RayOf(view, rounded), measured, ray);
  const __m256 sigma = host::JointSigma(view, measured, inverse_depth, placed.weight);
  const __m256 near =
      LessOrEqual(host::Abs(inverse_depth - expected), Splat(view.association_sigmas) * sigma);
  const __m256 alike =
      LessOrEqual(Splat(view.min_normal_cosine), Dot(placed.n_cam, measured_normal));
  const __m256 confirms = _mm256_and_ps(asks, _mm256_and_ps(near, alike));
  _mm256_storeu_si256(to, _mm256_blendv_epi8(unseen, pixels, _mm256_castps_si256(confirms)));

  unsigned others = host::BitsOf(_mm256_andnot_ps(near, asks));
  if (others == 0) return;
  const unsigned faces_away = host::BitsOf(LessOrEqual(zero, Dot(placed.n_cam, placed.p_cam)));
  alignas(32) std::array<float, host::kLanes> inverse_depths;
  alignas(32) std::array<float, host::kLanes> weights;
  _mm256_store_ps(inverse_depths.data(), inverse_depth);
  _mm256_store_ps(weights.data(), placed.weight);
  for (; others != 0; others &= others - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(others));
    said[i] = EvidenceAgainst(view, buffers, pixel[i], inverse_depths[i], weights[i],
                              (faces_away >> i & 1U) != 0);
  }
}

// A surfel of depth `depth` at place `item` of the list, where it is the nearest so far. All of one
// cell by several threads.
inline void DrawInCell(std::uint64_t& cell, float depth, std::uint32_t item) {
  const std::uint64_t drawn = std::uint64_t{std::bit_cast<std::uint32_t>(depth)} << 32 | item;
  std::uint64_t before = __atomic_load_n(&cell, __ATOMIC_RELAXED);
  while (drawn < before && !__atomic_compare_exchange_n(&cell, &before, drawn, true,
                                                        __ATOMIC_RELAXED, __ATOMIC_RELAXED)) {
  }
}

// index_cell.glsl, of those of eight surfels whose bit is set; the first is `item` of the list.
MONO3D_AVX2 inline void Draw(const ViewParams& view, const PlacedSurfels& placed,
                             const std::uint32_t* said, unsigned lanes, std::uint32_t item,
                             std::uint64_t* index_map) {
  const __m256 zero = _mm256_setzero_ps();
  const std::uint32_t width = view.width_px * kIndexCellsPerPixel;
  const std::uint32_t height = view.height_px * kIndexCellsPerPixel;
  const __m256 per_pixel = Splat(static_cast<float>(kIndexCellsPerPixel));
  const host::Vec2 cell = {_mm256_floor_ps((placed.at.x + Splat(0.5F)) * per_pixel),
                           _mm256_floor_ps((placed.at.y + Splat(0.5F)) * per_pixel)};
  __m256 draws = _mm256_and_ps(placed.exists, Less(zero, placed.p_cam.z));
  draws = _mm256_and_ps(draws, Less(Dot(placed.n_cam, placed.p_cam), zero));
  draws = _mm256_and_ps(draws, _mm256_and_ps(LessOrEqual(zero, cell.x),
                                             Less(cell.x, Splat(static_cast<float>(width)))));
  draws = _mm256_and_ps(draws, _mm256_and_ps(LessOrEqual(zero, cell.y),
                                             Less(cell.y, Splat(static_cast<float>(height)))));
  lanes &= host::BitsOf(draws);
  if (lanes == 0) return;
  alignas(32) std::array<std::int32_t, host::kLanes> cells;
  alignas(32) std::array<float, host::kLanes> depths;
  _mm256_store_si256(reinterpret_cast<__m256i*>(cells.data()),
                     _mm256_add_epi32(_mm256_mullo_epi32(_mm256_cvttps_epi32(cell.y),
                                                         Splat(static_cast<int>(width))),
                                      _mm256_cvttps_epi32(cell.x)));
  _mm256_store_ps(depths.data(), placed.p_cam.z);
  for (; lanes != 0; lanes &= lanes - 1) {
    const auto i = static_cast<std::size_t>(std::countr_zero(lanes));
    if (Says(said[i], kSeenThrough)) continue;
    DrawInCell(index_map[cells[i]], depths[i], item + static_cast<std::uint32_t>(i));
  }
}

template <bool kDraws>
MONO3D_AVX2 void AssociateBlocks(const HostDispatch& dispatch, std::uint32_t part,
                                 std::uint32_t num_parts) {
  const auto view = dispatch.PushAs<ViewParams>();
  const AssociateBuffers buffers(dispatch);
  auto* const index_map = kDraws ? dispatch.BufferAs<std::uint64_t>(8) : nullptr;
  const std::uint32_t first_surfel = kDraws ? 0 : view.first_surfel;
  const HostShare share = ShareOf(dispatch.num_workgroups, 1, part, num_parts);
  for (std::uint32_t listed = share.first; listed < share.end; ++listed) {
    // Beyond the model in the last row of workgroups.
    const std::uint64_t first_of_block = std::uint64_t{buffers.blocks[listed]} * kSurfelsPerBlock;
    if (first_of_block >= view.num_surfels) continue;
    const host::CameraFromAnchor from =
        host::FromAnchor(buffers.anchors, buffers.anchor_of_block[buffers.blocks[listed]]);
    for (std::uint32_t lane = 0; lane < kSurfelsPerBlock; lane += host::kLanes) {
      const auto first = static_cast<std::uint32_t>(first_of_block) + lane;
      unsigned lanes = 0;
      for (std::uint32_t i = 0; i < host::kLanes; ++i) {
        const bool asks = first + i >= first_surfel && first + i < view.num_surfels;
        lanes |= (asks ? 1U : 0U) << i;
      }
      if (lanes == 0) continue;
      const PlacedSurfels placed = Place(view, buffers, from, first);
      alignas(32) std::array<std::uint32_t, host::kLanes> said;
      Associate(view, buffers, placed, said.data());
      for (std::size_t i = 0; i < host::kLanes; ++i) {
        if ((lanes >> i & 1U) != 0) buffers.association[first + i] = said[i];
      }
      if constexpr (kDraws) {
        Draw(view, placed, said.data(), lanes, listed * kSurfelsPerBlock + lane, index_map);
      }
    }
  }
}

}  // namespace

const HostKernel kAssociateOnHost = AssociateBlocks<false>;
const HostKernel kAssociateDrawOnHost = AssociateBlocks<true>;
#else
const HostKernel kAssociateOnHost = nullptr;
const HostKernel kAssociateDrawOnHost = nullptr;
#endif

}  // namespace mono3d
