// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>
#include <vector>

#include "tracking/start/two_view_start.h"

namespace mono3d::tracking {

// A view taken between the two of a start, or before them.
struct BetweenView {
  const View* view = nullptr;
  double progress = 0;                // 0 at the first view, 1 at the second
  std::vector<FeatureMatch> matches;  // with the first view
};

// Whether the one motion that two views of a plane leave open is contradicted by others. Where the
// scene is no plane, and has hardly moved, a homography fits it as well, with a motion that is
// neither of the two.
bool IsRefuted(const TwoViewStart& candidate, const View& a, const View& b,
               const std::vector<BetweenView>& between, const CameraModel& camera);

// Which of several motions holds for further views as well. The points are found in all views
// by their patches, each motion is adjusted over all of them (bundle adjustment), and one must
// leave less error than the others beyond what chance explains (Vuong 1989). With a view from
// before, that goes for what only it and the first view show as well. Nothing when none does, or
// when no such view sees enough of the points. `unlikely`: one of these is taken where it is better
// than all candidates beyond chance, and otherwise has no say.
std::optional<TwoViewStart> SelectMotion(const std::vector<TwoViewStart>& candidates,
                                         const std::vector<TwoViewStart>& unlikely, const View& a,
                                         const View& b, const std::vector<BetweenView>& between,
                                         const CameraModel& camera);

}  // namespace mono3d::tracking
