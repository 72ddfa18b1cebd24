// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "core/state_sections.h"

#include <bit>
#include <cstddef>
#include <cstring>

#include "core/byte_archive.h"

namespace mono3d {
namespace {

constexpr std::size_t kSectionHeadSize = 2 * sizeof(std::uint64_t);

}  // namespace

// FNV-1a with words in the place of bytes, and the high bits brought down, where multiplication
// leaves what the low ones know of them.
std::uint64_t ChecksumOf(std::string_view bytes) {
  constexpr std::uint64_t kPrime = 1099511628211U;
  std::uint64_t hash = 14695981039346656037U ^ bytes.size();
  const auto add = [&](std::uint64_t word) {
    hash = (hash ^ word) * kPrime;
    hash ^= hash >> 32U;
  };
  while (bytes.size() >= sizeof(std::uint64_t)) {
    std::uint64_t word = 0;
    std::memcpy(&word, bytes.data(), sizeof(word));
    add(word);
    bytes.remove_prefix(sizeof(word));
  }
  std::uint64_t last = 0;
  std::memcpy(&last, bytes.data(), bytes.size());
  add(last);
  return hash;
}

std::string ToSection(std::string_view bytes) {
  ByteWriter head;
  std::uint64_t size = bytes.size();
  std::uint64_t checksum = ChecksumOf(bytes);
  head.Number(size);
  head.Number(checksum);
  return head.TakeBytes().append(bytes);
}

std::vector<StateSection> SectionsOf(std::string_view state, const std::string& what,
                                     const std::string& where) {
  std::vector<StateSection> sections;
  while (!state.empty()) {
    ByteReader head(state, what, where);
    std::uint64_t size = 0;
    StateSection section;
    head.Number(size);
    head.Number(section.checksum);
    if (size > state.size() - kSectionHeadSize) head.Refuse("ends too early");
    section.bytes = state.substr(0, kSectionHeadSize + size);
    state.remove_prefix(section.bytes.size());
    sections.push_back(section);
  }
  return sections;
}

}  // namespace mono3d
