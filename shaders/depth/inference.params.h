// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_INFERENCE_PARAMS_H
#define MONO3D_DEPTH_INFERENCE_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(InferenceParams)
uint width_px;
uint height_px;
uint winner_width_px;      // of the level that was swept last
uint winner_level;         // its halvings
float inverse_depth_step;  // between its planes, 1/su
float max_difference;      // from the winner, planes
float min_views;           // sources that must see the point
float min_coarse_views;    // the same where it was matched on a coarser level
MONO3D_PARAMS_END

#endif
