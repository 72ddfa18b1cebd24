// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "house/source_files.h"

namespace mono3d::house {

// Which modules a module may include, besides itself.
using ModuleTable = std::map<std::string, std::set<std::string>, std::less<>>;

// Includes the public headers of all modules of the library, and is in none.
inline constexpr std::string_view kUmbrellaHeader = "libmono3d/include/mono3d/mono3d.h";

// Reads lines "<module>: <module> <module>".
ModuleTable ParseModuleTable(std::string_view text);

// The module that a file of libmono3d/ or shaders/ lives in; empty when it is in none.
std::string ModuleOf(std::string_view path);

// What is wrong with the includes of one file, as "path:line: why"; empty when all is well.
// - "mono3d/<module>/x.h" and "<module>/x.h" name a module that the file's own module may use.
// - A public header includes no private one.
// - Headers of the library are included in quotes, by their full path.
std::vector<std::string> FindIncludeViolations(const SourceFile& file, const ModuleTable& table);

// Includes, by modules in other libraries than mono3d (`beside`), of private headers of mono3d that
// have a source: a shared library does not export it. As "path: \"header\"".
std::vector<std::string> FindHiddenUses(const std::vector<SourceFile>& files,
                                        const std::set<std::string, std::less<>>& beside);

}  // namespace mono3d::house
