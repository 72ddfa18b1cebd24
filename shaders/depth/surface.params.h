// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_SURFACE_PARAMS_H
#define MONO3D_DEPTH_SURFACE_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(SurfaceParams)
uint width_px;
uint height_px;
float inverse_depth_step;  // 1/su; 1 px of motion in the farthest matching camera
MONO3D_PARAMS_END

#endif
