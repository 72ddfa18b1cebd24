// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"

namespace MONO3D_EXPORT mono3d {

enum class HealthState { kGood, kDegraded, kBroken };

const char* ToString(HealthState state);

// How the model fares, by its latest registrations.
struct ModelHealth {
  HealthState state = HealthState::kGood;
  std::string reason;         // when it is not good
  int num_registrations = 0;  // the latest ones, on which the rest rests
  double accepted_share = 1;  // of them
  double moved_share = 0;     // of the accepted ones: the model contradicted the tracker
  double depth_residual = 0;  // of the accepted ones, root mean square from the model, in sigmas
  double scale_drift = 0;     // latest logarithm of the scale over the tracker's
  double deviation_px = 0;    // of the latest accepted one: from the tracker's pose, in the image
  int num_submaps = 1;        // parts that hang together by the tracker's poses alone
};

// When a model is no longer good. Broken is one that refuses rather more than it takes, or one
// whose depth maps contradict the tracker (max_moved_share) and, at the poses that fit best, the
// model as well (max_depth_residual).
struct HealthOptions {
  int num_registrations = 8;  // that are looked back upon
  int min_registrations = 4;  // fewer say nothing
  double min_accepted_share = 0.5;
  double good_accepted_share = 0.75;
  double max_moved_share = 0.5;
  double max_depth_residual = 1;  // sigmas: what is expected of depth maps that are not correlated
  double max_scale_drift = 0.05;

  void Visit(OptionVisitor& visit);
};

}  // namespace mono3d
