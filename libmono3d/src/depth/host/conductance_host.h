// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "gpu/host_simd.h"

#if MONO3D_HAS_AVX2
namespace mono3d::host {

// Conductance of inference.glsl.
MONO3D_AVX2 inline __m256 Conductance(__m256 grey, __m256 other) {
  const __m256 edges = (grey - other) / Splat(6.0F);
  const __m256 share = Splat(1.0F) / (Splat(1.0F) + edges * edges);
  return _mm256_max_ps(share * share, Splat(1e-3F));
}

}  // namespace mono3d::host
#endif
