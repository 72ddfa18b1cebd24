// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_DETAIL_PARAMS_H
#define MONO3D_DEPTH_DETAIL_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(DetailParams)
uint width_px;
uint height_px;
uint first_image;  // of the images, the first whose detail is wanted
MONO3D_PARAMS_END

#endif
