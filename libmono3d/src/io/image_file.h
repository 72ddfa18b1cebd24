// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "mono3d/io/image_file.h"

namespace mono3d {

// How many bits the values of images use: 16, or as few as 8 where the largest value of some of
// them needs 14 or fewer. Cameras of 10, 12 or 14 bits leave the upper bits empty, and the upper 8
// of 16 would be black. Of images of 8 bits it is 16. What cannot be read is passed over.
int FindValueBits(const std::vector<std::string>& images);

// Before it is decoded: a small file may say that its image is huge. Throws Error when it has more
// than 268 million pixels, or its size cannot be found.
void RequireDecodableSize(const std::filesystem::path& path);

// Do the chunks of the PNG file with these bytes go on to the last one?
bool IsCompletePng(std::string_view bytes);

}  // namespace mono3d
