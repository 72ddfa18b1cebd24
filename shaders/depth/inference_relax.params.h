// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_INFERENCE_RELAX_PARAMS_H
#define MONO3D_DEPTH_INFERENCE_RELAX_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(InferenceRelaxParams)
uint width_px;
uint height_px;
float leak;  // what confidence loses on its way, a conductance
MONO3D_PARAMS_END

#endif
