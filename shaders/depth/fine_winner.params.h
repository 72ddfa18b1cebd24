// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_FINE_WINNER_PARAMS_H
#define MONO3D_DEPTH_FINE_WINNER_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(FineWinnerParams)
uint width_px;
uint height_px;
uint max_cost;             // of the winning plane, in units of plane_cost.glsl
float min_uniqueness;      // share by which the runner-up must be worse
float inverse_depth;       // of plane 0, 1/su
float inverse_depth_step;  // 1/su
MONO3D_PARAMS_END

#endif
