// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/host/host_kernels.h"
#include "depth/measurement.h"
#include "depth/surface.params.h"
#include "gpu/host_simd.h"

#if MONO3D_HAS_AVX2
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>
#endif

namespace mono3d {

#if MONO3D_HAS_AVX2
namespace {

using host::Abs;
using host::Less;
using host::LessOrEqual;
using host::Select;
using host::Splat;

constexpr int kFitRadius = static_cast<int>(kMeasurementBorder);
constexpr std::size_t kWindowRows = 2 * kFitRadius + 1;
// As surface.comp has them.
constexpr std::array<float, 4> kFitFalloff = {1.0F, 0.8007F, 0.4111F, 0.1353F};
constexpr float kWholeWindow = 13.6686F;
constexpr float kWindowPixels = 49.0F;
constexpr float kPerCent = 0.01F;

// The bindings of surface.comp.
struct SurfaceBuffers {
  explicit SurfaceBuffers(const HostDispatch& dispatch)
      : push(dispatch.PushAs<SurfaceParams>()),
        with_confidence(dispatch.constants.empty() || dispatch.constants[0] != 0),
        measurements(dispatch.BufferAs<const std::uint32_t>(0)),
        uniqueness(dispatch.BufferAs<const float>(1)),
        inverse_depth(dispatch.BufferAs<float>(2)),
        confidence(dispatch.BufferAs<float>(3)),
        measurements_per_row(MeasurementsPerRow({push.width_px, push.height_px})) {}

  SurfaceParams push;
  bool with_confidence;
  const std::uint32_t* measurements;  // two words each
  const float* uniqueness;
  float* inverse_depth;
  float* confidence;
  std::size_t measurements_per_row;
};

// A row of measurements, each as the fit needs it. Without an estimate all but the step is 0.
struct FitRow {
  std::vector<float> w, step, information, support;
  // Of the part of the row that a window has which begins there: how many estimates, and the bits
  // of the greatest and, less 1, of the least of the middle five.
  std::vector<float> found;
  std::vector<std::uint32_t> nearest, farthest;

  void Resize(std::size_t size) {
    for (std::vector<float>* of : {&w, &step, &information, &support, &found}) {
      of->assign(size, 0.0F);
    }
    nearest.assign(size, 0);
    farthest.assign(size, 0);
  }
};

MONO3D_AVX2 void UnpackRow(const SurfaceBuffers& buffers, std::size_t row, FitRow& to) {
  const std::uint32_t* const from = buffers.measurements + 2 * row * buffers.measurements_per_row;
  const std::size_t num = buffers.measurements_per_row;
  for (std::size_t first = 0; first < num; first += host::kLanes) {
    // The last ones overlap those before; narrow images have room for eight.
    alignas(32) std::array<std::uint32_t, host::kLanes> depths{};
    alignas(32) std::array<std::uint32_t, host::kLanes> fields{};
    for (std::size_t i = 0; i < host::kLanes && first + i < num; ++i) {
      depths[i] = from[2 * (first + i)];
      fields[i] = from[2 * (first + i) + 1];
    }
    const __m256i field = _mm256_load_si256(reinterpret_cast<const __m256i*>(fields.data()));
    const __m256 w =
        _mm256_castsi256_ps(_mm256_load_si256(reinterpret_cast<const __m256i*>(depths.data())));
    const __m256 step = _mm256_cvtepi32_ps(_mm256_srai_epi32(field, 20)) / Splat(2047.0F);
    const __m256 support =
        _mm256_cvtepi32_ps(_mm256_and_si256(_mm256_srli_epi32(field, 12), Splat(0xff))) /
        Splat(255.0F);
    const __m256 information = _mm256_castsi256_ps(_mm256_add_epi32(
        _mm256_slli_epi32(_mm256_and_si256(field, Splat(0xfff)), 16), Splat(0x3f800000)));
    const __m256 is_there = Less(_mm256_setzero_ps(), w);
    _mm256_storeu_ps(to.w.data() + first, w);
    _mm256_storeu_ps(to.step.data() + first, step);
    _mm256_storeu_ps(to.information.data() + first, _mm256_and_ps(is_there, information));
    _mm256_storeu_ps(to.support.data() + first, support);
  }
}

MONO3D_AVX2 inline __m256i LoadBits(const std::uint32_t* from) {
  return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(from));
}

// What windows have of a row that no middle has a say in, so that it is added up once a row.
MONO3D_AVX2 void AddUpRow(std::size_t width, FitRow& row) {
  for (std::size_t x = 0; x < width; x += host::kLanes) {
    __m256 found = _mm256_setzero_ps();
    __m256i nearest = _mm256_setzero_si256();
    __m256i farthest = Splat(-1);
    for (int i = 0; i <= 2 * kFitRadius; ++i) {
      const __m256 w = _mm256_loadu_ps(row.w.data() + x + static_cast<std::size_t>(i));
      found = found + _mm256_and_ps(Less(_mm256_setzero_ps(), w), Splat(1.0F));
      if (i < 1 || i >= 2 * kFitRadius) continue;
      const __m256i bits = _mm256_castps_si256(w);
      nearest = _mm256_max_epu32(nearest, bits);
      farthest = _mm256_min_epu32(farthest, _mm256_sub_epi32(bits, Splat(1)));
    }
    _mm256_storeu_ps(row.found.data() + x, found);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(row.nearest.data() + x), nearest);
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(row.farthest.data() + x), farthest);
  }
}

