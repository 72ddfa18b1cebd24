// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace mono3d::fuzz {

// Changes parts of something that is whole and guarded by checksums, as the input says: bytes of
// a part are overwritten, put in or cut out, a part is left out or there twice. Each change is
//   part (2 bytes), kind (1 byte), place in it (3 bytes), number of bytes (1 byte), these bytes
// with numbers little endian, taken modulo what there is; what is missing is 0.
void Edit(std::string_view input, std::vector<std::string>& parts);

// The state with the sections (core/state_sections.h) that are left of it, their checksums right:
// else hardly an input would get past them.
std::string EditedState(std::string_view input, const std::string& state);

}  // namespace mono3d::fuzz
