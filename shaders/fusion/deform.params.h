// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The model follows the views from which it was made.
#ifndef MONO3D_FUSION_DEFORM_PARAMS_H
#define MONO3D_FUSION_DEFORM_PARAMS_H
#include "common/params.h"

MONO3D_PARAMS_BEGIN(DeformParams)
uint num_surfels;
uint num_nodes;  // one per depth map of the model
uint window;     // a surfel follows the nodes so many before and after its anchor
MONO3D_PARAMS_END

#endif
