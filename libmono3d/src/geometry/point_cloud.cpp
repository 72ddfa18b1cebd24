// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geometry/point_cloud.h"

#include <algorithm>

#include "mono3d/core/error.h"

namespace mono3d {
namespace {

PointCloud PointsThatAre(const PointCloud& cloud, bool is_inferred) {
  PointCloud kept;
  const auto keep = [&](const auto& from, auto& to) {
    if (from.empty()) return;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      if (IsInferred(cloud, i) == is_inferred) to.push_back(from[i]);
    }
  };
  keep(cloud.points, kept.points);
  keep(cloud.normals, kept.normals);
  keep(cloud.colours, kept.colours);
  keep(cloud.radii, kept.radii);
  keep(cloud.confidences, kept.confidences);
  keep(cloud.observations, kept.observations);
  keep(cloud.first_frames, kept.first_frames);
  if (is_inferred) keep(cloud.inferred, kept.inferred);
  return kept;
}

}  // namespace

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
  check_length(cloud.inferred.size(), "inferred");
  check_length(cloud.first_frames.size(), "first frames");
  const auto check_finite = [&](const std::vector<Eigen::Vector3f>& list, const char* what) {
    const auto bad = std::ranges::find_if(list, [](const auto& v) { return !v.allFinite(); });
    if (bad == list.end()) return;
    throw Error(ErrorParts{std::string("a ") + what + " of the cloud is not finite", name,
                           "finite numbers", what + (" " + std::to_string(bad - list.begin()))});
  };
  check_finite(cloud.points, "point");
  check_finite(cloud.normals, "normal");
}

bool IsInferred(const PointCloud& cloud, std::size_t i) {
  return !cloud.inferred.empty() && cloud.inferred[i] != 0;
}

PointCloud InferredPoints(const PointCloud& cloud) { return PointsThatAre(cloud, true); }

PointCloud MatchedPoints(const PointCloud& cloud) { return PointsThatAre(cloud, false); }

std::vector<Eigen::Vector3d> CloudPoints(const PointCloud& cloud) {
  std::vector<Eigen::Vector3d> points(cloud.size());
  std::ranges::transform(cloud.points, points.begin(),
                         [](const Eigen::Vector3f& point) { return point.cast<double>(); });
  return points;
}

}  // namespace mono3d
