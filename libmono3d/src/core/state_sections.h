// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace mono3d {

// A state of a run is a sequence of sections: each its size and its checksum, 8 bytes each, then so
// many bytes. What belongs together and seldom changes, a keyframe, an image, is a section of its
// own. So whoever keeps one state after the other writes only the sections, by size and checksum,
// that the last state did not have: a state is those it names, one behind the other.
struct StateSection {
  std::uint64_t checksum = 0;  // of the bytes without the two numbers before them
  std::string_view bytes;      // with the two numbers
};

// Of words of eight bytes; detects accidents, not intent.
std::uint64_t ChecksumOf(std::string_view bytes);

// `bytes` with the two numbers before them.
std::string ToSection(std::string_view bytes);

// The sections of a state, which must outlive them. Checksums are as they stand there, not checked.
// Throws Error, which names `what` and `where`, on sections that do not end with the bytes.
std::vector<StateSection> SectionsOf(std::string_view state, const std::string& what,
                                     const std::string& where);

}  // namespace mono3d
