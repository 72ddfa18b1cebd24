// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Where blocks of surfels are.
#ifndef MONO3D_FUSION_BOUND_BLOCKS_PARAMS_H
#define MONO3D_FUSION_BOUND_BLOCKS_PARAMS_H
#include "common/params.h"

MONO3D_PARAMS_BEGIN(BoundBlocksParams)
uint num_blocks;   // in the list
uint num_surfels;  // in the model
MONO3D_PARAMS_END

#endif
