// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <vector>

#include "evaluation/cloud_surface.h"
#include "mono3d/evaluation/cloud_registration.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/similarity.h"

namespace mono3d {

// The points of the estimate that take part in a registration.
struct IcpPoints {
  std::vector<Eigen::Vector3d> points;
  std::vector<Eigen::Vector3f> normals;  // or empty
};

IcpPoints ChooseIcpPoints(const PointCloud& estimate, int max_points);

// What RegisterCloud does (see there), on prepared clouds.
CloudRegistration RegisterPoints(const IcpPoints& estimate, const CloudSurface& truth,
                                 const Similarity& S_truth_estimate, bool with_scale,
                                 const CloudRegistrationOptions& options);

}  // namespace mono3d
