// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/fine_census.params.h"
#include "depth/fine_volume.h"
#include "depth/host/host_kernels.h"
#include "gpu/host_simd.h"

#if MONO3D_HAS_AVX2
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>
#endif

namespace mono3d {

#if MONO3D_HAS_AVX2
namespace {

constexpr std::size_t kCensusLanes = 32;  // pixels at once

constexpr int kCensusReach = 4;  // px, of a window turned by one quarter, in rows

// The 32 neighbours in the order of their bits: of even rows of the window four, of odd ones five;
// in a picture that is turned by quarters (census.glsl), where it shows them.
struct CensusPattern {
  struct Neighbour {
    int x, y;
  };
  std::array<Neighbour, 32> neighbours{};

  explicit constexpr CensusPattern(unsigned quarter_turns) {
    std::size_t i = 0;
    for (int y = -3; y <= 3; ++y) {
      for (int x = y % 2 == 0 ? -3 : -4; x <= 4; x += 2) {
        Neighbour neighbour{x, y};
        for (unsigned turn = 0; turn < quarter_turns; ++turn) {
          neighbour = {-neighbour.y, neighbour.x};
        }
        neighbours[i++] = neighbour;
      }
    }
  }
};

// Of the 32 pixels from `centre` on.
template <unsigned kQuarterTurns>
MONO3D_AVX2 inline void CensusOfPixels(const std::uint8_t* centre, std::ptrdiff_t row_bytes,
                                       std::uint32_t* words) {
  static constexpr CensusPattern kPattern(kQuarterTurns);
  const auto load = [](const std::uint8_t* from) { return reinterpret_cast<const __m256i*>(from); };
  const __m256i here = _mm256_loadu_si256(load(centre));
  __m256i bytes[4];
  for (std::size_t byte = 0; byte < 4; ++byte) {
    bytes[byte] = _mm256_setzero_si256();
    for (std::size_t bit = 0; bit < 8; ++bit) {
      const auto [x, y] = kPattern.neighbours[8 * byte + bit];
      const __m256i there = _mm256_loadu_si256(load(centre + y * row_bytes + x));
      const __m256i not_darker = _mm256_cmpeq_epi8(_mm256_max_epu8(there, here), there);
      const __m256i value = _mm256_set1_epi8(static_cast<char>(1U << bit));
      bytes[byte] = _mm256_or_si256(bytes[byte], _mm256_andnot_si256(not_darker, value));
    }
  }
  const __m256i low_01 = _mm256_unpacklo_epi8(bytes[0], bytes[1]);   // pixels 0-7, 16-23
  const __m256i high_01 = _mm256_unpackhi_epi8(bytes[0], bytes[1]);  // 8-15, 24-31
  const __m256i low_23 = _mm256_unpacklo_epi8(bytes[2], bytes[3]);
  const __m256i high_23 = _mm256_unpackhi_epi8(bytes[2], bytes[3]);
  const __m256i quarters[4] = {_mm256_unpacklo_epi16(low_01, low_23),     // 0-3, 16-19
                               _mm256_unpackhi_epi16(low_01, low_23),     // 4-7, 20-23
                               _mm256_unpacklo_epi16(high_01, high_23),   // 8-11, 24-27
                               _mm256_unpackhi_epi16(high_01, high_23)};  // 12-15, 28-31
  for (std::size_t i = 0; i < 4; ++i) {
    _mm_storeu_si128(reinterpret_cast<__m128i*>(words + 4 * i),
                     _mm256_castsi256_si128(quarters[i]));
    _mm_storeu_si128(reinterpret_cast<__m128i*>(words + 16 + 4 * i),
                     _mm256_extracti128_si256(quarters[i], 1));
  }
}

// Each word and its right neighbour's, of which `words` has one more.
MONO3D_AVX2 inline void StorePairs(const std::uint32_t* words, std::size_t num,
                                   std::uint32_t* texels) {
  for (std::size_t i = 0; i < num; i += 4) {  // rows are whole groups of four
    const __m128i here = _mm_loadu_si128(reinterpret_cast<const __m128i*>(words + i));
    const __m128i next = _mm_loadu_si128(reinterpret_cast<const __m128i*>(words + i + 1));
    auto* const to = reinterpret_cast<__m128i*>(texels + 2 * i);
    _mm_storeu_si128(to, _mm_unpacklo_epi32(here, next));
    _mm_storeu_si128(to + 1, _mm_unpackhi_epi32(here, next));
  }
}

template <unsigned kQuarterTurns>
MONO3D_AVX2 void CensusOfRow(const std::uint8_t* row, std::ptrdiff_t row_bytes, std::size_t num,
                             std::uint32_t* words) {
  if (num < kCensusLanes) {
    // Rows of a narrow image end before 32 pixels: through a copy that is as wide.
    constexpr std::ptrdiff_t kRows = 2 * kCensusReach + 1;
    constexpr std::ptrdiff_t kWindowBytes = kCensusLanes + 8;
    std::array<std::uint8_t, kRows * kWindowBytes> window{};
    for (std::ptrdiff_t y = 0; y < kRows; ++y) {
      std::copy_n(row + (y - kCensusReach) * row_bytes - 4, num + 8,
                  window.data() + y * kWindowBytes);
    }
    std::array<std::uint32_t, kCensusLanes> all;
    CensusOfPixels<kQuarterTurns>(window.data() + kCensusReach * kWindowBytes + 4, kWindowBytes,
                                  all.data());
    std::copy_n(all.data(), num, words);
    return;
  }
  for (std::size_t x = 0; x < num; x += kCensusLanes) {
    // The last ones overlap those before.
    const std::size_t first = std::min(x, num - kCensusLanes);
    CensusOfPixels<kQuarterTurns>(row + first, row_bytes, words + first);
  }
}

using CensusOfRowFunction = void (*)(const std::uint8_t*, std::ptrdiff_t, std::size_t,
                                     std::uint32_t*);
// By quarter turns.
constexpr CensusOfRowFunction kCensusOfRow[] = {CensusOfRow<0>, CensusOfRow<1>, CensusOfRow<2>,
                                                CensusOfRow<3>};

void RunFineCensus(const HostDispatch& dispatch, std::uint32_t part, std::uint32_t num_parts) {
  const auto push = dispatch.PushAs<FineCensusParams>();
  const LevelSize size{push.width_px, push.height_px};
  const std::size_t num = 4 * std::size_t{size.groups_per_row()};
  const std::size_t row_bytes = 4 * std::size_t{PaddedWordsPerRow(size)};
  // The dispatch has a layer of workgroups for each image.
  const std::uint32_t groups_of_layer =
      (size.groups_per_row() + 63) / 64 * ((size.height_px + 1) / 2);
  const std::uint32_t num_images = dispatch.num_workgroups / groups_of_layer;
  std::vector<std::uint32_t> words(num + 1);
  const HostShare rows = ShareOf(num_images * size.height_px, 1, part, num_parts);
  for (std::uint32_t i = rows.first; i < rows.end; ++i) {
    const std::size_t image = i / size.height_px;
    const std::size_t y = i % size.height_px;
    const std::uint8_t* const row = dispatch.BufferAs<const std::uint8_t>(0) +
                                    4 * image * PaddedWords(size) +
                                    (y + kImagePadding) * row_bytes + kImagePadding;
    kCensusOfRow[push.quarter_turns >> (2 * image) & 3](row, static_cast<std::ptrdiff_t>(row_bytes),
                                                        num, words.data());
    StorePairs(words.data(), num,
               dispatch.BufferAs<std::uint32_t>(1) +
                   2 * (image * NumFineCensusTexels(size) + 2 + y * num));
  }
}

}  // namespace

const HostKernel kFineCensusOnHost = RunFineCensus;
#else
const HostKernel kFineCensusOnHost = nullptr;
#endif

}  // namespace mono3d
