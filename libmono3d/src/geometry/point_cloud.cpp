// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/point_cloud.h"

#include <algorithm>

#include "mono3d/core/error.h"

namespace mono3d {

void CheckCloud(const PointCloud& cloud, const std::string& name) {
  if (cloud.empty()) throw Error(ErrorParts{"the cloud is empty", name, "points", "none"});
  const auto check_length = [&](std::size_t length, const char* list) {
    if (length == 0 || length == cloud.size()) return;
    throw Error(ErrorParts{std::string("the cloud has ") + list + " for some of its points only",
                           name, std::to_string(cloud.size()), std::to_string(length)});
  };
  check_length(cloud.normals.size(), "normals");
  check_length(cloud.colours.size(), "colours");
  check_length(cloud.radii.size(), "radii");
  check_length(cloud.confidences.size(), "confidences");
  check_length(cloud.observations.size(), "observations");
  const auto check_finite = [&](const std::vector<Eigen::Vector3f>& list, const char* what) {
    const auto bad = std::ranges::find_if(list, [](const auto& v) { return !v.allFinite(); });
    if (bad == list.end()) return;
    throw Error(ErrorParts{std::string("a ") + what + " of the cloud is not finite", name,
                           "finite numbers", what + (" " + std::to_string(bad - list.begin()))});
  };
  check_finite(cloud.points, "point");
  check_finite(cloud.normals, "normal");
}

std::vector<Eigen::Vector3d> CloudPoints(const PointCloud& cloud) {
  std::vector<Eigen::Vector3d> points(cloud.size());
  std::ranges::transform(cloud.points, points.begin(),
                         [](const Eigen::Vector3f& point) { return point.cast<double>(); });
  return points;
}

}  // namespace mono3d
