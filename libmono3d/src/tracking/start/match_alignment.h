// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <optional>

#include "tracking/alignment/patch_alignment.h"
#include "tracking/features/matching.h"
#include "tracking/map/map.h"

namespace mono3d::tracking {

// Where view b shows the patch around a match's feature in view a, to a fraction of a pixel: a
// corner is sure to about one. The patch is not warped, as no motion is known yet. Nothing where it
// is not found again, or where one of the views has no image.
std::optional<PatchPosition> AlignMatch(const View& a, const View& b, const FeatureMatch& match);

}  // namespace mono3d::tracking
