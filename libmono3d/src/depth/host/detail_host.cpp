// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/detail.params.h"
#include "depth/host/host_kernels.h"
#include "depth/padded_image.h"
#include "gpu/host_simd.h"

#if MONO3D_HAS_AVX2
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>
#endif

namespace mono3d {

#if MONO3D_HAS_AVX2
namespace {

// Eighths of the quarter pixels before, at and after, for the four pixels (rows) of one.
constexpr std::array<short, 4> kQuarterBefore = {3, 1, 0, 0};
constexpr std::array<short, 4> kQuarterHere = {5, 7, 7, 5};
constexpr std::array<short, 4> kQuarterAfter = {0, 0, 1, 3};

// An image, the same halved twice, and what its contrast is multiplied by.
struct DetailImage {
  const std::uint8_t* first;  // pixel
  std::ptrdiff_t row_bytes;
  const std::uint8_t* quarter_first;
  std::ptrdiff_t quarter_row_bytes;
  short gain;  // at most 4096
};

MONO3D_AVX2 inline __m128i Load16(const void* bytes) {
  return _mm_loadu_si128(static_cast<const __m128i*>(bytes));
}

// Memory of a thread. Of quarter pixels the first stands at kPad; eight at a time are worked on.
class DetailRows {
 public:
  explicit DetailRows(std::size_t num_groups)
      : num_groups_(num_groups),
        columns_(num_groups + 3 * kPad),
        means_(4 * (num_groups + kPad)),
        above_(4 * (num_groups + kPad)),
        below_(4 * (num_groups + kPad)) {}

  // Detail + 128 of row y, and of the pixel behind its last group, goes below; what was there
  // above.
  MONO3D_AVX2 void Next(const DetailImage& image, std::ptrdiff_t y) {
    above_.swap(below_);
    SumQuarterRows(image, y);
    SpreadMeans();
    const __m256i gain = _mm256_set1_epi16(image.gain);
    const std::uint8_t* const greys = image.first + y * image.row_bytes;
    for (std::size_t x = 0; x < 4 * num_groups_ + 1; x += 16) {
      const __m256i grey = _mm256_cvtepu8_epi16(Load16(greys + x));
      const __m256i mean = _mm256_loadu_si256(reinterpret_cast<const __m256i*>(means_.data() + x));
      const __m256i difference = _mm256_sub_epi16(_mm256_slli_epi16(grey, 6), mean);
      // The upper half of the product, rounded by the highest bit of the lower one.
      const __m256i product =
          _mm256_add_epi16(_mm256_mulhi_epi16(difference, gain),
                           _mm256_srli_epi16(_mm256_mullo_epi16(difference, gain), 15));
      const __m256i bytes = _mm256_permute4x64_epi64(
          _mm256_packus_epi16(_mm256_add_epi16(product, _mm256_set1_epi16(128)),
                              _mm256_setzero_si256()),
          0xd8);
      _mm_storeu_si128(reinterpret_cast<__m128i*>(below_.data() + x),
                       _mm256_castsi256_si128(bytes));
    }
  }

  // The four pixels around each corner between the two rows, as one word.
  MONO3D_AVX2 void Store(std::uint32_t* words) const {
    for (std::size_t x = 0; x < 4 * num_groups_; x += 16) {
      const __m128i upper = Load16(above_.data() + x);
      const __m128i upper_next = Load16(above_.data() + x + 1);
      const __m128i lower = Load16(below_.data() + x);
      const __m128i lower_next = Load16(below_.data() + x + 1);
      const __m128i upper_pairs[2] = {_mm_unpacklo_epi8(upper, upper_next),
                                      _mm_unpackhi_epi8(upper, upper_next)};
      const __m128i lower_pairs[2] = {_mm_unpacklo_epi8(lower, lower_next),
                                      _mm_unpackhi_epi8(lower, lower_next)};
      const __m128i all[4] = {_mm_unpacklo_epi16(upper_pairs[0], lower_pairs[0]),
                              _mm_unpackhi_epi16(upper_pairs[0], lower_pairs[0]),
                              _mm_unpacklo_epi16(upper_pairs[1], lower_pairs[1]),
                              _mm_unpackhi_epi16(upper_pairs[1], lower_pairs[1])};
      for (std::size_t i = 0; i < 4 && x + 4 * i < 4 * num_groups_; ++i) {
        _mm_storeu_si128(reinterpret_cast<__m128i*>(words + x + 4 * i), all[i]);
      }
    }
  }

 private:
  static constexpr std::size_t kPad = 8;

