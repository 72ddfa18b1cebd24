// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_MEDIAN_PARAMS_H
#define MONO3D_DEPTH_MEDIAN_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(MedianParams)
uint width_px;
uint height_px;
uint min_support;  // of the 25 pixels, how many must lie within `tolerance` of the median
float tolerance;   // 1/su
MONO3D_PARAMS_END

#endif
