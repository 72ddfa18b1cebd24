// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>

#include "fusion/register.params.h"
#include "fusion/registration/system.h"
#include "mono3d/fusion/surfel_map.h"
#include "mono3d/geometry/similarity.h"

namespace mono3d {

// Neighbouring pixels match with overlapping census windows of 9x7: so many residuals hold one
// independent measurement.
inline constexpr double kPixelsPerMeasurement = 63;

// Of the estimates of a depth map, about; 0 where it has none.
double MedianDepth(const DepthMap& map);

// One depth map being registered.
struct RegistrationProblem {
  const DepthMap& map;
  const SurfelMapOptions& options;
  Similarity predicted_S_world_kf;
  double median_depth_su;  // in the own unit of its keyframe, as all lengths
  double focal_px;
};

RegistrationProblem MakeProblem(const DepthMap& map, const SurfelMapOptions& options,
                                const Similarity& predicted_S_world_kf);

// Motion of the image, in pixels, of a motion of the camera: rotation and translation together.
double ImageMotion(const RegistrationProblem& problem, const Vector7d& step);

// From the prediction to `S_world_kf`, as the unknowns of one step.
Vector7d Deviation(const RegistrationProblem& problem, const Similarity& S_world_kf);

// By one step.
Similarity Moved(const Similarity& S_world_kf, const Vector7d& step);

RegisterParams MakeRegisterParams(const RegistrationProblem& problem, std::uint32_t num_surfels,
                                  std::uint32_t num_blocks, int level);

// Exposure drifts from map to map: mean and contrast of what both see are made equal.
void SetExposure(RegisterParams& params, const RegistrationSystem& system);

// The step of Gauss and Newton, with the prior.
Vector7d Solve(const RegistrationProblem& problem, const RegistrationSystem& system,
               const Similarity& S_world_kf, std::uint32_t stride);

// One sigma of the pose found, with the prior, as motion in the image.
double Uncertainty_px(const RegistrationProblem& problem, const RegistrationSystem& system,
                      std::uint32_t stride);

// By how much a pose that is `step` away from the best one misses the model: the root of the mean
// increase of the squared residuals, in sigmas. Motions that no residual notices count nothing.
double Misfit(const RegistrationSystem& system, const Vector7d& step);

}  // namespace mono3d
