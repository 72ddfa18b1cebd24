// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_DEPTH_FINE_CENSUS_PARAMS_H
#define MONO3D_DEPTH_FINE_CENSUS_PARAMS_H

#include "common/params.h"
MONO3D_PARAMS_BEGIN(FineCensusParams)
uint width_px;
uint height_px;
uint quarter_turns;  // of the pictures, census.glsl
MONO3D_PARAMS_END

#endif
