// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/dog.params.h"
#include "depth/host/host_kernels.h"
#include "depth/padded_image.h"
#include "gpu/host_simd.h"

#if MONO3D_HAS_AVX2
#include <cstddef>
#include <cstdint>
#include <vector>
#endif

namespace mono3d {

#if MONO3D_HAS_AVX2
namespace {

constexpr std::size_t kDogReach = 4;  // pixels of the wide kernel on each side

// Sums down the columns of nine rows, of the wide kernel and of the narrow one.
struct DogColumns {
  explicit DogColumns(std::size_t num) : wide(num), narrow(num) {}

  std::vector<std::uint16_t> wide, narrow;
};

MONO3D_AVX2 inline __m128i LoadGreys(const std::uint8_t* from) {
  return _mm_cvtepu8_epi16(_mm_loadl_epi64(reinterpret_cast<const __m128i*>(from)));
}
// Both values at a distance.
MONO3D_AVX2 inline __m128i GreysAt(const std::uint8_t* middle, std::ptrdiff_t distance_bytes) {
  return _mm_add_epi16(LoadGreys(middle - distance_bytes), LoadGreys(middle + distance_bytes));
}
MONO3D_AVX2 inline __m128i Times(__m128i values, short factor) {
  return _mm_mullo_epi16(values, _mm_set1_epi16(factor));
}

// Of the 8 columns from `column` on; `middle` is the middle row there.
MONO3D_AVX2 inline void SumDogColumns(const std::uint8_t* middle, std::ptrdiff_t row_bytes,
                                      std::size_t column, DogColumns& sums) {
  const __m128i here = LoadGreys(middle);
  const __m128i next = GreysAt(middle, row_bytes);
  const __m128i second = GreysAt(middle, 2 * row_bytes);
  const __m128i outer =
      _mm_add_epi16(GreysAt(middle, 4 * row_bytes), Times(GreysAt(middle, 3 * row_bytes), 8));
  const __m128i inner = _mm_add_epi16(Times(next, 56), Times(here, 70));
  const __m128i wide = _mm_add_epi16(_mm_add_epi16(outer, Times(second, 28)), inner);
  const __m128i narrow = _mm_add_epi16(second, _mm_add_epi16(Times(next, 4), Times(here, 6)));
  _mm_storeu_si128(reinterpret_cast<__m128i*>(sums.wide.data() + column), wide);
  _mm_storeu_si128(reinterpret_cast<__m128i*>(sums.narrow.data() + column), narrow);
}

MONO3D_AVX2 inline __m256i LoadSums(const std::uint16_t* from) {
  return _mm256_cvtepu16_epi32(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from)));
}
MONO3D_AVX2 inline __m256i SumsAt(const std::uint16_t* middle, std::size_t distance) {
  return _mm256_add_epi32(LoadSums(middle - distance), LoadSums(middle + distance));
}
MONO3D_AVX2 inline __m256i Times(__m256i values, int factor) {
  return _mm256_mullo_epi32(values, host::Splat(factor));
}

// Of the 8 pixels whose windows begin at `column`.
MONO3D_AVX2 inline __m256i Response(const DogColumns& sums, std::size_t column) {
  const std::uint16_t* const w = sums.wide.data() + column + kDogReach;
  const std::uint16_t* const n = sums.narrow.data() + column + kDogReach;
  const __m256i outer = _mm256_add_epi32(SumsAt(w, 4), Times(SumsAt(w, 3), 8));
  const __m256i inner = _mm256_add_epi32(Times(SumsAt(w, 1), 56), Times(LoadSums(w), 70));
  const __m256i wide = _mm256_add_epi32(_mm256_add_epi32(outer, Times(SumsAt(w, 2), 28)), inner);
  const __m256i narrow = _mm256_add_epi32(
      SumsAt(n, 2), _mm256_add_epi32(Times(SumsAt(n, 1), 4), Times(LoadSums(n), 6)));
  const __m256i difference = _mm256_sub_epi32(_mm256_slli_epi32(narrow, 8), wide);
  return _mm256_srli_epi32(_mm256_abs_epi32(difference), 8);
}

MONO3D_AVX2 void RunDog(const HostDispatch& dispatch, std::uint32_t part, std::uint32_t num_parts) {
  const auto push = dispatch.PushAs<DogParams>();
  const LevelSize size{push.width_px, push.height_px};
  const std::size_t row_bytes = 4 * std::size_t{PaddedWordsPerRow(size)};
  const std::size_t num = 4 * std::size_t{size.groups_per_row()};
  DogColumns sums(row_bytes + host::kLanes);
  const HostShare rows = ShareOf(size.height_px, 1, part, num_parts);
  for (std::uint32_t y = rows.first; y < rows.end; ++y) {
    const std::uint8_t* const middle =
        dispatch.BufferAs<const std::uint8_t>(0) + (y + kImagePadding) * row_bytes;
    // Rows have 8 bytes and more; the last ones overlap those before.
    for (std::size_t x = 0; x < row_bytes; x += host::kLanes) {
      const std::size_t column = x + host::kLanes <= row_bytes ? x : row_bytes - host::kLanes;
      SumDogColumns(middle + column, static_cast<std::ptrdiff_t>(row_bytes), column, sums);
    }
    auto* const to = dispatch.BufferAs<std::uint32_t>(1) + y * num;
    for (std::size_t x = 0; x < num; x += host::kLanes) {
      const __m256i response = Response(sums, x);
      if (x + host::kLanes <= num) {
        _mm256_storeu_si256(reinterpret_cast<__m256i*>(to + x), response);
      } else {
        _mm_storeu_si128(reinterpret_cast<__m128i*>(to + x), _mm256_castsi256_si128(response));
      }
    }
  }
}

}  // namespace

const HostKernel kDogOnHost = RunDog;
#else
const HostKernel kDogOnHost = nullptr;
#endif

}  // namespace mono3d
