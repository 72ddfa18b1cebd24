// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_TEST_AFFINE_PARAMS_H
#define MONO3D_TEST_AFFINE_PARAMS_H

#include "common/params.h"

MONO3D_PARAMS_BEGIN(AffineParams)
uint num_values;
uint factors[2];
int offset;
MONO3D_PARAMS_END

#endif
