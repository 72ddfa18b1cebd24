// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_NORMALS_PARAMS_H
#define MONO3D_DEPTH_NORMALS_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(NormalsParams)
uint width_px;
uint height_px;
float fx;  // px
float fy;
float cx;
float cy;
float tolerance;  // largest change of inverse depth from pixel to pixel on one surface, 1/su
MONO3D_PARAMS_END

#endif
