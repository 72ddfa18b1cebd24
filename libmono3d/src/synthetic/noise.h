// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstdint>

namespace mono3d::synthetic {

// Well-mixed bits of lattice coordinates: the same on each machine.
std::uint32_t HashBits(int x, int y, int z, std::uint32_t seed);
// The same as a number in [0, 1).
float HashUnit(int x, int y, int z, std::uint32_t seed);

// Gradient noise (Perlin 2002) on a lattice of cell size 1: mean 0, about -0.8 to 0.8.
float GradientNoise(const Eigen::Vector2f& p, std::uint32_t seed);
float GradientNoise(const Eigen::Vector3f& p, std::uint32_t seed);

struct FractalOptions {
  float largest_cell_m = 8;   // lattice cell of the first octave; each next one is half as large
  float smallest_cell_m = 0;  // octaves below are left out; 0: the footprint alone limits
  float gain = 0.9F;          // amplitude of an octave over that of the one before
  std::uint32_t seed = 0;
};

// How much of a pattern of this size may be drawn when a pixel covers `footprint_m`: 1 where it is
// resolved, 0 where it would alias, smooth in between.
float ResolvedShare(float size_m, float footprint_m);

// Sum of octaves of gradient noise over a place in metres, free of detail finer than the footprint.
float FractalNoise(const Eigen::Vector2f& p_m, const FractalOptions& options, float footprint_m);
float FractalNoise(const Eigen::Vector3f& p_m, const FractalOptions& options, float footprint_m);

// Seeded random numbers that do not depend on the standard library (SplitMix64).
class RandomNumbers {
 public:
  explicit RandomNumbers(std::uint64_t seed) : state_(seed) {}

  double Uniform(double low, double high);
  bool Chance(double probability) { return Uniform(0, 1) < probability; }
  std::uint32_t Bits();

 private:
  std::uint64_t state_;
};

}  // namespace mono3d::synthetic
