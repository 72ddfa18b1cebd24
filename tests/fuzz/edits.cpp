// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fuzz/edits.h"

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "core/state_sections.h"

namespace mono3d::fuzz {
namespace {

enum class Kind : std::uint8_t { kOverwrite, kInsert, kCut, kLeaveOut, kRepeat, kCount };

std::size_t TakeNumber(std::string_view& input, std::size_t num_bytes) {
  std::size_t number = 0;
  for (std::size_t i = 0; i < num_bytes && !input.empty(); ++i, input.remove_prefix(1)) {
    number |= static_cast<std::size_t>(static_cast<std::uint8_t>(input.front())) << (8 * i);
  }
  return number;
}

void EditPart(Kind kind, std::size_t place, std::string_view bytes, std::string& part) {
  place %= part.size() + 1;
  if (kind == Kind::kInsert) {
    part.insert(place, bytes);
  } else if (kind == Kind::kCut) {
    part.resize(place);
  } else {
    const std::size_t num_there = std::min(bytes.size(), part.size() - place);
    part.replace(place, num_there, bytes.substr(0, num_there));
  }
}

}  // namespace

void Edit(std::string_view input, std::vector<std::string>& parts) {
  while (!input.empty() && !parts.empty()) {
    const std::size_t number = TakeNumber(input, 2) % parts.size();
    const auto kind =
        static_cast<Kind>(TakeNumber(input, 1) % static_cast<std::size_t>(Kind::kCount));
    const std::size_t place = TakeNumber(input, 3);
    // Taken before it is asked how much is left: compilers differ in the order of arguments.
    const std::size_t num_wanted = TakeNumber(input, 1);
    const std::size_t num_bytes = std::min(num_wanted, input.size());
    const std::string_view bytes = input.substr(0, num_bytes);
    input.remove_prefix(num_bytes);
    const auto part = parts.begin() + static_cast<std::ptrdiff_t>(number);
    if (kind == Kind::kLeaveOut) {
      parts.erase(part);
    } else if (kind == Kind::kRepeat) {
      const std::string copy = *part;
      parts.insert(part, copy);
    } else {
      EditPart(kind, place, bytes, *part);
    }
  }
}

std::string EditedState(std::string_view input, const std::string& state) {
  constexpr std::size_t kHeadBytes = 2 * sizeof(std::uint64_t);
  std::vector<std::string> contents;
  for (const StateSection& section : SectionsOf(state, "state", "base")) {
    contents.emplace_back(section.bytes.substr(kHeadBytes));
  }
  Edit(input, contents);
  std::string edited;
  for (const std::string& content : contents) edited += ToSection(content);
  return edited;
}

}  // namespace mono3d::fuzz
