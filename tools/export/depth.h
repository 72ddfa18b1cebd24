// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "export/product.h"

namespace mono3d::tools {

Product DepthProduct();

}  // namespace mono3d::tools
