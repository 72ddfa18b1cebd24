// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"

namespace MONO3D_EXPORT mono3d {

// How a depth map is registered with the model before it is fused (paper, section 3.3): its pose,
// and the scale of its depths, such that its surface and its grey values meet those of the model.
struct RegistrationOptions {
  // Off: depth maps are fused at the tracker's poses whatever the model says.
  bool enabled = true;
  // Off: depth maps are judged at the tracker's poses, but not moved, for poses that were all
  // adjusted together before the first depth map came, as those of photographs. Depth maps moved
  // one after the other drift.
  bool moves = true;
  bool with_scale = true;  // seven unknowns, Sim(3); else six, SE(3)
  bool with_grey = true;   // surface and grey values; else the surface alone
  // Up to here the tracker's pose stands: the mean by which it misses the best one, in sigmas. A
  // quarter of a sigma may well be common to all pixels of a depth map; of noisy images
  // DepthMap::patch_noise times that, but one sigma at most.
  double max_misfit = 0.25;
  // What the tracker knows, as a further term of the normal equations: one sigma of a tracker that
  // is wrong, as motion in the image, of rotation and translation each, and of the logarithm of its
  // scale. It holds the depth map where the scene does not: along flat ground that is all grey.
  double prior_px = 10;
  double prior_scale = 0.02;
  double grey_noise = 4;       // sigma of the difference of two views of one place, grey values
  double grey_shift_px = 0.3;  // a surfel has the colour of a pixel up to half a pixel away

  void Visit(OptionVisitor& visit);
};

// When a registered depth map is not to be trusted, and not fused. One whose pose is not the
// tracker's needs twice the evidence: it may have half of what is allowed against it.
struct RegistrationGateOptions {
  double min_overlap = 0.05;         // below it there is nothing to register with: a submap starts
  double min_agreement = 0.5;        // rather more than less
  double max_contradiction = 0.2;    // outlines and moving things
  double max_residual = 2;           // in sigmas; 1 is expected
  double max_grey_residual = 4;      // the same of grey values, which change with the view as well
  double max_noise = 6;              // times the sigma that the depth map claims
  double max_deviation_px = 40;      // from the tracker's pose, as motion in the image
  double max_scale_deviation = 0.1;  // from the tracker's, of its logarithm
  // One sigma of a pose by which a whole submap of the model is moved to another: it must be known
  // far better than the prior knows it.
  double max_join_uncertainty_px = 1;

  void Visit(OptionVisitor& visit);
};

// What a registration rests on.
struct RegistrationEvidence {
  bool registered = false;  // false: nothing to register with, or not asked for
  bool moved = false;       // the model contradicted the tracker's pose; else that stands
  int num_iterations = 0;
  double tracker_misfit = 0;    // mean by which the tracker's pose misses the best one, in sigmas
  double overlap = 0;           // surfels in view per pixel of the depth map, 1 at most
  double noise = 1;             // errors of the depth map over those that it claims
  double agreement = 0;         // share of them that lie on the depth map's surface
  double contradiction = 0;     // share of them that the depth map sees through
  double depth_residual = 0;    // root mean square, in sigmas
  double grey_residual = 0;     // root mean square, in sigmas
  double grey_correlation = 0;  // of the image with the colours of the model; 0 where both are flat
  double deviation_px = 0;      // from the tracker's pose, as motion in the image
  double scale_deviation = 0;   // logarithm of the scale over the tracker's
  double uncertainty_px = 0;    // one sigma of the pose, prior included, as motion in the image
};

}  // namespace mono3d
