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
// Indyk, Motwani 1999). Where many descriptors agree in these bits, more bits tell them apart, so
// that an image costs the same however many keyframes there are. Grows with each keyframe that
// stays; the same bits are drawn in every run.
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
  // With how many descriptors of the index Query compares those of an image.
  std::size_t NumCompared(std::span<const Feature> features) const;
  // The keyframes that share most features with an image, most votes first, at most `max_matches`.
  // `is_left_out`: keyframes that must not be returned (missing: 0); they cost next to nothing.
  std::vector<PlaceMatch> Query(std::span<const Feature> features, std::size_t max_matches,
                                const std::vector<char>& is_left_out = {}) const;

 private:
  // Of descriptors that differ in 25 bits, some 23 % agree in 14 given bits: in one of eight tables
  // nearly nine of ten do. 16,000 buckets keep those of others few. In 20 bits 13 % agree, in one
  // of eight tables two of three: that tells apart a million times as many.
  static constexpr std::size_t kNumTables = 8;
  static constexpr std::size_t kNumBits = 14;  // of a hash
  static constexpr std::size_t kMaxBits = 32;  // where there are many

  struct Entry {
    Descriptor descriptor{};
    KeyframeId keyframe = 0;
  };
  // Entries that agree in some bits: a bucket, or, where there are too many for one, two nodes that
  // the next bit tells apart. Which of these it is follows from the entries alone.
  struct Node {
    std::vector<std::uint32_t> entries;  // of a bucket
    std::uint32_t num_entries = 0;       // in the nodes below as well
    std::uint32_t first_child = 0;       // of two; 0: a bucket
  };
  struct Table {
    std::array<std::uint8_t, kMaxBits> bits{};
    std::vector<Node> nodes;  // first those of each hash
    std::vector<std::uint32_t> free_pairs;
  };
  static std::uint32_t Hash(const Table& table, const Descriptor& descriptor);
  void Insert(Table& table, std::uint32_t entry);
  void Erase(Table& table, std::uint32_t entry);
  void Split(Table& table, std::uint32_t node, std::size_t depth);
  static void Merge(Table& table, std::uint32_t node);
  static const std::vector<std::uint32_t>& Bucket(const Table& table, const Descriptor& descriptor);

  std::array<Table, kNumTables> tables_;
  std::vector<Entry> entries_;
  std::vector<std::vector<std::uint32_t>> entries_of_;  // of each keyframe
  std::vector<std::uint32_t> free_;                     // entries of keyframes removed
};

// The features of a view that have a map point: what can be found again in space.
std::vector<Feature> FeaturesWithPoints(const View& view);

}  // namespace mono3d::tracking
