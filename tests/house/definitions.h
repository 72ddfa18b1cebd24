// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <set>
#include <string>
#include <vector>

#include "house/source_files.h"

namespace mono3d::house {

// All three read sources as clang-format leaves them: what stands in a namespace begins in the
// first column.

// The classes whose member functions or static members a source defines, by their own names; those
// of libraries ("Eigen::") are among them, and harmless.
std::set<std::string> ClassesDefinedIn(const SourceFile& source);

// "<class>: <source> <source>" for each class of a module whose member functions are defined in
// more than one of its sources.
std::vector<std::string> FindSplitClasses(const std::vector<SourceFile>& sources);

// The types, functions and variables in the unnamed namespaces of a source.
std::set<std::string> UnnamedNames(const SourceFile& source);

// "<name>: <source> <source>" for each name in the unnamed namespaces of more than one source of
// a target. In a unity build these are one namespace: the names collide or, worse, overload.
// `ToJson`, an overload for each type by design, may be shared.
std::vector<std::string> FindSharedNames(const std::vector<SourceFile>& sources);

}  // namespace mono3d::house