// Sums of surface.comp, of eight pixels side by side.
struct FitSums {
  __m256 n, x, y, xx, xy, yy, v, xv, yv, vv, support, found, bends;
  __m256i nearest, farthest;  // bits of positive floats, of which the second are less 1
};

// How far the middle is from the straight line between its neighbours to either side.
MONO3D_AVX2 inline __m256 Bend(__m256 before, __m256 after, __m256 middle) {
  const __m256 zero = _mm256_setzero_ps();
  const __m256 both = _mm256_and_ps(Less(zero, before), Less(zero, after));
  return _mm256_and_ps(both, Abs(Splat(0.5F) * (before + after) - middle));
}

// One tap of the window. What a column or row of 0 would add, which is 0, is left out.
template <bool kWithConfidence, int kDx, int kDy>
MONO3D_AVX2 inline void AddTap(FitSums& of_row, const FitRow& row, std::size_t x, __m256 middle,
                               __m256 per_plane) {
  constexpr int kAcross = std::max(kDx, -kDx);
  constexpr auto kReach = static_cast<float>(std::max({kAcross, kDy, -kDy, 1}));
  const std::size_t at = x + static_cast<std::size_t>(kDx + kFitRadius);
  const __m256 planes = (_mm256_loadu_ps(row.w.data() + at) - middle) * per_plane;
  const __m256 falloff =
      _mm256_and_ps(LessOrEqual(Abs(planes), Splat(kReach)), Splat(kFitFalloff[kAcross]));
  const __m256 u = falloff * _mm256_loadu_ps(row.information.data() + at);
  const __m256 v = planes + _mm256_loadu_ps(row.step.data() + at);
  const __m256 uv = u * v;
  of_row.n = of_row.n + u;
  of_row.v = of_row.v + uv;
  if constexpr (kDx != 0) {
    of_row.x = of_row.x + u * Splat(static_cast<float>(kDx));
    of_row.xx = of_row.xx + u * Splat(static_cast<float>(kDx * kDx));
    of_row.xv = of_row.xv + uv * Splat(static_cast<float>(kDx));
  }
  if constexpr (kWithConfidence) {
    of_row.vv = of_row.vv + uv * v;
    of_row.support = of_row.support + falloff * _mm256_loadu_ps(row.support.data() + at);
  }
}

