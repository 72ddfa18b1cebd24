// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/sparse_model.h"

#include <gmock/gmock.h>

#include <limits>

#include "mono3d/core/error.h"
#include "mono3d/geometry/distortion.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

// Two cameras one unit apart that look along z at one point 2 units away; the second one's pixel is
// off by (3, 4).
SparseModel TwoImages() {
  SparseModel model;
  model.camera = {.width = 80, .height = 60, .fx = 100, .fy = 100, .cx = 39.5, .cy = 29.5};
  model.points = {{{0, 0, 2}, {1, 2, 3}}, {{0, 0, -1}, {0, 0, 0}}};
  model.images.push_back({0, "a.png", Pose(), {{{39.5, 29.5}, 0}, {{1, 1}, std::nullopt}}});
  const Pose T_world_b(Eigen::Quaterniond::Identity(), {1, 0, 0});
  model.images.push_back({7, "b.png", T_world_b, {{{-10.5 + 3, 29.5 + 4}, 0}}});
  return model;
}

TEST(SparseModel, HasTheMeanErrorOfEachPoint) {
  EXPECT_EQ(ReprojectionErrors_px(TwoImages()), (std::vector<double>{2.5, 0}));
}

TEST(SparseModel, KeepsItsErrorsSmallThroughALens) {
  constexpr double kRounding = 1e-9;
  SparseModel exact = TwoImages();
  exact.images[1].observations[0].pixel = {-10.5, 29.5};
  CameraModel lens = exact.camera.Resized(160, 120);
  lens.distortion = {-0.1, 0.02, 0.001, -0.002, 0.003};
  CameraModel fisheye = lens;
  fisheye.lens = LensModel::kFisheye;
  fisheye.distortion[4] = 0;
  for (const CameraModel& camera : {lens, fisheye}) {
    const SparseModel through_lens = WithCamera(exact, camera);
    EXPECT_EQ(through_lens.camera, camera);
    const Eigen::Vector2d expected = ProjectDistorted(camera, {-1, 0, 2});
    EXPECT_LT((through_lens.images[1].observations[0].pixel - expected).norm(), kRounding);
    EXPECT_LT(ReprojectionErrors_px(through_lens)[0], kRounding);
  }
}

TEST(SparseModel, IsRefusedWhereItContradictsItself) {
  EXPECT_NO_THROW(Validate(TwoImages()));
  SparseModel model = TwoImages();
  model.images[1].id = 0;
  EXPECT_THAT([&] { Validate(model); }, ThrowsMessage<Error>(HasSubstr("two images of one id")));
  model = TwoImages();
  model.images[0].observations[0].point = 2;
  EXPECT_THAT([&] { Validate(model); },
              ThrowsMessage<Error>(HasSubstr("a.png: sparse model: observation of a point")));
  model = TwoImages();
  model.points[0].p_world.x() = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(Validate(model), Error);
  model = TwoImages();
  model.images[0].observations[1].pixel.y() = std::numeric_limits<double>::infinity();
  EXPECT_THROW(Validate(model), Error);
}

}  // namespace
}  // namespace mono3d
