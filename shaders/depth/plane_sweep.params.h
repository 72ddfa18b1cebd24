// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_PLANE_SWEEP_PARAMS_H
#define MONO3D_DEPTH_PLANE_SWEEP_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(PlaneSweepParams)
uint width_px;
uint height_px;
uint num_planes;
uint padded_planes;        // multiple of 16, at least num_planes
float inverse_depth;       // of plane 0, the farthest, 1/su
float inverse_depth_step;  // 1/su
MONO3D_PARAMS_END

#endif
