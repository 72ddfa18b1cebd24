// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Measures with the installed component `evaluation`: three points, one of them 0.3 m off.

#include <mono3d/core/version.h>
#include <mono3d/evaluation/cloud_error.h>
#include <mono3d/evaluation/error_statistics.h>

#include <array>
#include <cmath>
#include <exception>
#include <iostream>

int main() {
  try {
    mono3d::PointCloud truth;
    truth.points = {{0, 0, 0}, {5, 0, 0}, {0, 5, 0}};
    truth.normals.assign(3, {0, 0, 1});
    mono3d::PointCloud estimate = truth;
    estimate.points[1].z() = 0.3F;
    const std::array<double, 1> thresholds_m = {0.1};
    const mono3d::CloudError error =
        mono3d::ComputeCloudError(estimate, truth, thresholds_m);  // searches the nearest points
    if (std::abs(error.estimate_to_truth.max - 0.3) > 1e-6) {
      std::cerr << "expected 0.3 m, found " << error.estimate_to_truth.max << " m\n";
      return 1;
    }
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  std::cout << "mono3d " << mono3d::Version() << '\n';
  return 0;
}
