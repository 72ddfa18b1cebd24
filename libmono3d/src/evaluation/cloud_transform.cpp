// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/evaluation/cloud_transform.h"

namespace mono3d {

PointCloud TransformCloud(const Similarity& S_a_b, const PointCloud& cloud_b) {
  PointCloud cloud_a = cloud_b;
  for (Eigen::Vector3f& point : cloud_a.points) {
    point = (S_a_b * point.cast<double>().eval()).cast<float>();
  }
  const Eigen::Matrix3f R_a_b = S_a_b.pose().rotation().toRotationMatrix().cast<float>();
  for (Eigen::Vector3f& normal : cloud_a.normals) normal = R_a_b * normal;
  for (float& radius : cloud_a.radii) radius *= static_cast<float>(S_a_b.scale());
  return cloud_a;
}

}  // namespace mono3d
