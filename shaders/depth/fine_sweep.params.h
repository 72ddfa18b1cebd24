// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_FINE_SWEEP_PARAMS_H
#define MONO3D_DEPTH_FINE_SWEEP_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(FineSweepParams)
uint width_px;
uint height_px;
float inverse_depth;       // of plane 0, the farthest, 1/su
float inverse_depth_step;  // 1/su
uint quarter_turns;        // of the pictures, census.glsl
MONO3D_PARAMS_END

#endif
