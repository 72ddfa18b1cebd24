// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/tracking/image_bundle_poses.h"

#include <gmock/gmock.h>

#include <numbers>
#include <opencv2/core.hpp>

#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/image/keyframe.h"
#include "tracking/tracking_world.h"

namespace mono3d::tracking {
namespace {

using testing::HasSubstr;

// Five photographs, 8 % of the depth apart, rendered once for all tests.
struct Photographs {
  std::vector<Frame> frames;
  std::vector<Pose> T_world_cam;
};

Photographs Take(bool with_houses) {
  const TexturedGround ground(with_houses);
  Photographs photographs;
  for (int i = 0; i < 5; ++i) {
    Frame frame = BlackFrame(i);
    frame.name = "photograph " + std::to_string(i);
    const Eigen::Vector3d eye(0.8 * i, -2 + 0.2 * (i % 2), 10);
    photographs.T_world_cam.push_back(LookAt(eye, {0.5 * i + 1, 8, 0}));
    frame.bgr = ground.Render(frame.camera, photographs.T_world_cam.back());
    photographs.frames.push_back(frame);
  }
  return photographs;
}

const Photographs& VillagePhotographs() {
  static const Photographs photographs = Take(true);
  return photographs;
}
const Photographs& MeadowPhotographs() {
  static const Photographs photographs = Take(false);
  return photographs;
}

// One estimation for the tests that look at its result.
const ImageBundlePoses& OfVillage() {
  static const ImageBundlePoses poses = EstimateImageBundlePoses(VillagePhotographs().frames);
  return poses;
}

// Largest distance of a camera from the truth after alignment, over the height of 10, and largest
// angle, in degrees, between a motion to the next image and the true one.
struct PoseErrors {
  double position = 0;
  double rotation_deg = 0;
};

PoseErrors Compare(const ImageBundlePoses& poses, const Photographs& truth) {
  std::vector<Eigen::Vector3d> found;
  std::vector<Eigen::Vector3d> expected;
  for (std::size_t i = 0; i < poses.keyframes.size(); ++i) {
    found.push_back(poses.T_world_cam[i].translation());
    expected.push_back(truth.T_world_cam[i].translation());
  }
  const Similarity fit = FitSimilarity(found, expected);
  PoseErrors errors;
  for (std::size_t i = 0; i < found.size(); ++i) {
    errors.position = std::max(errors.position, (fit * found[i] - expected[i]).norm() / 10);
    if (i == 0) continue;
    const Pose step = poses.T_world_cam[i - 1].Inverse() * poses.T_world_cam[i];
    const Pose true_step = truth.T_world_cam[i - 1].Inverse() * truth.T_world_cam[i];
    const double angle = (step.Inverse() * true_step).RotationAngle() * 180 / std::numbers::pi;
    errors.rotation_deg = std::max(errors.rotation_deg, angle);
  }
  return errors;
}

// Some hundred points found to a third of a pixel at 345 px of focal length would leave 0.01 % and
// 0.01 degrees; the renderer samples a texture without smoothing, which costs some times that.
constexpr double kMaxPosition = 0.001;
constexpr double kMaxRotation_deg = 0.1;

TEST(ImageBundlePoses, AreThoseOfThePhotographsOverHouses) {
  ASSERT_TRUE(OfVillage().is_estimated) << OfVillage().reason;
  ASSERT_EQ(OfVillage().keyframes.size(), 5U);
  const PoseErrors errors = Compare(OfVillage(), VillagePhotographs());
  EXPECT_LT(errors.position, kMaxPosition);
  EXPECT_LT(errors.rotation_deg, kMaxRotation_deg);
  EXPECT_LT(OfVillage().reprojection_px, 1);
}

TEST(ImageBundlePoses, AreThoseOfThePhotographsOverAPlane) {
  const ImageBundlePoses poses = EstimateImageBundlePoses(MeadowPhotographs().frames);
  ASSERT_TRUE(poses.is_estimated) << poses.reason;
  const PoseErrors errors = Compare(poses, MeadowPhotographs());
  // Over a plane slope and motion trade off.
  EXPECT_LT(errors.position, 2 * kMaxPosition);
  EXPECT_LT(errors.rotation_deg, 2 * kMaxRotation_deg);
}

TEST(ImageBundlePoses, HaveTheMiddleImageAsWorldAndItsMedianDepthAsUnit) {
  ASSERT_TRUE(OfVillage().is_estimated);
  const Keyframe& middle = OfVillage().keyframes[2];
  EXPECT_LT((OfVillage().T_world_cam[2].Matrix() - Eigen::Matrix4d::Identity()).norm(), 1e-9);
  EXPECT_NEAR(UpperMedianOrZero(middle.sparse_depths_su), 1, 1e-6);  // float
  for (const Keyframe& keyframe : OfVillage().keyframes) {
    EXPECT_GT(keyframe.sparse_depths_su.size(), 100U);
    EXPECT_EQ(keyframe.frame.name, "photograph " + std::to_string(keyframe.id));
  }
}

TEST(ImageBundlePoses, ComeWithAModelThatFitsTheImages) {
  ASSERT_TRUE(OfVillage().is_estimated);
  const SparseModel& model = OfVillage().model;
  EXPECT_NO_THROW(Validate(model));
  ASSERT_EQ(model.images.size(), 5U);
  double sum = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < model.images.size(); ++i) {
    EXPECT_EQ(model.images[i].T_world_cam.Matrix(), OfVillage().T_world_cam[i].Matrix());
    for (const SparseObservation& seen : model.images[i].observations) {
      const Eigen::Vector3d p_cam =
          model.images[i].T_world_cam.Inverse() * model.points.at(*seen.point).p_world;
      sum += (model.camera.Project(p_cam) - seen.pixel).squaredNorm();
      ++count;
    }
  }
  EXPECT_NEAR(std::sqrt(sum / static_cast<double>(count)), OfVillage().reprojection_px, 1e-9);
  EXPECT_GT(count, 3 * model.points.size()) << "most points are seen by several images";
}

TEST(ImageBundlePoses, AreTheSameBitsTwice) {
  const ImageBundlePoses again = EstimateImageBundlePoses(VillagePhotographs().frames);
  ASSERT_TRUE(again.is_estimated);
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(again.T_world_cam[i].Matrix(), OfVillage().T_world_cam[i].Matrix());
  }
}

