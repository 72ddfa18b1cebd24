// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>

#include "fusion/register.params.h"
#include "fusion/registration_system.h"
#include "mono3d/fusion/surfel_map.h"

namespace mono3d {

// Where a depth map belongs in the model.
struct RegisteredView {
  Pose T_world_cam;
  double depth_scale = 1;  // its depths are to be multiplied by this
};

// Neighbouring pixels match with overlapping census windows of 9x7: so many residuals hold one
// independent measurement.
inline constexpr double kPixelsPerMeasurement = 63;

// Of the estimates of a depth map, about; 0 where it has none.
double MedianDepth(const DepthMap& map);

// One depth map being registered.
struct RegistrationProblem {
  const DepthMap& map;
  const SurfelMapOptions& options;
  RegisteredView predicted;
  double median_depth_su;  // as the map has it
  double focal_px;
};

RegistrationProblem MakeProblem(const DepthMap& map, const SurfelMapOptions& options,
                                const RegisteredView& predicted);

// The depth map where it belongs in the model.
DepthMap Placed(const DepthMap& map, const RegisteredView& view);

// Motion of the image, in pixels, of a motion of the camera: rotation and translation together.
double ImageMotion(const RegistrationProblem& problem, const Vector7d& step);

// From the prediction to `view`, as the unknowns of one step.
Vector7d Deviation(const RegistrationProblem& problem, const RegisteredView& view);

void Move(RegisteredView& view, const Vector7d& step);

RegisterParams MakeRegisterParams(const RegistrationProblem& problem, const RegisteredView& view,
                                  std::uint32_t num_surfels, std::uint32_t num_blocks, int level);

// Exposure drifts from map to map: mean and contrast of what both see are made equal.
void SetExposure(RegisterParams& params, const RegistrationSystem& system);

// The step of Gauss and Newton, with the prior.
Vector7d Solve(const RegistrationProblem& problem, const RegistrationSystem& system,
               const RegisteredView& view, std::uint32_t stride);

// One sigma of the pose found, with the prior, as motion in the image.
double Uncertainty_px(const RegistrationProblem& problem, const RegistrationSystem& system,
                      std::uint32_t stride);

// By how much a pose that is `step` away from the best one misses the model: the root of the mean
// increase of the squared residuals, in sigmas. Motions that no residual notices count nothing.
double Misfit(const RegistrationSystem& system, const Vector7d& step);

}  // namespace mono3d
