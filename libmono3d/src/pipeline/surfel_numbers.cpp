// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/surfel_numbers.h"

#include <algorithm>

namespace mono3d {

void SurfelNumbers::Renumber(SurfelChanges& surfels) const {
  surfels.version += first_version_;
  for (SurfelAnchor& anchor : surfels.anchors) anchor.number += first_anchor_;
  for (SurfelChunk& chunk : surfels.changed) chunk.anchor += first_anchor_;
}

void SurfelNumbers::NoteHandedOut(const SurfelChanges& surfels) {
  last_version_ = std::max(last_version_, surfels.version);
  for (const SurfelAnchor& anchor : surfels.anchors) {
    next_anchor_ = std::max(next_anchor_, anchor.number + 1);
  }
}

void SurfelNumbers::BeginRun() {
  first_version_ = last_version_;
  first_anchor_ = next_anchor_;
}

}  // namespace mono3d
