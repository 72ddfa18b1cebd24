// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "calibration/camera_adjustment.h"

namespace mono3d::calibration {

// The parameters that the images know twice as well as the prior did. Below that an estimate
// follows what the model leaves out (real lenses, rolling shutters).
ParameterFlags DeterminedParameters(const ParameterMatrix& covariance,
                                    const ParameterVector& prior_sigmas);

// Backward elimination: which free parameters the images do not tell from the prior's, from which
// they differ by `difference`. Each one that is left free for nothing makes the others less
// certain, and follows what the model leaves out. Higher terms go before lower ones that mean
// something without them.
ParameterFlags ParametersLikePrior(ParameterVector difference, ParameterMatrix covariance,
                                   const ParameterFlags& is_fixed);

// The covariance of the parameters of which those that are not determined stay where the prior has
// them: these are not known better for that.
ParameterMatrix WithPriorVariance(ParameterMatrix covariance, const ParameterFlags& is_determined,
                                  const ParameterVector& prior_sigmas);

}  // namespace mono3d::calibration
