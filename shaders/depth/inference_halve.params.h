// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_INFERENCE_HALVE_PARAMS_H
#define MONO3D_DEPTH_INFERENCE_HALVE_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(InferenceHalveParams)
uint fine_width_px;
uint fine_height_px;
MONO3D_PARAMS_END

#endif
