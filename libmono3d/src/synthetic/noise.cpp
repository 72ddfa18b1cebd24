// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/noise.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "synthetic/numbers.h"

namespace mono3d::synthetic {
namespace {

float Fade(float t) { return t * t * t * (t * (t * 6 - 15) + 10); }

// Without SSE4.1 std::floor is a call.
float Floor(float x) {
  const auto truncated = static_cast<float>(static_cast<int>(x));
  return truncated > x ? truncated - 1 : truncated;
}

// Bits of a lattice point, of which only the top ones are well mixed: all that a gradient needs.
// One multiplication a corner, since the sums of neighbours differ by a constant.
struct LatticeHash {
  std::uint32_t base;

  LatticeHash(int x, int y, int z, std::uint32_t seed)
      : base(static_cast<std::uint32_t>(x) * kX + static_cast<std::uint32_t>(y) * kY +
             static_cast<std::uint32_t>(z) * kZ + (seed + 1) * 0x68E31DA4U) {}

  std::uint32_t TopBits(int dx, int dy, int dz) const {
    std::uint32_t h = base + (dx != 0 ? kX : 0U) + (dy != 0 ? kY : 0U) + (dz != 0 ? kZ : 0U);
    h = (h ^ (h >> 15U)) * 0x2C1B3C6DU;
    return (h ^ (h >> 13U)) * 0x9E3779B1U;
  }

