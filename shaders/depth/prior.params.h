// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_PRIOR_PARAMS_H
#define MONO3D_DEPTH_PRIOR_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(PriorParams)
uint coarse_width_px;
uint coarse_height_px;
uint width_px;  // of the level that is to be swept
uint height_px;
uint num_planes;  // of the level, on its grid of planes
float fx;         // of the coarse level
float fy;
float cx;
float cy;
float inverse_depth;       // of plane 0, 1/su
float inverse_depth_step;  // of the level that is to be swept, 1/su
uint follow_normals;       // 1: SGM^sn, 0: SGM
MONO3D_PARAMS_END

#endif
