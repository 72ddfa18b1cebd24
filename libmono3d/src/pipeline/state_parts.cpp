// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/state_parts.h"

#include <cstddef>

#include "core/state_sections.h"

namespace mono3d {
namespace {

std::string SectionName(const std::string& name, std::size_t number) {
  return name + "/" + std::to_string(number);
}

}  // namespace

void PutSections(StateFolder& folder, const std::string& name, std::string_view state) {
  std::size_t number = 0;
  for (const StateSection& section : SectionsOf(state, name, folder.path().string())) {
    folder.Put(SectionName(name, number), section.bytes);
    ++number;
  }
}

std::string GetSections(const StateFolder& folder, const std::string& name) {
  std::string state = folder.Get(SectionName(name, 0));  // which each state has
  for (std::size_t number = 1; folder.Has(SectionName(name, number)); ++number) {
    state += folder.Get(SectionName(name, number));
  }
  return state;
}

}  // namespace mono3d