  static constexpr std::uint32_t kX = 0x9E3779B1U;
  static constexpr std::uint32_t kY = 0x85EBCA77U;
  static constexpr std::uint32_t kZ = 0xC2B2AE3DU;
};

// Dot product of a hashed gradient of unit length with the offset from its lattice point.
float Gradient(std::uint32_t bits, float x, float y) {
  constexpr float kDiagonal = 0.70710678F;
  static constexpr std::array<std::array<float, 2>, 8> kDirections = {{{1, 0},
                                                                       {-1, 0},
                                                                       {0, 1},
                                                                       {0, -1},
                                                                       {kDiagonal, kDiagonal},
                                                                       {-kDiagonal, kDiagonal},
                                                                       {kDiagonal, -kDiagonal},
                                                                       {-kDiagonal, -kDiagonal}}};
  const auto& direction = kDirections[bits >> 29U];
  return direction[0] * x + direction[1] * y;
}

// The twelve cube edges, four of them twice (Perlin 2002).
float Gradient(std::uint32_t bits, float x, float y, float z) {
  const std::uint32_t h = bits >> 28U;
  const float u = h < 8 ? x : y;
  const float v = h < 4 ? y : (h == 12 || h == 14 ? x : z);
  return ((h & 1U) != 0 ? -u : u) + ((h & 2U) != 0 ? -v : v);
}

// Rotates the lattice of each octave against the one before, so that their zeros do not fall
// together.
Eigen::Vector2f NextOctave(const Eigen::Vector2f& p) {
  return 2 * Eigen::Vector2f(0.8F * p.x() - 0.6F * p.y(), 0.6F * p.x() + 0.8F * p.y());
}

Eigen::Vector3f NextOctave(const Eigen::Vector3f& p) {
  const Eigen::Vector3f q(0.8F * p.x() - 0.6F * p.y(), 0.6F * p.x() + 0.8F * p.y(), p.z());
  return 2 * Eigen::Vector3f(q.x(), 0.8F * q.y() - 0.6F * q.z(), 0.6F * q.y() + 0.8F * q.z());
}

template <typename Vector>
float SumOctaves(const Vector& p_m, const FractalOptions& options, float footprint_m) {
  // Of a pixel of no size, as before a camera on the very surface, none is the last one. Positions
  // are not known to more than a millionth of the largest cell.
  constexpr std::uint32_t kMostOctaves = 20;
  Vector p = p_m / options.largest_cell_m;
  float cell_m = options.largest_cell_m;
  float amplitude = 1;
  float sum = 0;
  for (std::uint32_t octave = 0; octave < kMostOctaves; ++octave) {
    if (cell_m < options.smallest_cell_m) break;
    const float share = ResolvedShare(cell_m, footprint_m);
    if (share <= 0) break;
    sum += amplitude * share * GradientNoise(p, options.seed + octave);
    amplitude *= options.gain;
    cell_m /= 2;
    p = NextOctave(p);
  }
  return sum;
}

}  // namespace

std::uint32_t HashBits(int x, int y, int z, std::uint32_t seed) {
  std::uint32_t h = seed * 0x27D4EB2FU + static_cast<std::uint32_t>(x) * 0x9E3779B1U;
  h = (h ^ (h >> 16U)) + static_cast<std::uint32_t>(y) * 0x85EBCA77U;
  h = (h ^ (h >> 13U)) + static_cast<std::uint32_t>(z) * 0xC2B2AE3DU;
  h = (h ^ (h >> 15U)) * 0x2C1B3C6DU;
  h = (h ^ (h >> 12U)) * 0x297A2D39U;
  return h ^ (h >> 15U);
}

float HashUnit(int x, int y, int z, std::uint32_t seed) {
  constexpr float kInverse24Bits = 1.0F / 16777216.0F;
  return static_cast<float>(HashBits(x, y, z, seed) >> 8U) * kInverse24Bits;
}

float GradientNoise(const Eigen::Vector2f& p, std::uint32_t seed) {
  const float floor_x = Floor(p.x());
  const float floor_y = Floor(p.y());
  const int ix = static_cast<int>(floor_x);
  const int iy = static_cast<int>(floor_y);
  const float x = p.x() - floor_x;
  const float y = p.y() - floor_y;
  const LatticeHash hash(ix, iy, 0, seed);
  const auto corner = [&](int dx, int dy) {
    return Gradient(hash.TopBits(dx, dy, 0), x - static_cast<float>(dx),
                    y - static_cast<float>(dy));
  };
  const float u = Fade(x);
  return Mix(Mix(corner(0, 0), corner(1, 0), u), Mix(corner(0, 1), corner(1, 1), u), Fade(y));
}

float GradientNoise(const Eigen::Vector3f& p, std::uint32_t seed) {
  const Eigen::Vector3f floor(Floor(p.x()), Floor(p.y()), Floor(p.z()));
  const Eigen::Vector3i i = floor.cast<int>();
  const Eigen::Vector3f f = p - floor;
  const LatticeHash hash(i.x(), i.y(), i.z(), seed);
  const auto corner = [&](int dx, int dy, int dz) {
    return Gradient(hash.TopBits(dx, dy, dz), f.x() - static_cast<float>(dx),
                    f.y() - static_cast<float>(dy), f.z() - static_cast<float>(dz));
  };
  const float u = Fade(f.x());
  const float v = Fade(f.y());
  const auto layer = [&](int dz) {
    return Mix(Mix(corner(0, 0, dz), corner(1, 0, dz), u),
               Mix(corner(0, 1, dz), corner(1, 1, dz), u), v);
  };
  return Mix(layer(0), layer(1), Fade(f.z()));
}

float ResolvedShare(float size_m, float footprint_m) {
  // A lattice cell is half a wave: one cell a pixel is the limit of Nyquist.
  constexpr float kNone = 0.8F;
  constexpr float kAll = 1.6F;
  if (size_m >= kAll * footprint_m) return 1;
  const float t = std::clamp((size_m / footprint_m - kNone) / (kAll - kNone), 0.0F, 1.0F);
  return t * t * (3 - 2 * t);
}

float FractalNoise(const Eigen::Vector2f& p_m, const FractalOptions& options, float footprint_m) {
  return SumOctaves(p_m, options, footprint_m);
}

float FractalNoise(const Eigen::Vector3f& p_m, const FractalOptions& options, float footprint_m) {
  return SumOctaves(p_m, options, footprint_m);
}

std::uint32_t RandomNumbers::Bits() {
  state_ += 0x9E3779B97F4A7C15ULL;
  std::uint64_t z = state_;
  z = (z ^ (z >> 30U)) * 0xBF58476D1CE4E5B9ULL;
  z = (z ^ (z >> 27U)) * 0x94D049BB133111EBULL;
  return static_cast<std::uint32_t>((z ^ (z >> 31U)) >> 32U);
}

double RandomNumbers::Uniform(double low, double high) {
  return low + (high - low) * (Bits() / 4294967296.0);
}

}  // namespace mono3d::synthetic
