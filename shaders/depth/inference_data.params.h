// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_INFERENCE_DATA_PARAMS_H
#define MONO3D_DEPTH_INFERENCE_DATA_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(InferenceDataParams)
uint width_px;  // full resolution
uint height_px;
MONO3D_PARAMS_END

#endif
