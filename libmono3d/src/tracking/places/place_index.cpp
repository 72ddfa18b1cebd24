// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/places/place_index.h"

#include <algorithm>
#include <limits>
#include <random>
#include <utility>

#include "image/state_archive.h"
#include "tracking/features/descriptor.h"

namespace mono3d::tracking {
namespace {

// Of these, a query compares with all.
constexpr std::size_t kMaxBucket = 64;
// Where all bits agree, more entries say nothing about the place, and cost most of the time.
constexpr std::size_t kMaxAlike = 200;

bool HasBit(const Descriptor& descriptor, std::uint8_t bit) {
  return ((descriptor[bit / 64U] >> (bit % 64U)) & 1U) != 0;
}

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
  const auto draw = [&](std::size_t begin, std::size_t end) {
    for (Table& table : tables_) {
      for (std::size_t i = begin; i < end; ++i) {
        table.bits[i] = static_cast<std::uint8_t>(random() % kDescriptorBits);
      }
    }
  };
  draw(0, kNumBits);
  draw(kNumBits, kMaxBits);
  for (Table& table : tables_) table.nodes.resize(std::size_t{1} << kNumBits);
}

std::uint32_t PlaceIndex::Hash(const Table& table, const Descriptor& descriptor) {
  std::uint32_t hash = 0;
  for (std::size_t i = 0; i < kNumBits; ++i) {
    hash = (hash << 1U) | (HasBit(descriptor, table.bits[i]) ? 1U : 0U);
  }
  return hash;
}

void PlaceIndex::Insert(Table& table, std::uint32_t entry) {
  const Descriptor& descriptor = entries_[entry].descriptor;
  std::uint32_t at = Hash(table, descriptor);
  std::size_t depth = kNumBits;
  for (; table.nodes[at].first_child != 0; ++depth) {
    ++table.nodes[at].num_entries;
    at = table.nodes[at].first_child + (HasBit(descriptor, table.bits[depth]) ? 1U : 0U);
  }
  ++table.nodes[at].num_entries;
  table.nodes[at].entries.push_back(entry);
  Split(table, at, depth);
}

// As long as there are too many: the bits that follow may be the same for all.
void PlaceIndex::Split(Table& table, std::uint32_t node, std::size_t depth) {
  while (table.nodes[node].num_entries > kMaxBucket && depth < kMaxBits) {
    if (table.free_pairs.empty()) {
      table.free_pairs.push_back(static_cast<std::uint32_t>(table.nodes.size()));
      table.nodes.resize(table.nodes.size() + 2);
    }
    const std::uint32_t first_child = table.free_pairs.back();
    table.free_pairs.pop_back();
    table.nodes[node].first_child = first_child;
    for (const std::uint32_t entry : std::exchange(table.nodes[node].entries, {})) {
      const bool bit = HasBit(entries_[entry].descriptor, table.bits[depth]);
      Node& child = table.nodes[first_child + (bit ? 1U : 0U)];
      child.entries.push_back(entry);
      ++child.num_entries;
    }
    const bool is_second = table.nodes[first_child].num_entries == 0 ||
                           table.nodes[first_child + 1].num_entries > kMaxBucket;
    node = first_child + (is_second ? 1U : 0U);
    ++depth;
  }
}

void PlaceIndex::Erase(Table& table, std::uint32_t entry) {
  const Descriptor& descriptor = entries_[entry].descriptor;
  std::uint32_t at = Hash(table, descriptor);
  for (std::size_t depth = kNumBits;; ++depth) {
    Node& node = table.nodes[at];
    --node.num_entries;
    if (node.first_child != 0 && node.num_entries <= kMaxBucket) Merge(table, at);
    if (node.first_child == 0) break;
    at = node.first_child + (HasBit(descriptor, table.bits[depth]) ? 1U : 0U);
  }
  std::vector<std::uint32_t>& bucket = table.nodes[at].entries;
  std::erase(bucket, entry);
  // Else every bucket that was ever used would keep its memory.
  if (bucket.empty()) bucket = std::vector<std::uint32_t>();
}

// The nodes below become one bucket again, with the entry that is about to be erased.
void PlaceIndex::Merge(Table& table, std::uint32_t node) {
  std::vector<std::uint32_t> pairs = {table.nodes[node].first_child};
  std::vector<std::uint32_t> entries;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    for (const std::uint32_t child : {pairs[i], pairs[i] + 1}) {
      Node& below = table.nodes[child];
      entries.insert(entries.end(), below.entries.begin(), below.entries.end());
      if (below.first_child != 0) pairs.push_back(below.first_child);
      below = {};
    }
    table.free_pairs.push_back(pairs[i]);
  }
  table.nodes[node].first_child = 0;
  table.nodes[node].entries = std::move(entries);
}

const std::vector<std::uint32_t>& PlaceIndex::Bucket(const Table& table,
                                                     const Descriptor& descriptor) {
  static const std::vector<std::uint32_t> nothing;
  std::uint32_t at = Hash(table, descriptor);
  for (std::size_t depth = kNumBits; table.nodes[at].first_child != 0; ++depth) {
    at = table.nodes[at].first_child + (HasBit(descriptor, table.bits[depth]) ? 1U : 0U);
  }
  const std::vector<std::uint32_t>& bucket = table.nodes[at].entries;
  return bucket.size() > kMaxAlike ? nothing : bucket;
}

std::size_t PlaceIndex::NumCompared(std::span<const Feature> features) const {
  std::size_t count = 0;
  for (const Feature& feature : features) {
    for (const Table& table : tables_) count += Bucket(table, feature.descriptor).size();
  }
  return count;
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
    for (Table& table : tables_) Insert(table, entry);
  }
}

void PlaceIndex::Remove(KeyframeId keyframe) {
  if (keyframe >= entries_of_.size()) return;
  for (const std::uint32_t entry : entries_of_[keyframe]) {
    for (Table& table : tables_) Erase(table, entry);
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
    for (const Table& table : tables_) {
      for (const std::uint32_t index : Bucket(table, features[i].descriptor)) {
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
