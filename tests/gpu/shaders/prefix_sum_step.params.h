// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#ifndef MONO3D_TEST_PREFIX_SUM_STEP_PARAMS_H
#define MONO3D_TEST_PREFIX_SUM_STEP_PARAMS_H

#include "common/params.h"

MONO3D_PARAMS_BEGIN(PrefixSumStepParams)
uint num_values;
uint stride;
MONO3D_PARAMS_END

#endif
