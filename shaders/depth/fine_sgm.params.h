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
uint min_p2;              // the jump penalty P2 is the larger of this and of
float p2_times_gradient;  // this / (gradient + difference of the grey values), rounded down
float gradient;
uint first_texel;  // of the direction's volume in the paths
// Of the last direction, as in fine_winner.params.h.
uint max_cost;
float min_uniqueness;
float inverse_depth;
float inverse_depth_step;
MONO3D_PARAMS_END

#endif
