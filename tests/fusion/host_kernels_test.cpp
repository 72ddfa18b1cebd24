// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include "fusion/fusion_scene.h"
#include "fusion/registration_scene.h"
#include "gpu/test_device.h"

namespace mono3d {
namespace {

// Three views of a house, disturbed and with holes, so that surfels are confirmed, seen through,
// hidden and added.
PointCloud ModelOn(const std::shared_ptr<Device>& device) {
  TrackedModel model(CreateSurfelMap(device));
  unsigned seed = 1;
  for (const double angle_deg : {0.0, 6.0, 15.0}) {
    TrackedMap view = HouseView({}, angle_deg);
    Disturb(view, 0.004, 11, seed++);
    EXPECT_EQ(model.Integrate(view).status, FusionStatus::kFused);
  }
  return model.Export(1);
}

// Where the driver runs all kernels, both are of shaders.
TEST(FusionHostKernels, GiveTheBitsOfTheShaders) {
  const PointCloud host = ModelOn(TestDevice());
  const PointCloud shaders = ModelOn(ShaderTestDevice());
  ASSERT_GT(host.size(), 1000U);
  EXPECT_TRUE(host.points == shaders.points);
  EXPECT_TRUE(host.normals == shaders.normals);
  EXPECT_TRUE(host.colours == shaders.colours);
  EXPECT_TRUE(host.radii == shaders.radii);
  EXPECT_TRUE(host.confidences == shaders.confidences);
  EXPECT_TRUE(host.observations == shaders.observations);
}

}  // namespace
}  // namespace mono3d
