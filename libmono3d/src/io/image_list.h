// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <string_view>

#include "io/image_names.h"

namespace mono3d {

// Does `input` hold one of * ? [ without being a file or folder of that name?
bool IsGlob(std::string_view input);

// What the user calls the input: a folder or a glob, one image, or a video (any other file). Throws
// Error when there is no such file.
enum class InputKind { kImages, kImage, kVideo };
InputKind KindOfInput(const std::string& input);

}  // namespace mono3d
