// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>

#include "mono3d/pipeline/next_views.h"
#include "mono3d/pipeline/reconstruction.h"
#include "report/page.h"

namespace mono3d::tools {

// next_views.json: positions and directions in the axes of trajectory.txt. Throws Error when it
// cannot be written.
void WriteNextViews(const std::filesystem::path& folder, const NextViews& next);

// The part of the page of a run that shows them; without a title where there is nothing to tell.
Section NextViewsSection(const MapReconstruction& map, const NextViews& next);

}  // namespace mono3d::tools
