// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>

namespace mono3d {

// What run.json says; an empty object where it is not there, or no JSON object. Nothing of what
// lies deeper than a run writes is read.
nlohmann::json ReadRunRecord(const std::filesystem::path& file);

}  // namespace mono3d
