// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "tracking/features/feature.h"
#include "tracking/map/map.h"

namespace mono3d::tracking {

// How much of an image a keyframe has seen too.
struct PlaceMatch {
  KeyframeId keyframe = 0;
  int num_votes = 0;  // features of the image that look like one of the keyframe's
};

// Place recognition without a vocabulary: the descriptors of all keyframes in hash tables over some
// of their bits, which those of the same patch mostly share (locality sensitive hashing: Gionis,
// Indyk, Motwani 1999). Grows with each keyframe that stays; the same bits are
// drawn in every run.
class PlaceIndex {
 public:
  PlaceIndex();

  // Replaces what the index has of the keyframe: live, a map may be joined before its newest
  // keyframes are mapped.
  void Add(KeyframeId keyframe, std::span<const Feature> features);
  // Removes a keyframe; does nothing where it was never added. Its memory is used for later ones.
  void Remove(KeyframeId keyframe);
  // For the archives of image/state_archive.h; of a map with so many keyframes. The answers to
  // queries come back, not where in memory the entries lie.
  template <typename Archive>
  void ExchangeState(Archive& archive, std::size_t num_keyframes);
  // Memory in use, in features.
  std::size_t num_entries() const { return entries_.size(); }
  // The keyframes that share most features with an image, most votes first, at most `max_matches`.
  // `is_left_out`: keyframes that must not be returned (missing: 0); they cost next to nothing.
  std::vector<PlaceMatch> Query(std::span<const Feature> features, std::size_t max_matches,
                                const std::vector<char>& is_left_out = {}) const;

 private:
  // Of descriptors that differ in 25 bits, some 23 % agree in 14 given bits: in one of eight tables
  // nearly nine of ten do. 16,000 buckets keep those of others few.
  static constexpr std::size_t kNumTables = 8;
  static constexpr std::size_t kNumBits = 14;  // of a hash

  struct Entry {
    Descriptor descriptor{};
    KeyframeId keyframe = 0;
  };
  std::uint32_t Hash(const Descriptor& descriptor, std::size_t table) const;

  std::array<std::array<std::uint8_t, kNumBits>, kNumTables> bits_{};
  std::array<std::vector<std::vector<std::uint32_t>>, kNumTables> buckets_;  // of entries
  std::vector<Entry> entries_;
  std::vector<std::vector<std::uint32_t>> entries_of_;  // of each keyframe
  std::vector<std::uint32_t> free_;                     // entries of keyframes removed
};

// The features of a view that have a map point: what can be found again in space.
std::vector<Feature> FeaturesWithPoints(const View& view);

}  // namespace mono3d::tracking
