// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_SGM_PARAMS_H
#define MONO3D_DEPTH_SGM_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(SgmParams)
uint width_px;
uint height_px;
int step_x;  // direction of the path, -1, 0 or 1 each
int step_y;
uint p1;
uint is_first;  // 1: the sums hold nothing yet
MONO3D_PARAMS_END

#endif
