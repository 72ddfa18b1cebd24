// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "keyframes/view.h"

namespace mono3d {

struct SourceChoiceOptions {
  std::size_t num_sources = 4;  // even
  double step_deg = 3;  // angle between neighbouring images at the points they share, aimed at
  double max_angle_deg = 30;         // of a source against the reference
  double min_baseline_ratio = 0.02;  // between neighbouring images
};

enum class SourceGrade {
  kWeak,      // less baseline than is aimed for at least
  kOneSided,  // all on one side of the reference
  kGood,
};

// The sources of a reference; indices into the views. The sides are as in ImageBundle.
struct SourceChoice {
  std::vector<std::size_t> first;
  std::vector<std::size_t> second;
  SourceGrade grade = SourceGrade::kWeak;
  double baseline_ratio = 0;  // largest, over the median depth
};

// Can it be matched with the reference at all?
bool IsUsable(const CommonView& common, double max_angle_deg);

// How well the view serves as a source whose angle should be `angle_deg`, 0 to 1: by the points
// that it shares with the reference, each by its angle, and by likeness of scale and of the
// pictures' upright direction. As MVSNet (Yao et al. 2018) and COLMAP do, a sum over shared points
// of a bell of their angles; here over the logarithm, since the depth error goes with 1 / angle
// below the best one, and what cannot be matched grows about as slowly above it.
double SourceWeight(const CommonView& common, double angle_deg);

// The best sources of views[reference] among the others. On each side the angles go up in steps
// towards the outermost source; one side alone has steps of half the size. Where baselines are
// below the least that is aimed for, the widest there are. Nothing where fewer than two views can
// be matched with the reference. Of equal ones the view that is nearest in the list is taken. Views
// that are not in the map of the reference are passed over. O(views * points).
std::optional<SourceChoice> ChooseSources(const std::vector<const View*>& views,
                                          std::size_t reference, const KeyframePoses& poses,
                                          const SourceChoiceOptions& options);

}  // namespace mono3d