  // Three quarter rows around row y, down the columns, in eighths.
  MONO3D_AVX2 void SumQuarterRows(const DetailImage& image, std::ptrdiff_t y) {
    const std::uint8_t* const here = image.quarter_first + y / 4 * image.quarter_row_bytes;
    const auto phase = static_cast<std::size_t>(y % 4);
    // From the quarter pixel before the first to the one behind the last.
    for (std::size_t i = 0; i < num_groups_ + 2; ++i) {
      const std::uint8_t* const at = here + static_cast<std::ptrdiff_t>(i) - 1;
      columns_[kPad + i - 1] = static_cast<std::uint16_t>(
          kQuarterBefore[phase] * at[-image.quarter_row_bytes] + kQuarterHere[phase] * at[0] +
          kQuarterAfter[phase] * at[image.quarter_row_bytes]);
    }
  }

  // Between the columns as between the rows, in 64ths.
  MONO3D_AVX2 void SpreadMeans() {
    for (std::size_t group = 0; group < num_groups_ + 1; group += 8) {
      const std::uint16_t* const at = columns_.data() + kPad + group;
      const __m128i before = Load16(at - 1);
      const __m128i here = Load16(at);
      const __m128i after = Load16(at + 1);
      __m128i of[4];
      for (std::size_t i = 0; i < 4; ++i) {
        const __m128i outer =
            _mm_add_epi16(_mm_mullo_epi16(before, _mm_set1_epi16(kQuarterBefore[i])),
                          _mm_mullo_epi16(after, _mm_set1_epi16(kQuarterAfter[i])));
        of[i] = _mm_add_epi16(_mm_mullo_epi16(here, _mm_set1_epi16(kQuarterHere[i])), outer);
      }
      const __m128i low_01 = _mm_unpacklo_epi16(of[0], of[1]);
      const __m128i high_01 = _mm_unpackhi_epi16(of[0], of[1]);
      const __m128i low_23 = _mm_unpacklo_epi16(of[2], of[3]);
      const __m128i high_23 = _mm_unpackhi_epi16(of[2], of[3]);
      auto* const to = reinterpret_cast<__m128i*>(means_.data() + 4 * group);
      _mm_storeu_si128(to, _mm_unpacklo_epi32(low_01, low_23));
      _mm_storeu_si128(to + 1, _mm_unpackhi_epi32(low_01, low_23));
      _mm_storeu_si128(to + 2, _mm_unpacklo_epi32(high_01, high_23));
      _mm_storeu_si128(to + 3, _mm_unpackhi_epi32(high_01, high_23));
    }
  }

  std::size_t num_groups_;              // of four pixels, a quarter pixel each
  std::vector<std::uint16_t> columns_;  // of quarter pixels
  std::vector<std::uint16_t> means_;    // of pixels
  std::vector<std::uint8_t> above_, below_;
};

void RunDetail(const HostDispatch& dispatch, std::uint32_t part, std::uint32_t num_parts) {
  const auto push = dispatch.PushAs<DetailParams>();
  const LevelSize size{push.width_px, push.height_px};
  const LevelSize quarter = size.Halved().Halved();
  const std::size_t num_groups = size.groups_per_row();
  // The dispatch has a layer of workgroups for each image.
  const std::uint32_t groups_of_layer =
      (size.groups_per_row() + 63) / 64 * ((size.height_px + 3) / 4);
  const std::uint32_t num_images = dispatch.num_workgroups / groups_of_layer;
  DetailRows detail(num_groups);
  const HostShare rows = ShareOf(num_images * size.height_px, 1, part, num_parts);
  for (std::uint32_t i = rows.first; i < rows.end; ++i) {
    const std::uint32_t wanted = i / size.height_px;
    const auto y = static_cast<std::ptrdiff_t>(i % size.height_px);
    const std::size_t number = push.first_image + wanted;
    const std::size_t row_bytes = 4 * std::size_t{PaddedWordsPerRow(size)};
    const std::size_t quarter_row_bytes = 4 * std::size_t{PaddedWordsPerRow(quarter)};
    const DetailImage image = {
        dispatch.BufferAs<const std::uint8_t>(0) + 4 * number * PaddedWords(size) +
            kImagePadding * row_bytes + kImagePadding,
        static_cast<std::ptrdiff_t>(row_bytes),
        dispatch.BufferAs<const std::uint8_t>(1) + 4 * number * PaddedWords(quarter) +
            kImagePadding * quarter_row_bytes + kImagePadding,
        static_cast<std::ptrdiff_t>(quarter_row_bytes),
        static_cast<short>(dispatch.BufferAs<const std::uint32_t>(2)[number])};
    if (i == rows.first || y == 0) detail.Next(image, y);
    detail.Next(image, y + 1);
    detail.Store(dispatch.BufferAs<std::uint32_t>(3) + 4 * num_groups * i);
  }
}

}  // namespace

const HostKernel kDetailOnHost = RunDetail;
#else
const HostKernel kDetailOnHost = nullptr;
#endif

}  // namespace mono3d
