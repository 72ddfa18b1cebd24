// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace mono3d {

// A surfel as it lies in the three buffers of the model; shaders/fusion/surfel.glsl is the same for
// the kernels. 48 bytes.
struct Surfels {
  using Float4 = std::array<float, 4>;
  using Uint4 = std::array<std::uint32_t, 4>;

  std::vector<Float4> position_radius;  // xyz in the frame of its anchor, su; radius, su
  // Unit normal in that frame, outwards; weight = information on depth, 1/su^2; 0: removed.
  std::vector<Float4> normal_weight;
  // x: colour, 10 bits each of red, green, blue, red lowest; kCoarseMatch.
  // y: depth maps that confirm it (low 16 bits); confidence against it: of those that see through
  //    it, in 1/8 (next 8 bits), of those in which it is hidden, 1 at most, in 1/255 (last 8 bits).
  // z: first (low) and last (high) depth map that saw it.
  // w: depth map to which it is anchored (low), sum of confidences * 256 (high).
  std::vector<Uint4> history;

  std::size_t size() const { return position_radius.size(); }
  void resize(std::size_t size) {
    position_radius.resize(size);
    normal_weight.resize(size);
    history.resize(size);
  }
};

inline constexpr std::size_t kBytesPerSurfel = 3 * sizeof(Surfels::Float4);
static_assert(kBytesPerSurfel == 48 && sizeof(Surfels::Uint4) == sizeof(Surfels::Float4));

// Of surfels that follow each other, of one anchor; kSurfelsPerBlock of shaders/fusion/item.glsl.
inline constexpr std::uint32_t kSurfelsPerBlock = 64;
// Slots of whole blocks for so many surfels.
inline constexpr std::uint32_t WholeBlocks(std::uint32_t num_surfels) {
  return (num_surfels + kSurfelsPerBlock - 1) / kSurfelsPerBlock * kSurfelsPerBlock;
}

inline std::uint32_t Low16(std::uint32_t packed) { return packed & 0xFFFFU; }
inline std::uint32_t High16(std::uint32_t packed) { return packed >> 16; }

inline bool IsRemoved(const Surfels& surfels, std::size_t i) {
  return surfels.normal_weight[i][3] <= 0;
}

// Of them, how many are not removed.
std::uint32_t NumThere(const Surfels& surfels);

void Append(const Surfels& from, Surfels& to);

// Without those that are removed, in their order, such that each anchor has blocks of its own: the
// last one of each is filled up with slots that count as removed.
Surfels InWholeBlocks(const Surfels& surfels);

// Number of the depth map to which a surfel is anchored.
inline std::uint32_t AnchorOf(const Surfels& surfels, std::size_t i) {
  return Low16(surfels.history[i][3]);
}

// Number of the depth map that saw it first: the one to which it is anchored, or one before.
inline std::uint32_t FirstMapOf(const Surfels& surfels, std::size_t i) {
  return Low16(surfels.history[i][2]);
}

// Of those that no depth map matched in full, one did on a coarser level of the pyramid.
inline constexpr std::uint32_t kCoarseMatch = 1U << 30;
inline bool IsCoarseMatch(const Surfels::Uint4& history) {
  return (history[0] & kCoarseMatch) != 0;
}

// The history of a surfel counts depth maps in 16 bits.
inline constexpr std::uint32_t kMaxDepthMaps = 0xFFFF;

// What speaks for and against a surfel, in 1/256.
inline std::uint32_t ConfidenceFor(const Surfels::Uint4& history) { return High16(history[3]); }
inline std::uint32_t SeenThroughAgainst(const Surfels::Uint4& history) {
  return ((history[1] >> 16) & 0xFFU) * 32;
}
inline std::uint32_t HiddenAgainst(const Surfels::Uint4& history) {
  return (history[1] >> 24) + (history[1] >> 31);
}

// What an association says when it is not the number of the confirming pixel, which is below
// kHidden. The low 8 bits of the latter two are the confidence with which they say it.
inline constexpr std::uint32_t kUnseen = 0xFFFFFFFFU;
inline constexpr std::uint32_t kSeenThrough = 0xFFFFFE00U;
inline constexpr std::uint32_t kHidden = 0xFFFFFD00U;
inline bool IsPixel(std::uint32_t association) { return association < kHidden; }
inline bool Says(std::uint32_t association, std::uint32_t what) {
  return (association & 0xFFFFFF00U) == what;
}

// Cells of the index map per pixel, along each axis.
inline constexpr int kIndexCellsPerPixel = 2;

}  // namespace mono3d
