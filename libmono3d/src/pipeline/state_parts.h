// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <string_view>

#include "mono3d/core/state_folder.h"

namespace mono3d {

// The sections of a state (core/state_sections.h) as parts of the save that is being made, each
// section one: those that are as in the last save are not written again. Their names begin with
// `name`.
void PutSections(StateFolder& folder, const std::string& name, std::string_view state);

// The state again. Throws Error where the folder does not have all of it.
std::string GetSections(const StateFolder& folder, const std::string& name);

}  // namespace mono3d
