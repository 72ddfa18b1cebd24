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

constexpr double kAnchorUnitsPerSu = 1.7;

// Of the first view.
Surfels Model() {
  const TrackedMap first = HouseView({}, 0);
  Surfels model;
  reference::Integrate(MakeViewParams(first, {}, 0, 0), {}, Pack(first), model);
  return InUnit(model, kAnchorUnitsPerSu);
}
// The same, and what a scene of many surfaces has behind them.
Surfels ModelWithSurfacesBehind() {
  Surfels model = Model();
  const Surfels front = model;
  for (const double farther : {1.4, 1.8, 2.5}) Append(model, InUnit(front, farther));
  return model;
}

// The house seen from 4 degrees aside, at a slightly wrong pose, against such a model.
struct Case {
  Case(unsigned level, unsigned stride, const Surfels& model = Model(),
       bool leaves_out_hidden = false)
      : map(Misplaced(HouseView({}, 4), {0.002, -0.003, 0.001}, {0.02, 0.01, -0.03}, 1)),
        scene(map, model, {}, {S_world_anchor()}),
        params(ParamsFor(scene.view, level)) {
    params.stride = stride;
    params.leaves_out_hidden = leaves_out_hidden ? 1 : 0;
    params.num_blocks = scene.all_blocks.size();
    scene.RunPrepare();
    Registrar registrar(TestDevice());
    registrar.UploadGrey(map);
    found = registrar.Evaluate(scene.recorder, params, scene.anchor_table, scene.buffers,
                               scene.storage, scene.all_blocks, nullptr);
    expected = reference::Register(params, scene.anchors, scene.packed, scene.DeviceCandidates(),
                                   scene.surfels, GreyLevel(map.bgr, static_cast<int>(level)));
  }

  // A percent off: the scale has something to tell.
  static Similarity S_world_anchor() {
    return {0.99 / kAnchorUnitsPerSu, HouseView({}, 0).T_world_cam};
  }

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

// Only of surfels behind the depth map is it asked what hides them: all else stays as it is.
TEST(Register, LeavesOutWhatTheModelHides) {
  const Surfels model = ModelWithSurfacesBehind();
  for (const auto& [level, stride] : {std::pair{0U, 1U}, {0U, 5U}, {2U, 1U}}) {
    const Case with(level, stride, model, false);
    const Case without(level, stride, model, true);
    EXPECT_NEAR(static_cast<double>(without.found.num_behind),
                static_cast<double>(without.expected.num_behind), 3);
    EXPECT_GT(with.found.num_behind, with.found.num_agree);
    EXPECT_LT(without.found.num_behind, with.found.num_behind / 20);
    EXPECT_EQ(without.found.num_agree, with.found.num_agree);
    EXPECT_EQ(without.found.num_before, with.found.num_before);
    EXPECT_EQ(without.found.information, with.found.information);
  }
}

// A map of one surface hides nothing, however it runs away from the camera.
TEST(Register, LeavesOutNothingOfOneSurfaceBehind) {
  const CameraModel camera = HouseCamera();
  Plane ground;
  ground.normal = Eigen::Vector3d(0, -1, -0.2).normalized();
  ground.offset_su = -2;
  const TrackedMap seen = PlaneMap(camera, Pose(), ground);
  Surfels model;
  reference::Integrate(MakeViewParams(seen, {}, 0, 0), {}, Pack(seen), model);
  Plane nearer = ground;
  nearer.offset_su = -1.5;
  const TrackedMap map = PlaneMap(camera, Pose(), nearer);
  const auto num_behind = [&](std::uint32_t leaves_out_hidden) {
    StageScene scene(map, model);
    RegisterParams params = ParamsFor(scene.view, 0);
    params.num_blocks = scene.all_blocks.size();
    params.leaves_out_hidden = leaves_out_hidden;
    scene.RunPrepare();
    Registrar registrar(TestDevice());
    registrar.UploadGrey(map);
    return registrar
        .Evaluate(scene.recorder, params, scene.anchor_table, scene.buffers, scene.storage,
                  scene.all_blocks, nullptr)
        .num_behind;
  };
  EXPECT_GT(num_behind(0), 1000);
  EXPECT_EQ(num_behind(1), num_behind(0));
}

// Whether a depth map `factor` times as far away as it is fits the model with surfaces behind it.
std::string RejectionAt(double factor) {
  TrackedMap map = HouseView({}, 4);
  map.depth *= factor;
  SurfelMapOptions options;
  StageScene scene(map, ModelWithSurfacesBehind(), options, {Case::S_world_anchor()});
  scene.RunPrepare();
  Registrar registrar(TestDevice());
  const std::vector<Similarity> anchors = {Case::S_world_anchor()};
  const Registration registration =
      registrar.Register(scene.recorder, map, scene.buffers, scene.storage, scene.all_blocks,
                         anchors, {Similarity(1, map.T_world_cam)}, options, nullptr);
  return registration.evidence.registered ? registration.rejection : "not registered";
}

// Nor is one believed that stands before all that the model shows.
TEST(Registrar, IsNotContradictedByWhatTheModelHides) {
  EXPECT_EQ(RejectionAt(1), "");
  EXPECT_NE(RejectionAt(0.7), "");
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
