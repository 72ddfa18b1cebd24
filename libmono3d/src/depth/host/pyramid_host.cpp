// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/host/host_kernels.h"
#include "depth/padded_image.h"
#include "depth/pyramid.params.h"
#include "gpu/host_simd.h"

#if MONO3D_HAS_AVX2
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>
#endif

namespace mono3d {

#if MONO3D_HAS_AVX2
namespace {

MONO3D_AVX2 inline __m256i LoadBytes16(const std::uint8_t* from) {
  return _mm256_cvtepu8_epi16(_mm_loadu_si128(reinterpret_cast<const __m128i*>(from)));
}

// (1 3 3 1) down the columns of four rows that follow each other, 16 at a time, as many as cover
// `num`.
MONO3D_AVX2 void SumColumns(const std::uint8_t* rows, std::size_t row_bytes, std::size_t num,
                            std::uint16_t* sums) {
  const __m256i three = _mm256_set1_epi16(3);
  for (std::size_t x = 0; x < num; x += 16) {
    // The last ones overlap those before.
    const std::size_t first = std::min(x, num - 16);
    const std::uint8_t* const at = rows + first;
    const __m256i outer = _mm256_add_epi16(LoadBytes16(at), LoadBytes16(at + 3 * row_bytes));
    const __m256i inner =
        _mm256_add_epi16(LoadBytes16(at + row_bytes), LoadBytes16(at + 2 * row_bytes));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(sums + first),
                        _mm256_add_epi16(outer, _mm256_mullo_epi16(three, inner)));
  }
}

MONO3D_AVX2 inline __m256i LoadPairs(const std::uint16_t* from) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
}

// The same along a row of sums, at every second column, and rounded: pixel i from columns 2 i - 1
// to 2 i + 2. Eight at a time, as many as cover `num`; `sums` goes on for 16 columns beyond those.
MONO3D_AVX2 void SumRow(const std::uint16_t* sums, std::size_t num, std::uint8_t* pixels) {
  const __m256i three = host::Splat(3);
  const __m256i low = host::Splat(0xffff);
  for (std::size_t i = 0; i < num; i += host::kLanes) {
    const std::uint16_t* const at = sums + 2 * i;
    const __m256i here = LoadPairs(at);
    const __m256i inner =
        _mm256_add_epi32(_mm256_and_si256(here, low), _mm256_srli_epi32(here, 16));
    const __m256i outer = _mm256_add_epi32(_mm256_srli_epi32(LoadPairs(at - 2), 16),
                                           _mm256_and_si256(LoadPairs(at + 2), low));
    const __m256i sum = _mm256_add_epi32(outer, _mm256_mullo_epi32(three, inner));
    const __m256i rounded = _mm256_srli_epi32(_mm256_add_epi32(sum, host::Splat(32)), 6);
    const __m128i words =
        _mm_packus_epi32(_mm256_castsi256_si128(rounded), _mm256_extracti128_si256(rounded, 1));
    _mm_storel_epi64(reinterpret_cast<__m128i*>(pixels + i), _mm_packus_epi16(words, words));
  }
}

void RunPyramid(const HostDispatch& dispatch, std::uint32_t part, std::uint32_t num_parts) {
  const auto push = dispatch.PushAs<PyramidParams>();
  const LevelSize fine{push.fine_width_px, push.fine_height_px};
  const LevelSize coarse = fine.Halved();
  const std::size_t fine_bytes = 4 * std::size_t{PaddedWordsPerRow(fine)};
  const std::size_t coarse_bytes = 4 * std::size_t{PaddedWordsPerRow(coarse)};
  // The dispatch has a layer of workgroups for each image.
  const std::uint32_t groups_of_layer = (PaddedWordsPerRow(coarse) + 63) / 64 * PaddedRows(coarse);
  const std::uint32_t num_images = dispatch.num_workgroups / groups_of_layer;
  // Rows of less than 16 bytes are read on into the next one: there are two more below.
  const std::size_t num_sums = std::max<std::size_t>(fine_bytes, 16);
  std::vector<std::uint16_t> sums(num_sums + 32);
  std::vector<std::uint8_t> pixels(coarse.width_px + host::kLanes);
  const HostShare rows = ShareOf(num_images * coarse.height_px, 1, part, num_parts);
  for (std::uint32_t i = rows.first; i < rows.end; ++i) {
    const std::size_t image = i / coarse.height_px;
    const std::size_t y = i % coarse.height_px;
    const std::uint8_t* const from = dispatch.BufferAs<const std::uint8_t>(0) +
                                     4 * image * PaddedWords(fine) +
                                     (2 * y + kImagePadding - 1) * fine_bytes;
    SumColumns(from, fine_bytes, num_sums, sums.data());
    SumRow(sums.data() + kImagePadding, coarse.width_px, pixels.data());

    std::uint8_t* const image_to =
        dispatch.BufferAs<std::uint8_t>(1) + 4 * image * PaddedWords(coarse);
    std::uint8_t* const to = image_to + (y + kImagePadding) * coarse_bytes;
    std::fill_n(to, kImagePadding, pixels[0]);
    std::copy_n(pixels.data(), coarse.width_px, to + kImagePadding);
    std::fill(to + kImagePadding + coarse.width_px, to + coarse_bytes, pixels[coarse.width_px - 1]);
    for (std::uint32_t row = 0; row < kImagePadding; ++row) {
      if (y == 0) std::memcpy(image_to + row * coarse_bytes, to, coarse_bytes);
      if (y + 1 == coarse.height_px) std::memcpy(to + (row + 1) * coarse_bytes, to, coarse_bytes);
    }
  }
}

}  // namespace

const HostKernel kPyramidOnHost = RunPyramid;
#else
const HostKernel kPyramidOnHost = nullptr;
#endif

}  // namespace mono3d
