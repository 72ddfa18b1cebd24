// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>

#include "mono3d/pipeline/run_writer.h"

namespace mono3d {

// The text of run.json.
std::string RunJson(const Reconstruction& reconstruction, const RunRecord& record);

}  // namespace mono3d
