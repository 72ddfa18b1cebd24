// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "export/product.h"

namespace mono3d::tools {

// dsm.tif; contours.gpkg, where --contours asks for it.
Product SurfaceModelProduct();
// orthophoto.tif.
Product OrthophotoProduct();

}  // namespace mono3d::tools
