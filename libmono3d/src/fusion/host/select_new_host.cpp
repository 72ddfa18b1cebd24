// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/host/host_kernels.h"
#include "fusion/host/view_host.h"

#if MONO3D_HAS_AVX2
#include <array>
#include <bit>
#include <cstdint>
#endif

namespace mono3d {

#if MONO3D_HAS_AVX2
namespace {

using host::Dot;
using host::Less;
using host::LessOrEqual;
using host::Select;
using host::Splat;

// The bindings of select_new.comp.
struct SelectBuffers {
  explicit SelectBuffers(const HostDispatch& dispatch)
      : depth(dispatch.BufferAs<const float>(0)),
        candidate(dispatch.BufferAs<const float>(1)),
        index_map(dispatch.BufferAs<const std::uint32_t>(2)),
        normal_weight(dispatch.BufferAs<const float>(3)),
        anchor_of_block(dispatch.BufferAs<const std::uint32_t>(4)),
        anchors(dispatch.BufferAs<const float>(5)),
        blocks(dispatch.BufferAs<const std::uint32_t>(6)),
        surfel_blocks(dispatch.BufferAs<const std::uint32_t>(7)),
        selected(dispatch.BufferAs<std::uint32_t>(8)) {}

  const float* depth;
  const float* candidate;
  const std::uint32_t* index_map;
  const float* normal_weight;
  const std::uint32_t* anchor_of_block;
  const float* anchors;
  const std::uint32_t* blocks;  // of pixels
  const std::uint32_t* surfel_blocks;
  std::uint32_t* selected;
};

// What eight pixels look for around themselves, and the cell that comes nearest to it.
struct CellSearch {
  host::Vec3 n_cam;
  __m256 measured;        // inverse depth
  __m256 at_measurement;  // normal times ray of the pixel
  __m256 difference;      // of inverse depth, the least so far
  __m256 inverse_depth;   // there
  __m256i cell;           // all bits set: none
};

// One coordinate of the rays through the centres of cells.
MONO3D_AVX2 inline __m256 CellRay(__m256i cell, float centre, float focal) {
  const __m256 at =
      (_mm256_cvtepi32_ps(cell) + Splat(0.5F)) / Splat(static_cast<float>(kIndexCellsPerPixel)) -
      Splat(0.5F);
  return (at - Splat(centre)) / Splat(focal);
}

// Whether 0 <= cell < size.
MONO3D_AVX2 inline __m256i IsWithin(__m256i cell, int size) {
  return _mm256_andnot_si256(_mm256_cmpgt_epi32(_mm256_setzero_si256(), cell),
                             _mm256_cmpgt_epi32(Splat(size), cell));
}

// LookAt of select_new.comp. `cell`: of the index map, 0 where `is_inside` is not set.
MONO3D_AVX2 inline void LookAt(const std::uint32_t* index_map, CellSearch& search, __m256i cell,
                               __m256i is_inside, __m256 along_ray) {
  const __m256i depth_bits =
      _mm256_i32gather_epi32(reinterpret_cast<const int*>(index_map) + 1, cell, 8);
  const __m256 inverse_depth = Splat(1.0F) / _mm256_castsi256_ps(depth_bits);
  const __m256 on_plane = search.measured * (along_ray / search.at_measurement);
  const __m256 edge = Splat(-1e-3F);
  const __m256 beyond = _mm256_or_ps(Less(edge, search.at_measurement), Less(edge, along_ray));
  const __m256 difference = host::Abs(inverse_depth - Select(beyond, search.measured, on_plane));
  // Bits that are all set, of an empty cell, are no number: nothing compares with it.
  const __m256 is_better =
      _mm256_and_ps(_mm256_castsi256_ps(is_inside), Less(difference, search.difference));
  search.difference = Select(is_better, difference, search.difference);
  search.inverse_depth = Select(is_better, inverse_depth, search.inverse_depth);
  search.cell = _mm256_blendv_epi8(search.cell, cell, _mm256_castps_si256(is_better));
}

// Of eight pixels those, a bit each, around which a surfel is the same surface.
MONO3D_AVX2 inline unsigned Covered(const ViewParams& view, const SelectBuffers& buffers,
                                    const host::Vec2& pixel, const host::Vec4& candidate,
                                    __m256 measured) {
  const int per_pixel = kIndexCellsPerPixel;
  const int width = static_cast<int>(view.width_px) * per_pixel;
  const int height = static_cast<int>(view.height_px) * per_pixel;
  const int margin = per_pixel * static_cast<int>(view.merge_radius_px) - 1;
  const int num_cells = per_pixel + 2 * margin;  // along an axis
  CellSearch search;
  search.n_cam = {candidate.x, candidate.y, candidate.z};
  search.measured = measured;
  search.at_measurement = Dot(search.n_cam, host::RayOf(view, pixel));
  search.difference = Splat(3.4e38F);
  search.inverse_depth = _mm256_setzero_ps();
  search.cell = Splat(-1);
  const __m256i first_x = _mm256_sub_epi32(
      _mm256_mullo_epi32(_mm256_cvttps_epi32(pixel.x), Splat(per_pixel)), Splat(margin));
  const __m256i first_y = _mm256_sub_epi32(
      _mm256_mullo_epi32(_mm256_cvttps_epi32(pixel.y), Splat(per_pixel)), Splat(margin));
  for (int row = 0; row < num_cells; ++row) {
    const __m256i v = _mm256_add_epi32(first_y, Splat(row));
    const __m256i has_row = IsWithin(v, height);
    const __m256i first_cell = _mm256_mullo_epi32(v, Splat(width));
    const __m256 along_y = search.n_cam.y * CellRay(v, view.cy, view.fy);
    for (int column = 0; column < num_cells; ++column) {
      const __m256i u = _mm256_add_epi32(first_x, Splat(column));
      const __m256i is_inside = _mm256_and_si256(has_row, IsWithin(u, width));
      const __m256i cell = _mm256_and_si256(is_inside, _mm256_add_epi32(first_cell, u));
      const __m256 along_x = search.n_cam.x * CellRay(u, view.cx, view.fx);
      LookAt(buffers.index_map, search, cell, is_inside, along_x + along_y + search.n_cam.z);
    }
  }
  const __m256 is_found =
      _mm256_castsi256_ps(_mm256_cmpgt_epi32(search.cell, _mm256_set1_epi32(-1)));
  const unsigned found = host::BitsOf(is_found);
  if (found == 0) return 0;

  alignas(32) std::array<std::int32_t, host::kLanes> cells;
  alignas(32) std::array<std::int32_t, host::kLanes> surfels{};
  alignas(32) std::array<std::int32_t, host::kLanes> rotations{};
  alignas(32) std::array<std::int32_t, host::kLanes> translations{};
  _mm256_store_si256(reinterpret_cast<__m256i*>(cells.data()), search.cell);
  // Lanes without a surfel take one that is there, and do not count.
  const auto any = static_cast<std::size_t>(std::countr_zero(found));
  for (std::size_t i = 0; i < host::kLanes; ++i) {
    const std::int32_t cell = cells[(found >> i & 1U) != 0 ? i : any];
    const std::uint32_t listed = buffers.index_map[2 * std::size_t(cell)];
    const std::uint32_t block = buffers.surfel_blocks[listed / kSurfelsPerBlock];
    surfels[i] = static_cast<std::int32_t>(block * kSurfelsPerBlock + listed % kSurfelsPerBlock);
    rotations[i] = static_cast<std::int32_t>(2 * buffers.anchor_of_block[block]);
    translations[i] = rotations[i] + 1;
  }
  const host::Vec4 normal = host::GatherVec4(buffers.normal_weight, surfels.data());
  const host::CameraFromAnchor from =
      host::MakeCameraFromAnchor(host::GatherVec4(buffers.anchors, rotations.data()),
                                 host::GatherVec4(buffers.anchors, translations.data()));
  const __m256 sigma =
      host::JointSigma(view, measured, search.inverse_depth, host::WeightToCamera(from, normal.w));
  const __m256 near = LessOrEqual(search.difference, Splat(view.association_sigmas) * sigma);
  const __m256 alike =
      LessOrEqual(Splat(view.min_normal_cosine),
                  Dot(host::DirectionToCamera(from, {normal.x, normal.y, normal.z}), search.n_cam));
  return found & host::BitsOf(_mm256_and_ps(near, alike));
}

MONO3D_AVX2 void RunSelectNew(const HostDispatch& dispatch, std::uint32_t part,
                              std::uint32_t num_parts) {
  const auto view = dispatch.PushAs<ViewParams>();
  const SelectBuffers buffers(dispatch);
  const std::uint32_t num_pixels = view.width_px * view.height_px;
  const HostShare share = ShareOf(dispatch.num_workgroups, 1, part, num_parts);
  for (std::uint32_t listed = share.first; listed < share.end; ++listed) {
    const std::uint64_t first_of_block = std::uint64_t{buffers.blocks[listed]} * kSurfelsPerBlock;
    if (first_of_block >= num_pixels) continue;
    std::uint64_t selected = 0;  // of the block
    for (std::uint32_t lane = 0; lane < kSurfelsPerBlock; lane += host::kLanes) {
      const auto first = static_cast<std::uint32_t>(first_of_block) + lane;
      alignas(32) std::array<std::int32_t, host::kLanes> pixels{};
      unsigned lanes = 0;
      for (std::uint32_t i = 0; i < host::kLanes && first + i < num_pixels; ++i) {
        if (!(buffers.candidate[4 * std::size_t{first + i} + 3] > 0)) continue;
        lanes |= 1U << i;
        pixels[i] = static_cast<std::int32_t>(first + i);
      }
      if (lanes == 0) continue;
      const __m256i at = _mm256_load_si256(reinterpret_cast<const __m256i*>(pixels.data()));
      const __m256 measured = Splat(1.0F) / _mm256_i32gather_ps(buffers.depth, at, 4);
      const unsigned covered =
          Covered(view, buffers, host::ColumnAndRow(view, at),
                  host::GatherVec4(buffers.candidate, pixels.data()), measured);
      selected |= std::uint64_t{lanes & ~covered} << lane;
    }
    // No other block has bits in these words.
    const std::size_t word = first_of_block / 32;
    if (static_cast<std::uint32_t>(selected) != 0) {
      buffers.selected[word] |= static_cast<std::uint32_t>(selected);
    }
    if (selected >> 32 != 0) {
      buffers.selected[word + 1] |= static_cast<std::uint32_t>(selected >> 32);
    }
  }
}

}  // namespace

const HostKernel kSelectNewOnHost = RunSelectNew;
#else
const HostKernel kSelectNewOnHost = nullptr;
#endif

}  // namespace mono3d