template <bool kWithConfidence, int kDy>
MONO3D_AVX2 inline void AddRow(FitSums& sums, const FitRow& row, std::size_t x, __m256 middle,
                               __m256 per_plane) {
  FitSums of_row = {};
  AddTap<kWithConfidence, -3, kDy>(of_row, row, x, middle, per_plane);
  AddTap<kWithConfidence, -2, kDy>(of_row, row, x, middle, per_plane);
  AddTap<kWithConfidence, -1, kDy>(of_row, row, x, middle, per_plane);
  AddTap<kWithConfidence, 0, kDy>(of_row, row, x, middle, per_plane);
  AddTap<kWithConfidence, 1, kDy>(of_row, row, x, middle, per_plane);
  AddTap<kWithConfidence, 2, kDy>(of_row, row, x, middle, per_plane);
  AddTap<kWithConfidence, 3, kDy>(of_row, row, x, middle, per_plane);
  constexpr int kAway = std::max(kDy, -kDy);
  constexpr float kFalloff = kFitFalloff[kAway];
  const __m256 falloff = Splat(kFalloff);
  sums.n = sums.n + falloff * of_row.n;
  sums.x = sums.x + falloff * of_row.x;
  sums.xx = sums.xx + falloff * of_row.xx;
  sums.v = sums.v + falloff * of_row.v;
  sums.xv = sums.xv + falloff * of_row.xv;
  if constexpr (kDy != 0) {
    const __m256 falloff_dy = Splat(kFalloff * static_cast<float>(kDy));
    sums.y = sums.y + falloff_dy * of_row.n;
    sums.xy = sums.xy + falloff_dy * of_row.x;
    sums.yy = sums.yy + falloff_dy * Splat(static_cast<float>(kDy)) * of_row.n;
    sums.yv = sums.yv + falloff_dy * of_row.v;
  }
  if constexpr (kWithConfidence) {
    sums.vv = sums.vv + falloff * of_row.vv;
    sums.support = sums.support + falloff * of_row.support;
    sums.found = sums.found + _mm256_loadu_ps(row.found.data() + x);
    if constexpr (kAway <= 2) {
      sums.nearest = _mm256_max_epu32(sums.nearest, LoadBits(row.nearest.data() + x));
      sums.farthest = _mm256_min_epu32(sums.farthest, LoadBits(row.farthest.data() + x));
    }
  }
}

// The ends of the four directions across the window, added as surface.comp does.
MONO3D_AVX2 inline __m256 BendsOf(const std::array<FitRow, kWindowRows + 1>& rows,
                                  const std::array<std::size_t, kWindowRows>& order, std::size_t x,
                                  __m256 middle) {
  const float* const above = rows[order[0]].w.data() + x;
  const float* const here = rows[order[kFitRadius]].w.data() + x;
  const float* const below = rows[order[2 * kFitRadius]].w.data() + x;
  const __m256 across = Bend(_mm256_loadu_ps(here), _mm256_loadu_ps(here + 6), middle);
  const __m256 down = Bend(_mm256_loadu_ps(above + 3), _mm256_loadu_ps(below + 3), middle);
  const __m256 falling = Bend(_mm256_loadu_ps(above), _mm256_loadu_ps(below + 6), middle);
  const __m256 rising = Bend(_mm256_loadu_ps(above + 6), _mm256_loadu_ps(below), middle);
  return across + (down + falling + rising);
}

MONO3D_AVX2 inline __m256 Clamped(__m256 value, float low, float high) {
  return _mm256_min_ps(_mm256_max_ps(value, Splat(low)), Splat(high));
}

template <bool kWithConfidence>
MONO3D_AVX2 inline void StoreFit(const SurfaceBuffers& buffers, const FitSums& s, __m256 middle,
                                 std::size_t pixel, std::size_t num) {
  const __m256 zero = _mm256_setzero_ps();
  const __m256 per_plane = Splat(buffers.push.inverse_depth_step);
  // Gradient by Cramer's rule on the centred moments.
  const __m256 cxx = s.n * s.xx - s.x * s.x;
  const __m256 cxy = s.n * s.xy - s.x * s.y;
  const __m256 cyy = s.n * s.yy - s.y * s.y;
  const __m256 cxv = s.n * s.xv - s.x * s.v;
  const __m256 cyv = s.n * s.yv - s.y * s.v;
  const __m256 determinant = cxx * cyy - cxy * cxy;
  const __m256 exists = Less(zero, middle);
  const __m256 is_fitted =
      _mm256_and_ps(_mm256_and_ps(exists, Less(Splat(1e-3F) * cxx * cyy, determinant)),
                    _mm256_and_ps(Less(zero, cxx), Less(zero, cyy)));
  const __m256 gx = (cxv * cyy - cyv * cxy) / determinant;
  const __m256 gy = (cyv * cxx - cxv * cxy) / determinant;
  const __m256 g0 = (s.v - gx * s.x - gy * s.y) / s.n;
  const __m256 fitted =
      _mm256_max_ps(middle + per_plane * Clamped(g0, -1.0F, 1.0F), Splat(0.5F) * middle);
  const __m256 w = Select(is_fitted, fitted, middle);
  alignas(32) std::array<float, host::kLanes> results;
  _mm256_store_ps(results.data(), w);
  std::copy_n(results.data(), num, buffers.inverse_depth + pixel);
  if constexpr (kWithConfidence) {
    const __m256 misfit = _mm256_max_ps(s.vv - g0 * s.v - gx * s.xv - gy * s.yv, zero);
    const __m256 slope = (_mm256_castsi256_ps(s.nearest) -
                          _mm256_castsi256_ps(_mm256_add_epi32(s.farthest, Splat(1)))) /
                         Splat(4.0F);
    const __m256 deviation =
        _mm256_sqrt_ps((Splat(1.0F) + misfit) / s.n) * per_plane + slope + s.bends;
    alignas(32) std::array<float, host::kLanes> unique{};
    std::copy_n(buffers.uniqueness + pixel, num, unique.data());
    const __m256 explained = s.support / Splat(kWholeWindow);
    const __m256 evidence =
        s.found / Splat(kWindowPixels) * _mm256_sqrt_ps(explained * _mm256_load_ps(unique.data()));
    const __m256 sure =
        Splat(2.0F) * evidence / (evidence + Splat(1.0F) + deviation / (Splat(kPerCent) * w));
    const __m256 confidence =
        _mm256_and_ps(exists, Clamped(_mm256_and_ps(is_fitted, sure), 1e-3F, 1.0F));
    _mm256_store_ps(results.data(), confidence);
    std::copy_n(results.data(), num, buffers.confidence + pixel);
  }
}

