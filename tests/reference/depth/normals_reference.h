// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <vector>

#include "depth/normals.params.h"

namespace mono3d::reference {

// Normals towards the camera by a least-squares fit of inverse depth, affine in the pixel, over the
// nine pixels 3 px apart; 0 where there is none.
std::vector<Eigen::Vector3f> Normals(const std::vector<float>& inverse_depth,
                                     const NormalsParams& params);

}  // namespace mono3d::reference
