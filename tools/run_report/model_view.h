// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <string>

#include "mono3d/pipeline/reconstruction.h"

namespace mono3d::tools {

inline constexpr std::size_t kMaxViewSurfels = 100'000;

// A part of a page that shows a sample of the map's model and the path of the camera in 3D, to be
// turned and enlarged: WebGL2, no network. About 16 bytes of text a surfel. Empty without a model.
std::string ModelViewHtml(const MapReconstruction& map, bool is_path,
                          std::size_t max_surfels = kMaxViewSurfels);

}  // namespace mono3d::tools
