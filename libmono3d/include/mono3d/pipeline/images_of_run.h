// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/pipeline/reconstruction.h"

namespace MONO3D_EXPORT mono3d {

// The folder beside sparse/ in which programs look for the images that it names.
inline constexpr std::string_view kImagesOfRun = "images";

enum class ImagePlacing {
  kLink,  // images that are files are linked; copied where the file system has no links
  kCopy,
  kNone,  // nothing is written
};

// Makes `folder` (in which sparse/ is) a workspace that COLMAP and what reads its files can go on
// in: folder/images holds the images of the keyframes of all maps as they were taken, the sparse
// models name them, and have no image that is not there, as those of a map that was loaded. Frames
// of a video become NNNNNN.jpg, NNNNNN being the number of the frame as in depth/; images of a
// folder or glob, `input`, keep their names, with "_" for blanks, which COLMAP's text form does not
// take, and "NNNNNN_" before the name where there are several of it. With kNone only the names are
// given.
// Where folder/images is the input itself, or holds something that is not an earlier run's, nothing
// is written, with a warning in the log in the second case. Throws Error when an image cannot be
// written.
void PlaceImagesOfRun(const std::string& input, ImagePlacing placing,
                      const std::filesystem::path& folder, Reconstruction& reconstruction);

// The files that PlaceImagesOfRun wrote into `images`, by their names.
std::vector<std::string> NamesOfPlacedImages(const std::filesystem::path& images);

// Is there nothing in `images` but these, so that other images may take their place?
bool MayPlaceImages(const std::filesystem::path& images);

}  // namespace mono3d
