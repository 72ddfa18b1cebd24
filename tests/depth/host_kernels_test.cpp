// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <cstring>
#include <opencv2/core/mat.hpp>
#include <vector>

#include "depth/plane_scene.h"
#include "gpu/device_internals.h"
#include "gpu/test_device.h"
#include "mono3d/depth/depth_estimator.h"

namespace mono3d {
namespace {

::testing::AssertionResult SameBytes(const cv::Mat& a, const cv::Mat& b) {
  if (a.size() != b.size() || a.type() != b.type()) {
    return ::testing::AssertionFailure() << "of other size or type";
  }
  if (std::memcmp(a.data, b.data, a.total() * a.elemSize()) == 0) {
    return ::testing::AssertionSuccess();
  }
  return ::testing::AssertionFailure() << "other bytes";
}

// A size of no whole groups of pixels, a bundle of another size, what is not matched, and pictures
// that are turned.
TEST(DepthHostKernels, GiveTheBitsOfTheShaders) {
  if (TestDevice()->host_threads() == nullptr) GTEST_SKIP() << "the driver runs all kernels";
  struct Case {
    PlaneScene scene;
    int level;
    unsigned quarter_turns = 0;  // of the first image
  };
  std::vector<Case> cases = {{PlaneScene(), 1},
                             {PlaneScene(), 0},
                             {PlaneScene(), 0},
                             {PlaneScene(), 0, 1},
                             {PlaneScene(), 0, 2}};
  cases[1].scene.camera = cases[1].scene.camera.Resized(67, 141);
  cases[2].scene.num_images = 3;
  cases[2].scene.blank_px = 30;
  cases[3].scene.camera = cases[3].scene.camera.Resized(101, 101);
  for (const auto& [scene, level, quarter_turns] : cases) {
    DepthEstimatorOptions options;
    options.pyramid.level = level;
    ImageBundle bundle = scene.Bundle();
    TurnImage(0, quarter_turns, bundle);
    const DepthResult host = CreateDepthEstimator(TestDevice(), options)->Estimate(bundle);
    const DepthResult shaders = CreateDepthEstimator(ShaderTestDevice(), options)->Estimate(bundle);
    ASSERT_EQ(host.status, shaders.status) << host.reason << shaders.reason;
    EXPECT_TRUE(SameBytes(host.map.depth, shaders.map.depth));
    EXPECT_TRUE(SameBytes(host.map.confidence, shaders.map.confidence));
    EXPECT_TRUE(SameBytes(host.map.normal, shaders.map.normal));
  }
}

}  // namespace
}  // namespace mono3d
