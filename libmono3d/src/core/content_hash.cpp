// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "core/content_hash.h"

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstring>

namespace mono3d {
namespace {

// Good multipliers of 64 bits (Steele and Vigna 2021).
constexpr std::array<std::uint64_t, 4> kFactors = {0xD1342543DE82EF95U, 0xAF251AF3B0F025B5U,
                                                   0xB564EF22EC7AECE5U, 0xF7C2EBC08F67F2B5U};

// Two rounds of shift and multiply: every bit depends on every one.
std::uint64_t Mixed(std::uint64_t x) {
  x = (x ^ (x >> 32U)) * kFactors[0];
  x = (x ^ (x >> 29U)) * kFactors[1];
  return x ^ (x >> 32U);
}

}  // namespace

// Four lanes of 64 bits, each a bijection of what it has for every word: what differs in one place
// differs at the end.
std::array<std::uint64_t, 2> ContentHash(std::string_view bytes) {
  constexpr std::size_t kStripe = 4 * sizeof(std::uint64_t);
  std::array<std::uint64_t, 4> lanes = kFactors;
  const auto take = [&](const char* stripe) {
    std::array<std::uint64_t, 4> words{};
    std::memcpy(words.data(), stripe, kStripe);
    for (std::size_t i = 0; i < lanes.size(); ++i) {
      lanes[i] = std::rotl((lanes[i] ^ words[i]) * kFactors[i], 29);
    }
  };
  const std::uint64_t size = bytes.size();
  for (; bytes.size() >= kStripe; bytes.remove_prefix(kStripe)) take(bytes.data());
  std::array<char, kStripe> rest{};
  std::copy(bytes.begin(), bytes.end(), rest.begin());
  take(rest.data());
  std::array<std::uint64_t, 2> hash = {Mixed(size), Mixed(~size)};
  for (const std::uint64_t lane : lanes) {
    hash[0] = Mixed(hash[0] ^ lane);
    hash[1] = Mixed(hash[1] + lane * kFactors[0]);
  }
  return hash;
}

}  // namespace mono3d
