// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_PHOTOMETRIC_PARAMS_H
#define MONO3D_DEPTH_PHOTOMETRIC_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(PhotometricParams)
uint width_px;
uint height_px;
float inverse_depth_step;  // 1/su; 1 px of motion in the farthest matching camera
float noise;               // standard deviation of the grey values of one image
float min_views;           // sources that must see a point
MONO3D_PARAMS_END

#endif
