// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/test_scenes.h"

#include <Eigen/Geometry>

namespace mono3d::synthetic {
namespace {

constexpr float kAlbedo = 0.25F;  // bright noise is not clipped, dark noise is not lost

void AddPlane(Mesh& mesh, const PlaneOptions& options) {
  const Eigen::Vector3f normal = options.normal.normalized().cast<float>();
  const auto side_m = static_cast<float>(2 * options.half_extent_m);
  const Eigen::Vector3f a = side_m * normal.unitOrthogonal();
  const Eigen::Vector3f b = normal.cross(a);
  const Finish finish{Material::kTestPattern, Eigen::Vector3f::Constant(kAlbedo), options.seed};
  AddParallelogram(mesh, {options.point.cast<float>() - (a + b) / 2, a, b}, finish);
}

}  // namespace

Scene BuildPlane(const PlaneOptions& options) {
  Mesh mesh;
  AddPlane(mesh, options);
  return Scene(std::move(mesh));
}

Scene BuildPlaneAndBox(const PlaneAndBoxOptions& options) {
  Mesh mesh;
  AddPlane(mesh, options.plane);
  const Eigen::Vector3f size = options.box_size_m.cast<float>();
  const Eigen::Vector3f middle =
      options.plane.point.cast<float>() + size.z() / 2 * Eigen::Vector3f::UnitZ();
  const Finish finish{Material::kTestPattern, Eigen::Vector3f::Constant(kAlbedo),
                      options.plane.seed + 1};
  AddBlock(mesh,
           CentredBlock(middle, size.x() * Eigen::Vector3f::UnitX(),
                        size.y() * Eigen::Vector3f::UnitY(), size.z() * Eigen::Vector3f::UnitZ()),
           finish);
  return Scene(std::move(mesh));
}

}  // namespace mono3d::synthetic
