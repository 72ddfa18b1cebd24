// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/places/place_index.h"

#include <gtest/gtest.h>

#include <random>

#include "reference/random.h"

namespace mono3d::tracking {
namespace {

std::vector<Feature> RandomFeatures(int count, std::mt19937_64& random) {
  std::vector<Feature> features(static_cast<std::size_t>(count));
  for (Feature& feature : features) {
    for (std::uint64_t& word : feature.descriptor) word = random();
  }
  return features;
}

// The same patches seen again: each descriptor differs in `num_bits` places.
std::vector<Feature> SeenAgain(std::vector<Feature> features, int num_bits,
                               std::mt19937_64& random) {
  for (Feature& feature : features) {
    for (int i = 0; i < num_bits; ++i) {
      const auto bit = static_cast<std::size_t>(random() % kDescriptorBits);
      feature.descriptor[bit / 64] ^= std::uint64_t{1} << (bit % 64);
    }
  }
  return features;
}

TEST(PlaceIndex, FindsNothingWhileEmpty) {
  std::mt19937_64 random(SeedFromTestName());
  EXPECT_TRUE(PlaceIndex().Query(RandomFeatures(50, random), 5).empty());
}

TEST(PlaceIndex, CountsEachFeatureOnce) {
  std::mt19937_64 random(SeedFromTestName());
  const std::vector<Feature> features = RandomFeatures(50, random);
  PlaceIndex index;
  index.Add(3, features);
  const std::vector<PlaceMatch> matches = index.Query(features, 5);
  ASSERT_EQ(matches.size(), 1U);
  EXPECT_EQ(matches[0].keyframe, 3U);
  EXPECT_EQ(matches[0].num_votes, 50);
}

TEST(PlaceIndex, KnowsEachPlaceAgainAmongAHundred) {
  constexpr int kNumFeatures = 300;
  std::mt19937_64 random(SeedFromTestName());
  PlaceIndex index;
  std::vector<std::vector<Feature>> places;
  for (KeyframeId id = 0; id < 100; ++id) {
    places.push_back(RandomFeatures(kNumFeatures, random));
    index.Add(id, places.back());
  }
  for (KeyframeId id = 0; id < places.size(); ++id) {
    // 30 of 256 bits differ: a hash of 14 bits survives with (1 - 30/256)^14 = 17 %, one of eight
    // tables with 78 %.
    const auto matches = index.Query(SeenAgain(places[id], 30, random), 3);
    ASSERT_FALSE(matches.empty());
    EXPECT_EQ(matches[0].keyframe, id);
    EXPECT_GT(matches[0].num_votes, kNumFeatures / 2);
  }
  // A place not seen before: random descriptors differ in 128 +- 8 bits.
  for (const PlaceMatch& match : index.Query(RandomFeatures(kNumFeatures, random), 3)) {
    EXPECT_LT(match.num_votes, 3);
  }
}

// Descriptors that are as unlike each other as those of images are: their bits are not even.
std::vector<Feature> UnevenFeatures(int count, std::mt19937_64& random) {
  std::vector<Feature> features(static_cast<std::size_t>(count));
  for (Feature& feature : features) {
    for (std::uint64_t& word : feature.descriptor) word = random() & (random() | random());
  }
  return features;
}

TEST(PlaceIndex, ComparesAnImageWithNoMoreTheMorePlacesThereAre) {
  constexpr int kNumFeatures = 200;
  // Buckets of 64 at most, in eight tables, of which some are halves of 65.
  constexpr std::size_t kMaxCompared = 8 * 64 * kNumFeatures;
  std::mt19937_64 random(SeedFromTestName());
  const std::vector<Feature> place = UnevenFeatures(kNumFeatures, random);
  PlaceIndex index;
  index.Add(0, place);
  std::size_t num_at_half = 0;
  constexpr KeyframeId kNumPlaces = 3000;
  for (KeyframeId id = 1; id < kNumPlaces; ++id) {
    index.Add(id, UnevenFeatures(kNumFeatures, random));
    if (id == kNumPlaces / 2) num_at_half = index.NumCompared(place);
  }
  EXPECT_LT(index.NumCompared(place), kMaxCompared);
  // It goes up and down with how full the buckets are, by a factor of two at most.
  EXPECT_LT(index.NumCompared(place), 1.5 * static_cast<double>(num_at_half));
  // And finds it all the same: of 20 bits changed, (1 - 20/256)^19 = 21 % of the hashes stay.
  const auto matches = index.Query(SeenAgain(place, 20, random), 2);
  ASSERT_FALSE(matches.empty());
  EXPECT_EQ(matches[0].keyframe, 0U);
  EXPECT_GT(matches[0].num_votes, kNumFeatures / 2);
}

TEST(PlaceIndex, AnswersByWhatItHasAndNotByWhatItHad) {
  std::mt19937_64 random(SeedFromTestName());
  const std::vector<Feature> place = RandomFeatures(100, random);
  const std::vector<Feature> query = SeenAgain(place, 25, random);
  PlaceIndex index;
  PlaceIndex other;
  for (KeyframeId id = 0; id < 40; ++id) index.Add(id, SeenAgain(place, 10, random));
  for (KeyframeId id = 40; id < 300; ++id) {  // in the same buckets
    const std::vector<Feature> added = SeenAgain(place, 10, random);
    index.Add(id, added);
    if (id >= 260) other.Add(id, added);
  }
  for (KeyframeId id = 0; id < 260; ++id) index.Remove(id);
  EXPECT_EQ(index.NumCompared(query), other.NumCompared(query));
  const std::vector<PlaceMatch> matches = index.Query(query, 50);
  const std::vector<PlaceMatch> expected = other.Query(query, 50);
  ASSERT_EQ(matches.size(), expected.size());
  for (std::size_t i = 0; i < matches.size(); ++i) {
    EXPECT_EQ(matches[i].keyframe, expected[i].keyframe);
    EXPECT_EQ(matches[i].num_votes, expected[i].num_votes);
  }
}

TEST(PlaceIndex, PutsThePlaceThatSharesMoreFirst) {
  std::mt19937_64 random(SeedFromTestName());
  const std::vector<Feature> features = RandomFeatures(60, random);
  PlaceIndex index;
  index.Add(0, std::span(features).first(20));
  index.Add(1, std::span(features).first(40));
  index.Add(2, std::span(features).first(20));
  const std::vector<PlaceMatch> matches = index.Query(features, 2);
  ASSERT_EQ(matches.size(), 2U);
  EXPECT_EQ(matches[0].keyframe, 1U);
  EXPECT_EQ(matches[1].keyframe, 0U);  // the older of equals
  EXPECT_EQ(matches[1].num_votes, 20);
}

TEST(PlaceIndex, LeavesOutTheKeyframesThatAreNotAskedFor) {
  std::mt19937_64 random(SeedFromTestName());
  const std::vector<Feature> features = RandomFeatures(50, random);
  PlaceIndex index;
  for (KeyframeId id = 0; id < 3; ++id) index.Add(id, features);
  const std::vector<PlaceMatch> matches = index.Query(features, 5, {1, 0});
  ASSERT_EQ(matches.size(), 2U);
  EXPECT_EQ(matches[0].keyframe, 1U);
  EXPECT_EQ(matches[0].num_votes, 50);
  EXPECT_EQ(matches[1].keyframe, 2U);                           // beyond the list
  EXPECT_TRUE(index.Query(features, 5, {1, 1, 1, 1}).empty());  // longer than there are keyframes
}

TEST(PlaceIndex, PutsAKeyframeInPlaceOfWhatItHadOfIt) {
  std::mt19937_64 random(SeedFromTestName());
  const std::vector<Feature> features = RandomFeatures(50, random);
  PlaceIndex index;
  index.Add(2, std::span(features).first(20));
  index.Add(2, std::span(features).last(30));
  EXPECT_EQ(index.num_entries(), 30U);
  const std::vector<PlaceMatch> matches = index.Query(features, 5);
  ASSERT_EQ(matches.size(), 1U);
  EXPECT_EQ(matches[0].num_votes, 30);
}

TEST(PlaceIndex, ForgetsAKeyframeAndUsesItsRoomAgain) {
  std::mt19937_64 random(SeedFromTestName());
  const std::vector<Feature> first = RandomFeatures(50, random);
  const std::vector<Feature> second = RandomFeatures(50, random);
  PlaceIndex index;
  index.Add(0, first);
  index.Add(1, second);
  index.Remove(0);
  index.Remove(0);   // forgotten already
  index.Remove(99);  // never known
  for (const PlaceMatch& match : index.Query(first, 5)) EXPECT_EQ(match.keyframe, 1U);
  index.Add(2, first);
  EXPECT_EQ(index.num_entries(), 100U);
  ASSERT_FALSE(index.Query(first, 1).empty());
  EXPECT_EQ(index.Query(first, 1)[0].keyframe, 2U);
  EXPECT_EQ(index.Query(first, 1)[0].num_votes, 50);
  EXPECT_EQ(index.Query(second, 1)[0].num_votes, 50);
}

}  // namespace
}  // namespace mono3d::tracking
