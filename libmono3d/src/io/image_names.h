// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string_view>

namespace mono3d {

// Is `a` before `b` when runs of digits are compared as numbers? img2 before img10. A strict order:
// names that differ in leading zeros alone are told apart by their bytes.
bool NaturalLess(std::string_view a, std::string_view b);

// By the name alone: jpg jpeg png bmp tif tiff webp pgm ppm, in any case.
bool HasImageExtension(const std::filesystem::path& path);

// The folder that has the images of a sequence: `folder`/images where that is there.
std::filesystem::path ImageFolder(const std::filesystem::path& folder);

}  // namespace mono3d
