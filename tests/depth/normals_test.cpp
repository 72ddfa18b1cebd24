// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <cmath>

#include "depth/stage_testing.h"
#include "reference/depth/normals_reference.h"

namespace mono3d {
namespace {

constexpr LevelSize kNormalsSize{41, 33};
constexpr NormalsParams kNormalsParams{.width_px = kNormalsSize.width_px,
                                       .height_px = kNormalsSize.height_px,
                                       .fx = 40,
                                       .fy = 42,
                                       .cx = 20,
                                       .cy = 16,
                                       .tolerance = 0.01f};

std::vector<Eigen::Vector3f> NormalsOnDevice(const std::vector<float>& inverse_depth,
                                             const NormalsParams& params) {
  const Buffer normals = MakeBuffer<float>(3 * inverse_depth.size());
  Recorder recorder(TestDevice());
  TestKernels().Normals(recorder, params, ToBuffer(inverse_depth), normals);
  recorder.Submit();
  const auto numbers = FirstOf<float>(normals, 3 * inverse_depth.size());
  std::vector<Eigen::Vector3f> result;
  for (std::size_t i = 0; i < numbers.size(); i += 3) {
    result.emplace_back(numbers[i], numbers[i + 1], numbers[i + 2]);
  }
  return result;
}

// Inverse depth of the plane n . X = -1, n towards the camera.
float PlaneAt(const Eigen::Vector3f& n, std::size_t pixel) {
  const auto x = static_cast<float>(pixel % kNormalsSize.width_px);
  const auto y = static_cast<float>(pixel / kNormalsSize.width_px);
  return -n.dot(Eigen::Vector3f((x - kNormalsParams.cx) / kNormalsParams.fx,
                                (y - kNormalsParams.cy) / kNormalsParams.fy, 1));
}

TEST(Normals, OfAPlaneAreThePlanes) {
  const Eigen::Vector3f n(0.1f, -0.2f, -0.8f);
  std::vector<float> inverse_depth;
  for (std::size_t i = 0; i < kNormalsSize.num_pixels(); ++i)
    inverse_depth.push_back(PlaneAt(n, i));
  for (const Eigen::Vector3f& normal : NormalsOnDevice(inverse_depth, kNormalsParams)) {
    EXPECT_LT((normal - n.normalized()).norm(), 1e-4f);  // float, differences of values near 1
  }
}

TEST(Normals, DoNotCrossAnEdge) {
  // Two planes side by side, the right one much nearer: each keeps its normal up to the edge.
  const Eigen::Vector3f left(0.1f, -0.2f, -0.8f);
  const Eigen::Vector3f right(-0.2f, 0.1f, -1.6f);
  std::vector<float> inverse_depth;
  for (std::size_t i = 0; i < kNormalsSize.num_pixels(); ++i) {
    inverse_depth.push_back(PlaneAt(i % kNormalsSize.width_px < 20 ? left : right, i));
  }
  const auto normals = NormalsOnDevice(inverse_depth, kNormalsParams);
  for (std::size_t i = 0; i < normals.size(); ++i) {
    const Eigen::Vector3f& n = i % kNormalsSize.width_px < 20 ? left : right;
    EXPECT_LT((normals[i] - n.normalized()).norm(), 1e-4f) << i;
  }
}

TEST(Normals, EqualReference) {
  std::mt19937 random = SeededByTestName();
  for (const double share_missing : {0.0, 0.3}) {
    // Noise below the tolerance, so that most of each window counts.
    const auto depth = RandomValues(kNormalsSize.num_pixels(), 0.5f, 0.504f, share_missing, random);
    const auto expected = reference::Normals(depth, kNormalsParams);
    const auto found = NormalsOnDevice(depth, kNormalsParams);
    for (std::size_t i = 0; i < found.size(); ++i) {
      // The fit of a window with a few pixels in the corner is worse conditioned than float likes.
      ASSERT_LT((found[i] - expected[i]).norm(), 2e-3f) << i;
    }
  }
}

TEST(Normals, AreNoneWithoutDepth) {
  const auto normals =
      NormalsOnDevice(std::vector<float>(kNormalsSize.num_pixels(), 0.f), kNormalsParams);
  for (const Eigen::Vector3f& normal : normals) EXPECT_EQ(normal, Eigen::Vector3f::Zero());
}

}  // namespace
}  // namespace mono3d
