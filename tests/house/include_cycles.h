// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <vector>

#include "house/source_files.h"

namespace mono3d::house {

// The cycles in the includes of libmono3d/ and tools/: each as the units that include each other,
// directly or through others, in the order of their names: "depth/a, depth/b". A unit is a private
// header with the source of the same stem. A public header is a unit of its own, apart from the
// source that implements it: it is the contract that both sides of an interface include.
std::vector<std::string> FindIncludeCycles(const std::vector<SourceFile>& files);

}  // namespace mono3d::house