template <bool kWithConfidence>
MONO3D_AVX2 void FitRows(const SurfaceBuffers& buffers, std::uint32_t first, std::uint32_t end) {
  const std::size_t width = buffers.push.width_px;
  // The rows of the window, each at its number modulo theirs, and room for eight lanes.
  std::array<FitRow, kWindowRows + 1> rows;
  for (FitRow& row : rows) row.Resize(buffers.measurements_per_row + 3 * host::kLanes);
  const auto place = [&](std::size_t row) { return row % rows.size(); };
  const auto unpack = [&](std::size_t row) {
    UnpackRow(buffers, row, rows[place(row)]);
    if constexpr (kWithConfidence) AddUpRow(width, rows[place(row)]);
  };
  for (std::size_t row = first; row < first + kWindowRows - 1; ++row) unpack(row);
  const __m256 per_plane = Splat(1.0F / buffers.push.inverse_depth_step);
  for (std::size_t y = first; y < end; ++y) {
    // The border moves the windows' corner to the pixel.
    unpack(y + kWindowRows - 1);
    std::array<std::size_t, kWindowRows> order;
    for (std::size_t i = 0; i < kWindowRows; ++i) order[i] = place(y + i);
    for (std::size_t x = 0; x < width; x += host::kLanes) {
      const __m256 middle = _mm256_loadu_ps(rows[order[kFitRadius]].w.data() + x + kFitRadius);
      const __m256 zero = _mm256_setzero_ps();
      FitSums sums = {zero,     zero, zero, zero, zero, zero, zero,
                      zero,     zero, zero, zero, zero, zero, _mm256_setzero_si256(),
                      Splat(-1)};
      AddRow<kWithConfidence, -3>(sums, rows[order[0]], x, middle, per_plane);
      AddRow<kWithConfidence, -2>(sums, rows[order[1]], x, middle, per_plane);
      AddRow<kWithConfidence, -1>(sums, rows[order[2]], x, middle, per_plane);
      AddRow<kWithConfidence, 0>(sums, rows[order[3]], x, middle, per_plane);
      AddRow<kWithConfidence, 1>(sums, rows[order[4]], x, middle, per_plane);
      AddRow<kWithConfidence, 2>(sums, rows[order[5]], x, middle, per_plane);
      AddRow<kWithConfidence, 3>(sums, rows[order[6]], x, middle, per_plane);
      if constexpr (kWithConfidence) sums.bends = BendsOf(rows, order, x, middle);
      StoreFit<kWithConfidence>(buffers, sums, middle, y * width + x,
                                std::min<std::size_t>(host::kLanes, width - x));
    }
  }
}

void RunSurface(const HostDispatch& dispatch, std::uint32_t part, std::uint32_t num_parts) {
  const SurfaceBuffers buffers(dispatch);
  const HostShare rows = ShareOf(buffers.push.height_px, 1, part, num_parts);
  if (rows.first == rows.end) return;
  if (buffers.with_confidence) {
    FitRows<true>(buffers, rows.first, rows.end);
  } else {
    FitRows<false>(buffers, rows.first, rows.end);
  }
}

}  // namespace

const HostKernel kSurfaceOnHost = RunSurface;
#else
const HostKernel kSurfaceOnHost = nullptr;
#endif

}  // namespace mono3d
