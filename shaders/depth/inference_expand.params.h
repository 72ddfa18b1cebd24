// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_INFERENCE_EXPAND_PARAMS_H
#define MONO3D_DEPTH_INFERENCE_EXPAND_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(InferenceExpandParams)
uint coarse_width_px;
uint coarse_height_px;
uint width_px;
uint height_px;
MONO3D_PARAMS_END

#endif
