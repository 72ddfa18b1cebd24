// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>

#include "evaluate/evaluation.h"

namespace mono3d::tools {

// Reads run.json. Throws Error when it is not JSON.
Json ReadRecord(const std::filesystem::path& path);

// What run.json tells: what became of the frames, the times, the options; called kRecordTitle.
Section RecordSection(const Json& record);

}  // namespace mono3d::tools