TEST(ImageBundlePoses, AreRefusedWithoutBaseline) {
  const std::vector<Frame> still(5, VillagePhotographs().frames[0]);
  const ImageBundlePoses poses = EstimateImageBundlePoses(still);
  EXPECT_FALSE(poses.is_estimated);
  EXPECT_THAT(poses.reason, HasSubstr("parallax"));
}

TEST(ImageBundlePoses, AreRefusedUnderPureRotation) {
  const TexturedGround ground(true);
  std::vector<Frame> turned;
  for (int i = 0; i < 5; ++i) {
    Frame& frame = turned.emplace_back(BlackFrame(i));
    frame.bgr = ground.Render(frame.camera, LookAt({0, -2, 10}, {1 + 0.7 * i, 8, 0}));
  }
  const ImageBundlePoses poses = EstimateImageBundlePoses(turned);
  EXPECT_FALSE(poses.is_estimated);
  EXPECT_THAT(poses.reason, testing::AnyOf(HasSubstr("parallax"), HasSubstr("triangulated")));
}

TEST(ImageBundlePoses, AreRefusedWhenOneImageShowsAnotherPlaceAndItIsNamed) {
  std::vector<Frame> frames = VillagePhotographs().frames;
  cv::Mat flipped;
  cv::flip(frames[4].bgr, flipped, 1);  // what no camera over the village could see
  frames[4].bgr = flipped;
  const ImageBundlePoses poses = EstimateImageBundlePoses(frames);
  EXPECT_FALSE(poses.is_estimated);
  EXPECT_THAT(poses.reason, HasSubstr("photograph 4: "));
  EXPECT_THAT(poses.reason, HasSubstr("scene points found again, 30 needed"));
}

TEST(ImageBundlePoses, AreRefusedWithoutTexture) {
  const ImageBundlePoses poses =
      EstimateImageBundlePoses(std::vector<Frame>{BlackFrame(0), BlackFrame(1), BlackFrame(2)});
  EXPECT_FALSE(poses.is_estimated);
  EXPECT_EQ(poses.reason, "no two images make a start: 0 matches, 60 needed");
}

TEST(ImageBundlePoses, NeedThreeFramesOfOneCamera) {
  const std::vector<Frame> two(2, VillagePhotographs().frames[0]);
  EXPECT_THAT([&] { static_cast<void>(EstimateImageBundlePoses(two)); },
              testing::ThrowsMessage<Error>(HasSubstr("too few images")));
  std::vector<Frame> frames = VillagePhotographs().frames;
  frames[3].camera.fx += 1;
  EXPECT_THAT([&] { static_cast<void>(EstimateImageBundlePoses(frames)); },
              testing::ThrowsMessage<Error>(HasSubstr("photograph 3: camera differs")));
}

TEST(ImageBundlePosesOptions, AreValidated) {
  ImageBundlePosesOptions options;
  options.min_parallax_deg = 0;
  EXPECT_THROW(options.Validate(), UsageError);
  options = {};
  options.max_starts = 0;
  EXPECT_THROW(options.Validate(), UsageError);
}

}  // namespace
}  // namespace mono3d::tracking
