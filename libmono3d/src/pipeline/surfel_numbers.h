// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>

#include "mono3d/fusion/surfel_changes.h"

namespace mono3d {

// Numbers of surfels that are handed out, from one run after the other: those of a later run are
// not taken for those of an earlier one.
class SurfelNumbers {
 public:
  // The version to ask the run in use about, for who has what was handed out with `version`.
  std::uint64_t OwnVersion(std::uint64_t version) const {
    return version > first_version_ ? version - first_version_ : 0;
  }
  void Renumber(SurfelChanges& surfels) const;
  void NoteHandedOut(const SurfelChanges& surfels);
  // What is handed out from now on is of another run.
  void BeginRun();

 private:
  std::uint64_t first_version_ = 0, last_version_ = 0;
  std::uint32_t first_anchor_ = 0, next_anchor_ = 0;
};

}  // namespace mono3d
