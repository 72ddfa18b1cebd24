// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "keyframes/view.h"

namespace mono3d {

// The references that have been chosen so far, and what a further one would add to them. Keeps
// about a kilobyte of each, no images.
class ReferenceSpacing {
 public:
  // The least baseline between two references over the median depth, unless the second one shows
  // at least this share of new surface.
  ReferenceSpacing(double min_baseline_ratio, double min_new_share)
      : min_baseline_ratio_(min_baseline_ratio), min_new_share_(min_new_share) {}

  void Add(const View& reference);
  // For the archives of image/state_archive.h.
  template <typename Archive>
  void ExchangeState(Archive& archive) {
    constexpr std::size_t kReferencesOfSection = 16;  // they never change
    archive.Sections(references_, kReferencesOfSection, [&](Reference& reference) {
      reference.view.ExchangeState(archive);
      archive.Number(reference.has_depth);
    });
  }
  // No depth came of it: what it shows is not known.
  void NoteNoDepth(std::int64_t reference_id);

  // Is there a reference from about the same place that shows most of what this view shows, in
  // about the same detail?
  bool HasLike(const View& view, const KeyframePoses& poses) const;

  // The share of what the view shows that no reference with a depth map shows in about the same
  // detail.
  double NewShare(const View& view, const KeyframePoses& poses) const;

 private:
  struct Reference {
    View view;
    bool has_depth = true;  // as far as is known
  };

  double min_baseline_ratio_;
  double min_new_share_;
  std::vector<Reference> references_;
};

}  // namespace mono3d
