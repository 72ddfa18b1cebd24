// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string_view>

namespace mono3d {

// Throws Error unless what the headers of an OpenEXR file claim lies within the file and within
// the sizes that mono3d reads. OpenEXR takes as much memory as an attribute claims to have before
// it reads it, and memory for whole blocks of lines of all channels before a pixel is asked for.
void RequireSoundExrHeaders(std::string_view bytes, const std::filesystem::path& path);

}  // namespace mono3d
