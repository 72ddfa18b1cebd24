// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>

#include "calibration/camera_parameters.h"

namespace mono3d::calibration {

// The parameters that the images know twice as well as the prior did. Below that an estimate
// follows what the model leaves out (real lenses, rolling shutters).
ParameterFlags DeterminedParameters(const ParameterMatrix& covariance,
                                    const ParameterVector& prior_sigmas);

// How far from the prior, in chi-square, one parameter or a pair may lie to be left there.
using Chi2Limits = std::array<double, 2>;
// By chance at 99 %.
inline constexpr Chi2Limits kChi2At99 = {6.63, 9.21};
// Akaike's criterion: a parameter that gains more predicts better than without it.
inline constexpr Chi2Limits kChi2OfAkaike = {2, 4};

// Backward elimination: which free parameters the images do not tell from the prior's, from which
// they differ by `difference`. Each one that is left free for nothing makes the others less
// certain, and follows what the model leaves out. Higher terms go before lower ones that mean
// something without them.
ParameterFlags ParametersLikePrior(LensModel lens, ParameterVector difference,
                                   ParameterMatrix covariance, const ParameterFlags& is_fixed,
                                   const Chi2Limits& limits);

// The covariance of the parameters of which those that are not determined stay where the prior has
// them: these are not known better for that.
ParameterMatrix WithPriorVariance(ParameterMatrix covariance, const ParameterFlags& is_determined,
                                  const ParameterVector& prior_sigmas);

}  // namespace mono3d::calibration
