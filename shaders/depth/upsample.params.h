// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_UPSAMPLE_PARAMS_H
#define MONO3D_DEPTH_UPSAMPLE_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(UpsampleParams)
uint coarse_width_px;
uint coarse_height_px;
uint width_px;
uint height_px;
uint factor;      // 2^level
float tolerance;  // 1/su
MONO3D_PARAMS_END

#endif
