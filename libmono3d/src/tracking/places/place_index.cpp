// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/places/place_index.h"

#include <algorithm>
#include <limits>
#include <random>

#include "image/state_archive.h"
#include "tracking/features/descriptor.h"

namespace mono3d::tracking {
namespace {

// A bucket with more entries says nothing about the place, and costs most of the time.
constexpr std::size_t kMaxBucket = 200;

}  // namespace

std::vector<Feature> FeaturesWithPoints(const View& view) {
  std::vector<Feature> features;
  for (std::size_t i = 0; i < view.points.size(); ++i) {
    if (view.points[i]) features.push_back(view.features[i]);
  }
  return features;
}

PlaceIndex::PlaceIndex() {
  std::mt19937 random(1);  // its sequence is laid down by the standard
  for (auto& bits : bits_) {
    for (std::uint8_t& bit : bits) bit = static_cast<std::uint8_t>(random() % kDescriptorBits);
  }
  for (auto& table : buckets_) table.resize(std::size_t{1} << kNumBits);
}

std::uint32_t PlaceIndex::Hash(const Descriptor& descriptor, std::size_t table) const {
  std::uint32_t hash = 0;
  for (const std::uint8_t bit : bits_[table]) {
    hash = (hash << 1U) | static_cast<std::uint32_t>((descriptor[bit / 64U] >> (bit % 64U)) & 1U);
  }
  return hash;
}

void PlaceIndex::Add(KeyframeId keyframe, std::span<const Feature> features) {
  Remove(keyframe);
  if (entries_of_.size() <= keyframe) entries_of_.resize(keyframe + 1);
  for (const Feature& feature : features) {
    if (free_.empty()) {
      free_.push_back(static_cast<std::uint32_t>(entries_.size()));
      entries_.emplace_back();
    }
    const std::uint32_t entry = free_.back();
    free_.pop_back();
    entries_[entry] = {feature.descriptor, keyframe};
    entries_of_[keyframe].push_back(entry);
    for (std::size_t table = 0; table < kNumTables; ++table) {
      buckets_[table][Hash(feature.descriptor, table)].push_back(entry);
    }
  }
}

void PlaceIndex::Remove(KeyframeId keyframe) {
  if (keyframe >= entries_of_.size()) return;
  for (const std::uint32_t entry : entries_of_[keyframe]) {
    for (std::size_t table = 0; table < kNumTables; ++table) {
      std::vector<std::uint32_t>& bucket = buckets_[table][Hash(entries_[entry].descriptor, table)];
      std::erase(bucket, entry);
      // Else every bucket that was ever used would keep its memory.
      if (bucket.empty()) bucket = std::vector<std::uint32_t>();
    }
    free_.push_back(entry);
  }
  entries_of_[keyframe] = std::vector<std::uint32_t>();
}

std::vector<PlaceMatch> PlaceIndex::Query(std::span<const Feature> features,
                                          std::size_t max_matches,
                                          const std::vector<char>& is_left_out) const {
  std::vector<int> votes(entries_of_.size(), 0);
  // One vote of each feature; those left out have had it.
  constexpr std::size_t kAlways = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> voted_by(entries_of_.size(), features.size());
  for (KeyframeId id = 0; id < std::min(is_left_out.size(), voted_by.size()); ++id) {
    if (is_left_out[id] != 0) voted_by[id] = kAlways;
  }
  for (std::size_t i = 0; i < features.size(); ++i) {
    for (std::size_t table = 0; table < kNumTables; ++table) {
      const auto& bucket = buckets_[table][Hash(features[i].descriptor, table)];
      if (bucket.size() > kMaxBucket) continue;
      for (const std::uint32_t index : bucket) {
        const Entry& entry = entries_[index];
        const std::size_t voter = voted_by[entry.keyframe];
        if (voter == i || voter == kAlways) continue;
        if (Distance(entry.descriptor, features[i].descriptor) > kCloseDistance) continue;
        voted_by[entry.keyframe] = i;
        ++votes[entry.keyframe];
      }
    }
  }
  std::vector<PlaceMatch> matches;
  for (KeyframeId id = 0; id < votes.size(); ++id) {
    if (votes[id] > 0) matches.push_back({id, votes[id]});
  }
  std::stable_sort(matches.begin(), matches.end(), [](const PlaceMatch& a, const PlaceMatch& b) {
    return a.num_votes > b.num_votes;
  });
  matches.resize(std::min(matches.size(), max_matches));
  return matches;
}

template <typename Archive>
void PlaceIndex::ExchangeState(Archive& archive, std::size_t num_keyframes) {
  // Those of a keyframe never change while it stays.
  std::vector<std::vector<Feature>> features_of;
  if constexpr (!Archive::kReads) {
    for (const std::vector<std::uint32_t>& entries : entries_of_) {
      features_of.emplace_back();
      for (const std::uint32_t entry : entries) {
        features_of.back().emplace_back().descriptor = entries_[entry].descriptor;
      }
    }
    // Of keyframes that the map has taken back.
    while (!features_of.empty() && features_of.back().empty()) features_of.pop_back();
  }
  archive.Sections(features_of, 1, [&](std::vector<Feature>& features) {
    archive.List(features, [&](Feature& feature) {
      archive.Numbers(feature.descriptor.data(), feature.descriptor.size());
    });
  });
  if constexpr (Archive::kReads) {
    if (features_of.size() > num_keyframes) archive.Refuse("contradicts itself");
    *this = PlaceIndex();
    for (KeyframeId id = 0; id < features_of.size(); ++id) Add(id, features_of[id]);
  }
}

template void PlaceIndex::ExchangeState(StateWriter&, std::size_t);
template void PlaceIndex::ExchangeState(StateReader&, std::size_t);

}  // namespace mono3d::tracking
