// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_TEXTURE_FILTER_PARAMS_H
#define MONO3D_DEPTH_TEXTURE_FILTER_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(TextureFilterParams)
uint width_px;
uint height_px;
uint min_response_sum;  // over the window, in units of dog.comp
MONO3D_PARAMS_END

#endif
