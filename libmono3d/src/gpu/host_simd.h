// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>

#include "gpu/host_kernel.h"

#if MONO3D_HAS_AVX2
#include <immintrin.h>

// Eight lanes at once, as host kernels use them.
namespace mono3d::host {

inline constexpr std::uint32_t kLanes = 8;

struct Vec3 {
  __m256 x, y, z;
};
struct Vec4 {
  __m256 x, y, z, w;
};

MONO3D_AVX2 inline __m256 Splat(float value) { return _mm256_set1_ps(value); }
MONO3D_AVX2 inline __m256i Splat(int value) { return _mm256_set1_epi32(value); }

// In this order and without fusing, as shaders with `precise` results have it.
MONO3D_AVX2 inline __m256 Dot(const Vec3& a, const Vec3& b) {
  return _mm256_add_ps(_mm256_add_ps(_mm256_mul_ps(a.x, b.x), _mm256_mul_ps(a.y, b.y)),
                       _mm256_mul_ps(a.z, b.z));
}

// The lanes of `mask`, all bits or none in each, from `a`, the others from `b`.
MONO3D_AVX2 inline __m256 Select(__m256 mask, __m256 a, __m256 b) {
  return _mm256_blendv_ps(b, a, mask);
}

MONO3D_AVX2 inline __m256 Abs(__m256 a) { return _mm256_andnot_ps(Splat(-0.0F), a); }
MONO3D_AVX2 inline __m256 Less(__m256 a, __m256 b) { return _mm256_cmp_ps(a, b, _CMP_LT_OQ); }
MONO3D_AVX2 inline __m256 LessOrEqual(__m256 a, __m256 b) {
  return _mm256_cmp_ps(a, b, _CMP_LE_OQ);
}
// A bit for each lane.
MONO3D_AVX2 inline unsigned BitsOf(__m256 mask) {
  return static_cast<unsigned>(_mm256_movemask_ps(mask));
}

MONO3D_AVX2 inline Vec4 Transposed(__m256 of_0_and_4, __m256 of_1_and_5, __m256 of_2_and_6,
                                   __m256 of_3_and_7) {
  const __m256 low_xy = _mm256_unpacklo_ps(of_0_and_4, of_1_and_5);
  const __m256 low_zw = _mm256_unpackhi_ps(of_0_and_4, of_1_and_5);
  const __m256 high_xy = _mm256_unpacklo_ps(of_2_and_6, of_3_and_7);
  const __m256 high_zw = _mm256_unpackhi_ps(of_2_and_6, of_3_and_7);
  return {_mm256_shuffle_ps(low_xy, high_xy, 0x44), _mm256_shuffle_ps(low_xy, high_xy, 0xee),
          _mm256_shuffle_ps(low_zw, high_zw, 0x44), _mm256_shuffle_ps(low_zw, high_zw, 0xee)};
}

MONO3D_AVX2 inline __m256 TwoVectors(const float* low, const float* high) {
  return _mm256_insertf128_ps(_mm256_castps128_ps256(_mm_loadu_ps(low)), _mm_loadu_ps(high), 1);
}

// Eight vectors of four floats that follow each other.
MONO3D_AVX2 inline Vec4 LoadVec4(const float* from) {
  return Transposed(TwoVectors(from, from + 16), TwoVectors(from + 4, from + 20),
                    TwoVectors(from + 8, from + 24), TwoVectors(from + 12, from + 28));
}
// Those of numbers `at`.
MONO3D_AVX2 inline Vec4 GatherVec4(const float* from, const std::int32_t* at) {
  const auto of = [&](std::size_t i) { return from + 4 * static_cast<std::ptrdiff_t>(at[i]); };
  return Transposed(TwoVectors(of(0), of(4)), TwoVectors(of(1), of(5)), TwoVectors(of(2), of(6)),
                    TwoVectors(of(3), of(7)));
}

// The vectors of the lanes whose bit is set, eight that follow each other.
MONO3D_AVX2 inline void StoreVec4(float* to, const Vec4& values, unsigned lanes) {
  // Transposing four lanes by four twice gives back the vectors, lanes 0 and 4 in the first.
  const Vec4 vectors = Transposed(values.x, values.y, values.z, values.w);
  const __m256 of[4] = {vectors.x, vectors.y, vectors.z, vectors.w};
  for (unsigned i = 0; i < 4; ++i) {
    if ((lanes >> i & 1U) != 0) _mm_storeu_ps(to + 4 * i, _mm256_castps256_ps128(of[i]));
    if ((lanes >> (i + 4) & 1U) != 0) {
      _mm_storeu_ps(to + 4 * (i + 4), _mm256_extractf128_ps(of[i], 1));
    }
  }
}

}  // namespace mono3d::host
#endif
