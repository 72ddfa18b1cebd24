// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_FINE_SGM_PARAMS_H
#define MONO3D_DEPTH_FINE_SGM_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(FineSgmParams)
uint width_px;
uint height_px;
int step_x;  // direction of the path, -1, 0 or 1 each
int step_y;
uint direction;  // its number, 0 to 7
uint p1;
uint first_texel;  // of the direction's volume in the paths
MONO3D_PARAMS_END

#endif
