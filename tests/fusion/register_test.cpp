// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <opencv2/imgproc.hpp>

#include "fusion/fusion_scene.h"
#include "fusion/registration/registrar.h"
#include "fusion/registration_scene.h"
#include "gpu/test_device.h"

namespace mono3d {
namespace {

RegisterParams ParamsFor(const ViewParams& view, unsigned level) {
  RegisterParams params{};
  static_assert(offsetof(ViewParams, inverse_depth_sigma) ==
                offsetof(RegisterParams, inverse_depth_sigma));
  std::memcpy(&params, &view, offsetof(ViewParams, association_sigmas));
  params.association_sigmas = view.association_sigmas;
  params.min_normal_cosine = view.min_normal_cosine;
  params.num_surfels = view.num_surfels;
  params.stride = 1;
  params.grey_level = level;
  params.grey_gain = 0.9F;
  params.grey_bias = 12;
  params.grey_noise = 4;
  params.grey_shift_px = 0.3F;
  return params;
}

std::vector<float> GreyLevel(const cv::Mat& bgr, int level) {
  cv::Mat grey;
  cv::cvtColor(bgr, grey, cv::COLOR_BGR2GRAY);
  grey.convertTo(grey, CV_32F);
  for (int i = 0; i < level; ++i) cv::resize(grey, grey, grey.size() / 2, 0, 0, cv::INTER_AREA);
  return {grey.ptr<float>(), grey.ptr<float>() + grey.total()};
}

// The house seen from 4 degrees aside, at a slightly wrong pose, against a model of the first view.
struct Case {
  explicit Case(unsigned level, unsigned stride)
      : map(Misplaced(HouseView({}, 4), {0.002, -0.003, 0.001}, {0.02, 0.01, -0.03}, 1)),
        scene(map, Model(), {}, {S_world_anchor()}),
        params(ParamsFor(scene.view, level)) {
    params.stride = stride;
    params.num_blocks = scene.all_blocks.size();
    scene.RunPrepare();
    Registrar registrar(TestDevice());
    registrar.UploadGrey(map);
    found = registrar.Evaluate(scene.recorder, params, scene.anchor_table, scene.buffers,
                               scene.storage, scene.all_blocks, nullptr);
    expected = reference::Register(params, scene.anchors, scene.packed, scene.DeviceCandidates(),
                                   scene.surfels, GreyLevel(map.bgr, static_cast<int>(level)));
  }

  static Surfels Model() {
    const TrackedMap first = HouseView({}, 0);
    Surfels model;
    reference::Integrate(MakeViewParams(first, {}, 0, 0), {}, Pack(first), model);
    return InUnit(model, kAnchorUnitsPerSu);
  }
  // A percent off: the scale has something to tell.
  static Similarity S_world_anchor() {
    return {0.99 / kAnchorUnitsPerSu, HouseView({}, 0).T_world_cam};
  }
  static constexpr double kAnchorUnitsPerSu = 1.7;

  TrackedMap map;
  StageScene scene;
  RegisterParams params;
  RegistrationSystem found;
  RegistrationSystem expected;
};

// Point-to-plane and photometric terms against differences of the plain reference.
TEST(Register, EqualsReferenceWithNumericalDerivatives) {
  // Sums of some 10 000 products of single precision against double; a few surfels in a thousand
  // may fall on the other side of a border.
  constexpr double kTolerance = 0.004;
  for (const auto& [level, stride] : {std::pair{0U, 1U}, {0U, 5U}, {1U, 2U}, {2U, 1U}}) {
    const Case c(level, stride);
    ASSERT_GT(c.expected.num_agree, 1000);
    ASSERT_GT(c.expected.num_before + c.expected.num_behind, 10);
    ASSERT_GT(c.expected.num_grey, 1000);
    const auto expect_near = [](double found, double expected) {
      EXPECT_NEAR(found, expected, kTolerance * std::max(1.0, std::abs(expected)));
    };
    expect_near(static_cast<double>(c.found.num_agree), static_cast<double>(c.expected.num_agree));
    expect_near(static_cast<double>(c.found.num_grey), static_cast<double>(c.expected.num_grey));
    EXPECT_NEAR(static_cast<double>(c.found.num_before), static_cast<double>(c.expected.num_before),
                3);
    EXPECT_NEAR(static_cast<double>(c.found.num_behind), static_cast<double>(c.expected.num_behind),
                3);
    expect_near(c.found.depth_cost, c.expected.depth_cost);
    expect_near(c.found.grey_cost, c.expected.grey_cost);
    expect_near(c.found.image_grey_mean, c.expected.image_grey_mean);
    expect_near(c.found.image_grey_sigma, c.expected.image_grey_sigma);
    expect_near(c.found.surfel_grey_mean, c.expected.surfel_grey_mean);
    expect_near(c.found.surfel_grey_sigma, c.expected.surfel_grey_sigma);
    expect_near(c.found.grey_covariance, c.expected.grey_covariance);
    // Each entry relative to what its two unknowns could give at most (Cauchy and Schwarz).
    const Vector7d size = c.expected.information.diagonal().cwiseSqrt();
    const double residual = std::sqrt(c.expected.depth_cost + c.expected.grey_cost);
    for (int row = 0; row < 7; ++row) {
      EXPECT_NEAR(c.found.gradient(row), c.expected.gradient(row),
                  kTolerance * size(row) * residual);
      for (int col = 0; col < 7; ++col) {
        EXPECT_NEAR(c.found.information(row, col), c.expected.information(row, col),
                    kTolerance * size(row) * size(col));
      }
    }
  }
}

TEST(Register, LeavesGreyValuesOutWithoutGain) {
  Case c(0, 1);
  c.params.grey_gain = 0;
  Registrar registrar(TestDevice());
  registrar.UploadGrey(c.map);
  const auto found =
      registrar.Evaluate(c.scene.recorder, c.params, c.scene.anchor_table, c.scene.buffers,
                         c.scene.storage, c.scene.all_blocks, nullptr);
  EXPECT_EQ(found.grey_cost, 0);
  EXPECT_EQ(found.num_grey, c.found.num_grey);  // counted all the same, for the exposure
  EXPECT_LT(found.information(0, 0), c.found.information(0, 0));
}

TEST(Register, AddsUpToNothingWithoutSurfels) {
  const RegistrationSystem system = SumRegistrationRows({});
  EXPECT_EQ(system.num_agree, 0);
  EXPECT_TRUE(system.information.isZero());
}

}  // namespace
}  // namespace mono3d
