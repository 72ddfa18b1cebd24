// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/host/host_kernels.h"
#include "depth/texture_filter.params.h"
#include "gpu/host_simd.h"

#if MONO3D_HAS_AVX2
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>
#endif

namespace mono3d {

#if MONO3D_HAS_AVX2
namespace {

constexpr std::ptrdiff_t kTextureRows = 3;  // of the window, on each side
constexpr std::uint32_t kTextureColumns = 4;
constexpr std::size_t kTextureWindowColumns = 2 * kTextureColumns + 1;

// Sums of the responses down the columns of a window of rows, kTextureColumns more on each side;
// outside the image its border is repeated. Rows are taken one after the other.
class ResponseColumns {
 public:
  ResponseColumns(const std::uint32_t* response, const TextureFilterParams& push)
      : response_(response),
        width_(push.width_px),
        stride_((push.width_px + 3) / 4 * 4),
        last_row_(static_cast<std::ptrdiff_t>(push.height_px) - 1),
        sums_(push.width_px + 2 * kTextureColumns + host::kLanes) {}

  void Begin(std::ptrdiff_t y) {
    std::ranges::fill(sums_, 0U);
    for (std::ptrdiff_t row = y - kTextureRows; row <= y + kTextureRows; ++row) {
      Add(Row(row));
    }
    RepeatBorders();
  }
  void Next(std::ptrdiff_t y) {  // from y - 1
    const std::uint32_t* const gone = Row(y - kTextureRows - 1);
    const std::uint32_t* const come = Row(y + kTextureRows);
    std::uint32_t* const sums = sums_.data() + kTextureColumns;
    for (std::size_t x = 0; x < width_; ++x) sums[x] += come[x] - gone[x];
    RepeatBorders();
  }
  // Of the window around pixel x: kTextureWindowColumns that follow each other.
  const std::uint32_t* At(std::size_t x) const { return sums_.data() + x; }

 private:
  const std::uint32_t* Row(std::ptrdiff_t y) const {
    return response_ +
           static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(y, 0, last_row_)) * stride_;
  }
  void Add(const std::uint32_t* row) {
    std::uint32_t* const sums = sums_.data() + kTextureColumns;
    for (std::size_t x = 0; x < width_; ++x) sums[x] += row[x];
  }
  void RepeatBorders() {
    std::fill_n(sums_.begin(), kTextureColumns, sums_[kTextureColumns]);
    std::fill(sums_.begin() + static_cast<std::ptrdiff_t>(kTextureColumns + width_), sums_.end(),
              sums_[kTextureColumns + width_ - 1]);
  }

  const std::uint32_t* response_;
  std::size_t width_;
  std::size_t stride_;
  std::ptrdiff_t last_row_;
  std::vector<std::uint32_t> sums_;
};

// Which of eight pixels have a response of so much in their windows: all bits or none.
MONO3D_AVX2 inline __m256 HasTexture(const std::uint32_t* columns, std::uint32_t least) {
  __m256i sum = _mm256_setzero_si256();
  for (std::size_t i = 0; i < kTextureWindowColumns; ++i) {
    sum = _mm256_add_epi32(sum, _mm256_loadu_si256(reinterpret_cast<const __m256i*>(columns + i)));
  }
  const __m256i limit = host::Splat(static_cast<int>(least));
  return _mm256_castsi256_ps(_mm256_cmpeq_epi32(_mm256_max_epu32(sum, limit), sum));
}

MONO3D_AVX2 void FilterRow(const HostDispatch& dispatch, const TextureFilterParams& push,
                           std::size_t y, const ResponseColumns& columns) {
  const std::size_t width = push.width_px;
  const float* const w = dispatch.BufferAs<const float>(1) + y * width;
  const float* const confidence = dispatch.BufferAs<const float>(2) + y * width;
  float* const depth = dispatch.BufferAs<float>(3) + y * width;
  float* const filtered = dispatch.BufferAs<float>(4) + y * width;
  std::size_t x = 0;
  for (; x + host::kLanes <= width; x += host::kLanes) {
    const __m256 here = _mm256_loadu_ps(w + x);
    const __m256 is_valid = _mm256_and_ps(host::Less(_mm256_setzero_ps(), here),
                                          HasTexture(columns.At(x), push.min_response_sum));
    _mm256_storeu_ps(depth + x, _mm256_and_ps(is_valid, host::Splat(1.0F) / here));
    _mm256_storeu_ps(filtered + x, _mm256_and_ps(is_valid, _mm256_loadu_ps(confidence + x)));
  }
  if (x == width) return;
  const unsigned textured = host::BitsOf(HasTexture(columns.At(x), push.min_response_sum));
  for (std::size_t i = 0; x + i < width; ++i) {
    const bool is_valid = w[x + i] > 0 && (textured >> i & 1U) != 0;
    depth[x + i] = is_valid ? 1 / w[x + i] : 0.0F;
    filtered[x + i] = is_valid ? confidence[x + i] : 0.0F;
  }
}

void RunTextureFilter(const HostDispatch& dispatch, std::uint32_t part, std::uint32_t num_parts) {
  const auto push = dispatch.PushAs<TextureFilterParams>();
  const HostShare rows = ShareOf(push.height_px, 1, part, num_parts);
  if (rows.first == rows.end) return;
  ResponseColumns columns(dispatch.BufferAs<const std::uint32_t>(0), push);
  columns.Begin(rows.first);
  for (std::uint32_t y = rows.first; y < rows.end; ++y) {
    if (y > rows.first) columns.Next(y);
    FilterRow(dispatch, push, y, columns);
  }
}

}  // namespace

const HostKernel kTextureFilterOnHost = RunTextureFilter;
#else
const HostKernel kTextureFilterOnHost = nullptr;
#endif

}  // namespace mono3d
