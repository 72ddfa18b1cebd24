// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/camera_adjustment.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "calibration/calibration_maps.h"
#include "calibration/intrinsics_variation.h"
#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/core/error.h"
#include "mono3d/geometry/distortion.h"
#include "mono3d/image/camera_positions.h"
#include "mono3d/image/undistorter.h"
#include "reference/random.h"
#include "tracking/tracking_world.h"

namespace mono3d::calibration {
namespace {

CameraAdjustment Adjust(const CameraPrior& prior, const SparseModel& map) {
  return AdjustCamera(prior, prior.camera, {std::vector{map}});
}

TEST(CameraAdjustment, FindsTheCameraOfAnOrbit) {
  const CameraAdjustment found = Adjust(UnknownCamera(), MakeMap(TrueCamera(), Way::kOrbit, 1));
  EXPECT_TRUE(found.is_determined[kLogFocal]);
  const double uncertainty_px = LargestUncertainty_px(found.camera, found.covariance);
  EXPECT_LT(uncertainty_px, 2);
  EXPECT_LT(LargestDifference_px(TrueCamera(), found.camera), 3 * uncertainty_px);
  EXPECT_NEAR(found.camera.fx, TrueCamera().fx, 0.003 * TrueCamera().fx);
  EXPECT_EQ(found.camera.fx, found.camera.fy) << "the prior holds fy / fx";
  EXPECT_NEAR(found.sigma_px, kNoise_px, 0.15 * kNoise_px);
}

// Wherever its memory lies.
TEST(CameraAdjustment, IsTheSameInEveryBit) {
  const SparseModel map = MakeRollingMap(TrueCamera(), 8);
  const CameraAdjustment first = Adjust(UnknownCamera(), map);
  std::mt19937 random(9);
  std::vector<std::vector<char>> taken;
  for (int i = 0; i < 8; ++i) {
    for (int k = 0; k < 200; ++k) taken.emplace_back(random() % 4000);
    for (int k = 0; k < 100; ++k) taken[random() % taken.size()] = {};
    const CameraAdjustment again = Adjust(UnknownCamera(), map);
    ASSERT_EQ(again.camera, first.camera) << i;
    ASSERT_EQ(again.covariance, first.covariance) << i;
  }
}

TEST(CameraAdjustment, StatesHowFarItIsOff) {
  int num_within = 0;
  int num_all = 0;
  for (unsigned seed = 0; seed < 15; ++seed) {
    const CameraAdjustment found =
        Adjust(UnknownCamera(), MakeMap(TrueCamera(), Way::kOrbit, 100 + seed));
    const ParameterVector error = ToParameters(found.camera) - ToParameters(TrueCamera());
    for (const int i : {kLogFocal, kCx, kCy, kK1, kP1, kP2}) {
      ++num_all;
      if (std::abs(error[i]) < 2 * std::sqrt(found.covariance(i, i))) ++num_within;
    }
  }
  // 95 % in the mean, and 90 of them: fewer than 80 by chance once in ten thousand.
  EXPECT_GE(num_within, 80) << "of " << num_all;
}

// What the model leaves out is alike within an image: each of five is larger or smaller by up to a
// pixel at its border than the lens has it. Five errors tell little of how large such errors are.
TEST(CameraAdjustment, StatesHowFarItIsOffWhereFewImagesTell) {
  CameraPrior only_focal = UnknownCamera();
  only_focal.camera = TrueCamera();
  only_focal.principal_point_sigma_px = 0;
  only_focal.distortion_sigma = {};
  std::mt19937 random(11);
  int num_within = 0;
  constexpr unsigned kNumMaps = 60;
  for (unsigned seed = 0; seed < kNumMaps; ++seed) {
    SparseModel map = MakeMap(TrueCamera(), Way::kOrbit, 300 + seed);
    map.images.resize(5);
    for (SparseImage& image : map.images) {
      const double larger = Normal(random, 0.0015);
      for (SparseObservation& seen : image.observations) {
        seen.pixel += larger * (seen.pixel - Eigen::Vector2d(TrueCamera().cx, TrueCamera().cy));
      }
    }
    const CameraAdjustment found = Adjust(only_focal, map);
    const double error = std::log(found.camera.fx / TrueCamera().fx);
    if (std::abs(error) < 2 * std::sqrt(found.covariance(kLogFocal, kLogFocal))) ++num_within;
  }
  // 57 would be 95 %; 50 are, and 41 as if the errors' size were known.
  EXPECT_GE(num_within, 47);
}

// Parameters and back: the parameter of k2 is what it has beyond k1^2.
TEST(CameraParameters, HoldACamera) {
  CameraModel camera = TrueCamera();
  camera.shutter = {0.02, true};
  const ParameterVector parameters = ToParameters(camera);
  EXPECT_NEAR(parameters[kK2], 0.05 - 0.12 * 0.12, 1e-12);
  const CameraModel again = WithParameters(UnknownCamera().camera, parameters);
  EXPECT_NEAR(LargestDifference_px(camera, again), 0, 1e-9);
  EXPECT_EQ(again.shutter, camera.shutter);
  CameraModel fisheye = camera;
  fisheye.lens = LensModel::kFisheye;
  EXPECT_EQ(ToParameters(fisheye)[kK2], 0.05);
}

// Barrel distortion as lenses have it, in few noisy observations: k2 taken for 0 would bend k1, and
// the focal length with it.
TEST(CameraAdjustment, TakesTheUsualK2OfALens) {
  CameraModel truth = TrueCamera();
  truth.distortion = {-0.27, 0.07, 0, 0, 0};
  double bias = 0;
  constexpr int kNumMaps = 6;
  for (unsigned seed = 0; seed < kNumMaps; ++seed) {
    const CameraAdjustment found = Adjust(UnknownCamera(), MakeMap(truth, Way::kOrbit, 40 + seed));
    EXPECT_NEAR(found.camera.fx, truth.fx, 0.003 * truth.fx);
    bias += (found.camera.fx / truth.fx - 1) / kNumMaps;
  }
  EXPECT_LT(std::abs(bias), 0.001);
}

// 140 degrees across the width.
CameraModel TrueFisheye() {
  CameraModel camera = {640, 480, 260, 260, 324, 236, {0.03, -0.01, 0.004, -0.0008, 0}};
  camera.lens = LensModel::kFisheye;
  return camera;
}

CameraPrior UnknownFisheye() { return DefaultCameraPrior(640, 480, LensModel::kFisheye); }

TEST(CameraAdjustment, FindsAFisheyeLens) {
  for (unsigned seed = 0; seed < 3; ++seed) {
    const CameraAdjustment found =
        Adjust(UnknownFisheye(), MakeMap(TrueFisheye(), Way::kOrbit, 20 + seed));
    EXPECT_EQ(found.camera.lens, LensModel::kFisheye);
    EXPECT_TRUE(found.is_determined[kLogFocal]);
    EXPECT_TRUE(found.is_determined[kK1]);
    EXPECT_NEAR(found.camera.fx, TrueFisheye().fx, 0.005 * TrueFisheye().fx);
    EXPECT_LT(LargestDifference_px(TrueFisheye(), found.camera),
              3 * LargestUncertainty_px(found.camera, found.covariance));
    EXPECT_EQ(found.camera.distortion[4], 0);
    EXPECT_NEAR(found.sigma_px, kNoise_px, 0.15 * kNoise_px);
  }
}

TEST(CameraAdjustment, StatesHowFarItIsOffOfAFisheyeLens) {
  int num_within = 0;
  int num_all = 0;
  for (unsigned seed = 0; seed < 10; ++seed) {
    const CameraAdjustment found =
        Adjust(UnknownFisheye(), MakeMap(TrueFisheye(), Way::kOrbit, 200 + seed));
    const ParameterVector error = ToParameters(found.camera) - ToParameters(TrueFisheye());
    for (const int i : {kLogFocal, kCx, kCy, kK1, kK2, kFisheyeK3, kFisheyeK4}) {
      ++num_all;
      if (std::abs(error[i]) < 2 * std::sqrt(found.covariance(i, i))) ++num_within;
    }
  }
  // As above: 70 of them, fewer than 61 by chance once in five hundred.
  EXPECT_GE(num_within, 61) << "of " << num_all;
}

TEST(CameraAdjustment, KeepsThePriorOfWhatAStripDoesNotTell) {
  CameraPrior prior = UnknownCamera();
  prior.camera.fx = prior.camera.fy = 600;
  prior.focal_sigma = 0.03;
  const CameraAdjustment found = Adjust(prior, MakeMap(TrueCamera(), Way::kStrip, 1));
  EXPECT_FALSE(found.is_determined[kLogFocal]);
  EXPECT_EQ(found.camera.fx, 600);
  EXPECT_NEAR(std::sqrt(found.covariance(kLogFocal, kLogFocal)), 0.03, 1e-12);
}

// An error of the focal length that hardly adds to the residuals can hide behind what the model
// leaves out: metadata stand where a swaying strip tells it so, and give way on an orbit.
TEST(CameraAdjustment, KeepsAFocalLengthOfMetadataThatTheResidualsHardlyTell) {
  CameraPrior metadata = UnknownCamera();
  metadata.source = CameraPriorSource::kExif;
  metadata.camera.fx = metadata.camera.fy = 0.95 * TrueCamera().fx;
  metadata.focal_sigma = 0.06;
  const SparseModel strip = MakeMap(TrueCamera(), Way::kStrip, 3, 0.8);
  // Of a lens that is not known to a third, the strip tells more than the prior does.
  EXPECT_TRUE(Adjust(UnknownCamera(), strip).is_determined[kLogFocal]);
  const CameraAdjustment of_strip = Adjust(metadata, strip);
  EXPECT_FALSE(of_strip.is_determined[kLogFocal]);
  EXPECT_NEAR(of_strip.camera.fx, metadata.camera.fx, 1e-9);  // by way of its logarithm
  EXPECT_NEAR(of_strip.covariance(kLogFocal, kLogFocal), 0.06 * 0.06, 1e-12);
  const CameraAdjustment of_orbit = Adjust(metadata, MakeMap(TrueCamera(), Way::kOrbit, 3));
  EXPECT_TRUE(of_orbit.is_determined[kLogFocal]);
  EXPECT_NEAR(of_orbit.camera.fx, TrueCamera().fx, 0.003 * TrueCamera().fx);
}

TEST(CameraAdjustment, FindsTheReadoutTimeAndItsDirection) {
  for (const RollingShutter shutter :
       {RollingShutter{0.02, false}, RollingShutter{-0.03, false}, RollingShutter{0.015, true}}) {
    CameraModel truth = TrueCamera();
    truth.shutter = shutter;
    const CameraAdjustment found = Adjust(UnknownCamera(), MakeRollingMap(truth, 3));
    EXPECT_EQ(found.camera.shutter.reads_columns, shutter.reads_columns);
    EXPECT_NEAR(found.camera.shutter.readout_s, shutter.readout_s, 5e-4);
    EXPECT_TRUE(found.is_determined[shutter.reads_columns ? kReadoutByColumns : kReadoutByRows]);
    EXPECT_NEAR(found.camera.fx, truth.fx, 0.003 * truth.fx);
  }
}

// A turn and a shift that move the image nearly alike: differences of poses tell them apart badly.
// Taken for exact such velocities bend the readout time.
TEST(CameraAdjustment, TakesVelocitiesForNoBetterThanTheyAre) {
  std::mt19937 random(5);
  CameraModel truth = TrueCamera();
  truth.shutter = {0.03, false};
  double mean_error = 0;
  constexpr int kNumMaps = 4;
  for (unsigned seed = 0; seed < kNumMaps; ++seed) {
    SparseModel map = MakeRollingMap(truth, 60 + seed);
    for (SparseImage& image : map.images) {
      const Eigen::Vector3d turn(Normal(random, 0.1), Normal(random, 0.1), 0);
      const Eigen::Vector3d middle(0, 0, image.T_world_cam.translation().norm());
      image.velocity->angular_rad_per_s += turn;
      image.velocity->linear_su_per_s -= turn.cross(middle);
    }
    const CameraAdjustment found = Adjust(UnknownCamera(), map);
    const double error = std::log(found.camera.fx / truth.fx);
    EXPECT_LT(std::abs(error), 3 * std::sqrt(found.covariance(kLogFocal, kLogFocal)));
    EXPECT_NEAR(found.camera.shutter.readout_s, truth.shutter.readout_s, 7e-4);
    mean_error += std::abs(error) / kNumMaps;
  }
  EXPECT_LT(mean_error, 0.004);
}

// What is known of a velocity is how the image moves, not the turn that moves it so through the
// camera that the map was tracked with.
TEST(CameraAdjustment, DoesNotLeanTowardsTheCameraOfTheMap) {
  CameraModel truth = TrueCamera();
  truth.shutter = {0.03, false};
  for (unsigned seed = 1; seed <= 3; ++seed) {
    const SparseModel map = MakeRollingMap(truth, seed, Way::kStrip, 1);
    double found[2];
    for (const int longer : {0, 1}) {
      CameraModel other = truth;
      other.fx = other.fy = (longer == 1 ? 1.08 : 0.92) * truth.fx;
      const std::vector<SparseModel> maps = {TrackedWith(other, map)};
      found[longer] = AdjustCamera(UnknownCamera(), other, {maps}).camera.fx;
    }
    EXPECT_NEAR(found[0] / found[1], 1, 0.01);
  }
}

TEST(CameraAdjustment, InventsNoRollingShutter) {
  EXPECT_TRUE(Adjust(UnknownCamera(), MakeRollingMap(TrueCamera(), 4)).camera.shutter.IsGlobal());
  // Nothing is told by images of which it is not known how the camera moved.
  const CameraAdjustment found = Adjust(UnknownCamera(), MakeMap(TrueCamera(), Way::kOrbit, 5));
  EXPECT_TRUE(found.camera.shutter.IsGlobal());
  EXPECT_FALSE(found.is_determined[kReadoutByRows]);
}

TEST(Contradicts, AFocalLengthThatIsOffByMoreThanCalibrationsAre) {
  const CameraAdjustment found = Adjust(UnknownCamera(), MakeMap(TrueCamera(), Way::kOrbit, 6));
  const auto told = [](double times) {
    CameraModel camera = TrueCamera();
    camera.fx *= times;
    camera.fy *= times;
    return CalibratedCameraPrior(camera);
  };
  EXPECT_TRUE(Contradicts(found, told(0.96)));
  EXPECT_TRUE(Contradicts(found, told(1.04)));
  for (const double times : {0.985, 1., 1.015}) EXPECT_FALSE(Contradicts(found, told(times)));
}

TEST(CameraAdjustment, InventsNoDistortion) {
  CameraModel pinhole = TrueCamera();
  pinhole.distortion = {};
  const CameraAdjustment found = Adjust(UnknownCamera(), MakeMap(pinhole, Way::kOrbit, 2));
  EXPECT_FALSE(found.camera.HasDistortion());
  EXPECT_LT(LargestDifference_px(pinhole, found.camera),
            3 * LargestUncertainty_px(found.camera, found.covariance));
}

TEST(CameraAdjustment, KnowsMoreFromTwoMaps) {
  const std::vector maps = {MakeMap(TrueCamera(), Way::kOrbit, 3),
                            MakeMap(TrueCamera(), Way::kOrbit, 4)};
  const CameraPrior prior = UnknownCamera();
  const CameraAdjustment of_one = Adjust(prior, maps[0]);
  const CameraAdjustment of_both = AdjustCamera(prior, prior.camera, {maps});
  EXPECT_EQ(of_both.num_images, 24U);
  EXPECT_LT(of_both.covariance(kLogFocal, kLogFocal),
            0.8 * of_one.covariance(kLogFocal, kLogFocal));
  EXPECT_LT(LargestUncertainty_px(of_both.camera, of_both.covariance),
            LargestUncertainty_px(of_one.camera, of_one.covariance));
}

// Any focal length fits, with the ground farther away; noise in the poses makes one of them seem
// better.
TEST(CameraAdjustment, KeepsAnUnknownFocalLengthWhereAnyFits) {
  for (unsigned seed = 1; seed <= 5; ++seed) {
    const CameraPrior prior = UnknownCamera();
    const CameraAdjustment found = Adjust(prior, MakeBlock(TrueCamera(), seed, /*higher=*/0));
    EXPECT_FALSE(found.is_determined[kLogFocal]);
    EXPECT_NEAR(found.camera.fx, prior.camera.fx, 1e-9);
    EXPECT_NEAR(std::sqrt(found.covariance(kLogFocal, kLogFocal)), prior.focal_sigma, 1e-12);
  }
}

// Straight down on flat ground a lens that bends the heights costs little, and seems better where
// it fits what the model leaves out: here a quarter of a pixel that no lens of the model has. Where
// the focal length could hide as well, a distortion that is no surer is not taken for found.
TEST(CameraAdjustment, TakesNoDistortionThatABlockFromAboveHardlyTells) {
  CameraModel straight = TrueCamera();
  straight.distortion = {};
  CameraPrior metadata = UnknownCamera();
  metadata.source = CameraPriorSource::kExif;
  metadata.camera.fx = metadata.camera.fy = straight.fx;
  metadata.camera.cx = straight.cx;
  metadata.camera.cy = straight.cy;
  metadata.focal_sigma = 0.06;
  for (unsigned seed = 1; seed <= 3; ++seed) {
    SparseModel block = MakeBlock(straight, seed, /*higher=*/0);
    for (SparseImage& image : block.images) {
      for (SparseObservation& seen : image.observations) {
        const double radius = (seen.pixel - Eigen::Vector2d(straight.cx, straight.cy)).norm();
        seen.pixel.x() += 0.25 * std::sin(3 * radius / straight.cx);
      }
    }
    const CameraAdjustment found = Adjust(metadata, block);
    EXPECT_FALSE(found.is_determined[kLogFocal]);
    EXPECT_LT(LargestDifference_px(straight, found.camera), 1) << seed;
  }
}

// Straight down, a longer focal length is a higher flight, and a lens that bends the rays is ground
// that is bent.
TEST(CameraAdjustment, PositionsTellWhatABlockFromAboveDoesNot) {
  const CameraPrior prior = UnknownCamera();
  const SparseModel block = MakeBlock(TrueCamera(), 1);
  const CameraAdjustment alone = Adjust(prior, block);
  const std::vector positions = {MeasurePositions(block, 0.03)};
  const CameraAdjustment with = AdjustCamera(prior, prior.camera, {std::vector{block}, positions});
  EXPECT_EQ(alone.num_positions, 0U);
  EXPECT_EQ(with.num_positions, block.images.size());
  EXPECT_LT(with.covariance(kLogFocal, kLogFocal), 0.25 * alone.covariance(kLogFocal, kLogFocal));
  EXPECT_TRUE(with.is_determined[kLogFocal]);
  const double sigma = std::sqrt(with.covariance(kLogFocal, kLogFocal));
  EXPECT_LT(std::abs(std::log(with.camera.fx / TrueCamera().fx)), 3 * sigma);
  EXPECT_LT(LargestDifference_px(TrueCamera(), with.camera),
            3 * LargestUncertainty_px(with.camera, with.covariance));
}

TEST(CameraAdjustment, BearsPositionsThatAreFarOff) {
  const CameraPrior prior = UnknownCamera();
  const SparseModel block = MakeBlock(TrueCamera(), 2);
  CameraPositions positions = MeasurePositions(block, 0.03);
  const CameraAdjustment without =
      AdjustCamera(prior, prior.camera, {std::vector{block}, std::vector{positions}});
  for (const std::size_t i : {3U, 14U}) positions.positions[i].p_m += Eigen::Vector3d(20, -9, 30);
  const CameraAdjustment with =
      AdjustCamera(prior, prior.camera, {std::vector{block}, std::vector{positions}});
  EXPECT_LT(LargestDifference_px(without.camera, with.camera),
            LargestUncertainty_px(without.camera, without.covariance));
}

// The roll about the line would be free.
TEST(CameraAdjustment, TakesNoPositionsOnALineOrWithoutHeights) {
  const CameraPrior prior = UnknownCamera();
  const SparseModel strip = MakeMap(TrueCamera(), Way::kStrip, 1, 0.3);
  const std::vector on_a_line = {MeasurePositions(strip, 0.03)};
  const CameraAdjustment of_strip =
      AdjustCamera(prior, prior.camera, {std::vector{strip}, on_a_line});
  EXPECT_EQ(of_strip.num_positions, 0U);
  EXPECT_EQ(of_strip.camera, Adjust(prior, strip).camera);
  const SparseModel block = MakeBlock(TrueCamera(), 3);
  CameraPositions flat = MeasurePositions(block, 0.03);
  flat.has_vertical = false;
  EXPECT_EQ(
      AdjustCamera(prior, prior.camera, {std::vector{block}, std::vector{flat}}).num_positions, 0U);
}

TEST(CameraAdjustment, BearsOutliers) {
  SparseModel map = MakeMap(TrueCamera(), Way::kOrbit, 5);
  std::mt19937 random(1);
  for (SparseImage& image : map.images) {
    for (std::size_t i = 0; i < image.observations.size(); i += 12) {
      for (double& coordinate : image.observations[i].pixel) {
        coordinate += Uniform(random, -40, 40);
      }
    }
  }
  const CameraAdjustment found = Adjust(UnknownCamera(), map);
  EXPECT_LT(LargestDifference_px(TrueCamera(), found.camera), 1.5);
}

// Stabilised by moving the section of the sensor's image that is kept, or zoomed in and out.
TEST(CameraAdjustment, TellsWhetherTheCameraChanges) {
  for (unsigned seed = 0; seed < 4; ++seed) {
    const SparseModel map = MakeMap(TrueCamera(), Way::kOrbit, 60 + seed);
    const IntrinsicsVariation steady = Adjust(UnknownCamera(), map).variation;
    EXPECT_EQ(steady.principal_point_px, 0);
    EXPECT_EQ(steady.focal_share, 0);

    std::mt19937 random(seed);
    SparseModel moving = map;
    SparseModel zooming = map;
    for (std::size_t i = 0; i < map.images.size(); ++i) {
      const Eigen::Vector2d shift(Normal(random, 5), Normal(random, 5));
      const double zoom = std::exp(Normal(random, 0.03));
      const Eigen::Vector2d centre(TrueCamera().cx, TrueCamera().cy);
      for (std::size_t k = 0; k < map.images[i].observations.size(); ++k) {
        moving.images[i].observations[k].pixel += shift;
        Eigen::Vector2d& pixel = zooming.images[i].observations[k].pixel;
        pixel = centre + zoom * (pixel - centre);
      }
    }
    const IntrinsicsVariation moved = Adjust(UnknownCamera(), moving).variation;
    // Less than the 5 px that it moves: poses and velocities take up the rest.
    EXPECT_GT(moved.principal_point_px, 2);
    EXPECT_LT(moved.principal_point_px, 10);
    EXPECT_EQ(moved.focal_share, 0);
    const IntrinsicsVariation zoomed = Adjust(UnknownCamera(), zooming).variation;
    EXPECT_GT(zoomed.focal_share, 0.01);
    EXPECT_LT(zoomed.focal_share, 0.06);
  }
}

// A slow zoom is a difference between stretches of the footage, not between neighbouring images.
TEST(CameraAdjustment, TellsOfASlowZoom) {
  const Eigen::Vector2d centre(TrueCamera().cx, TrueCamera().cy);
  for (unsigned seed = 0; seed < 4; ++seed) {
    const SparseModel map = MakeMap(TrueCamera(), Way::kOrbit, 70 + seed);
    const CameraModel steady = Adjust(UnknownCamera(), map).camera;
    EXPECT_EQ(MeasureFocalDrift({map}, steady), 0);

    SparseModel zooming = map;
    const std::size_t last = map.images.size() - 1;
    for (std::size_t i = 0; i < map.images.size(); ++i) {
      const double zoom = 1 + 0.3 * static_cast<double>(i) / static_cast<double>(last);
      for (SparseObservation& observation : zooming.images[i].observations) {
        observation.pixel = centre + zoom * (observation.pixel - centre);
      }
    }
    const CameraModel one = Adjust(UnknownCamera(), zooming).camera;
    const double drift = MeasureFocalDrift({zooming}, one);
    EXPECT_GT(drift, 0.1);
    EXPECT_LT(drift, 0.35);
  }
}

// Seen in the middle alone, k1 = -0.9 with k2 = 0 fits; towards the corners it folds back.
TEST(CameraAdjustment, FindsALensWhereWhatFitsIsNone) {
  CameraModel folding = TrueCamera();
  folding.distortion = {-0.9, 0, 0, 0, 0};
  SparseModel map = MakeMap(folding, Way::kOrbit, 6);
  for (SparseImage& image : map.images) {
    const Pose T_cam_world = image.T_world_cam.Inverse();
    std::erase_if(image.observations, [&](const SparseObservation& observation) {
      const Eigen::Vector3d p_cam = T_cam_world * map.points[*observation.point].p_world;
      return p_cam.hnormalized().norm() > 0.4;
    });
  }
  CameraPrior prior = UnknownCamera();
  prior.distortion_sigma = {1, 1, 0, 0, 0};
  const CameraAdjustment fitted = Adjust(prior, map);
  EXPECT_LT(fitted.camera.distortion[0], -0.8);
  EXPECT_THROW(Undistorter(fitted.camera), Error);
  const CameraAdjustment lens = AdjustToLens(prior, prior.camera, {std::vector{map}});
  EXPECT_NO_THROW(Undistorter(lens.camera));
  EXPECT_GT(lens.num_observations, 0U);
}

TEST(CameraAdjustment, OfTooLittleChangesNothing) {
  SparseModel map = MakeMap(TrueCamera(), Way::kOrbit, 1);
  map.images.resize(2);
  const CameraPrior prior = UnknownCamera();
  const CameraAdjustment found = Adjust(prior, map);
  EXPECT_EQ(found.num_observations, 0U);
  EXPECT_EQ(found.camera, prior.camera);
  EXPECT_EQ(AdjustCamera(prior, prior.camera, {}).num_observations, 0U);
}

TEST(CamerasAdjustment, FindsTwoCamerasOfOneMap) {
  const std::vector<CameraPrior> priors = {UnknownCamera(), DefaultCameraPrior(500, 600)};
  const std::vector<CameraModel> starts = {priors[0].camera, priors[1].camera};
  const std::vector<CameraModel> truths = {TrueCamera(), SecondCamera()};
  int num_within = 0;
  int num_all = 0;
  for (const unsigned seed : {1U, 2U, 3U}) {
    const std::vector<CameraAdjustment> found =
        AdjustCameras(priors, starts, {std::vector{MakeMapOfTwo(2, seed)}});
    ASSERT_EQ(found.size(), 2U);
    for (std::size_t i = 0; i < 2; ++i) {
      EXPECT_EQ(found[i].num_images, 6U);
      EXPECT_TRUE(found[i].is_determined[kLogFocal]);
      EXPECT_NEAR(found[i].camera.fx, truths[i].fx, 0.005 * truths[i].fx);
      EXPECT_NEAR(found[i].camera.distortion[0], truths[i].distortion[0], 0.02);
      const double sigma = std::sqrt(found[i].covariance(kLogFocal, kLogFocal));
      EXPECT_LT(sigma, 0.005);
      num_within += std::abs(std::log(found[i].camera.fx / truths[i].fx)) < 2 * sigma ? 1 : 0;
      ++num_all;
    }
  }
  EXPECT_GE(num_within, num_all - 1);
}

TEST(CamerasAdjustment, OfOneCameraIsThatOfTheCamera) {
  const SparseModel map = MakeMap(TrueCamera(), Way::kOrbit, 1);
  const CameraAdjustment alone = Adjust(UnknownCamera(), map);
  const CameraAdjustment among =
      AdjustCameras({UnknownCamera()}, std::vector{UnknownCamera().camera}, {std::vector{map}})
          .front();
  EXPECT_NEAR(among.camera.fx, alone.camera.fx, 1e-3);
  EXPECT_NEAR(among.camera.cx, alone.camera.cx, 1e-2);
  // The weights of the robust loss are those of another round.
  EXPECT_NEAR(among.covariance(kLogFocal, kLogFocal), alone.covariance(kLogFocal, kLogFocal),
              0.05 * alone.covariance(kLogFocal, kLogFocal));
}

TEST(CamerasAdjustment, LearnsLittleOfACameraOfOnePhoto) {
  CameraModel simple = SecondCamera();
  simple.distortion = {-0.1, 0.01, 0, 0, 0};
  SparseModel map = MakeMap(TrueCamera(), Way::kOrbit, 4);
  map.images[3] = MakeMap(simple, Way::kOrbit, 4).images[3];
  map.images[3].camera = 1;
  map.further_cameras = {simple};
  const std::vector<CameraPrior> priors = {UnknownCamera(), DefaultCameraPrior(500, 600)};
  const std::vector<CameraAdjustment> found =
      AdjustCameras(priors, std::vector{priors[0].camera, priors[1].camera}, {std::vector{map}});
  EXPECT_EQ(found[1].num_images, 1U);
  EXPECT_TRUE(found[1].is_determined[kLogFocal]);
  EXPECT_TRUE(found[1].is_determined[kK1]);
  EXPECT_NEAR(found[1].camera.fx, 700, 7);
  EXPECT_NEAR(found[1].camera.distortion[0], -0.1, 0.02);
  for (const int held : {kP1, kP2, kK3}) {
    EXPECT_FALSE(found[1].is_determined[held]);
    EXPECT_NEAR(std::sqrt(found[1].covariance(held, held)), PriorSigmas(priors[1])[held], 1e-9);
  }
}

TEST(CamerasAdjustment, LeavesACameraWithoutPhotosWhereItIs) {
  const std::vector<CameraPrior> priors = {UnknownCamera(), DefaultCameraPrior(500, 600)};
  const std::vector<CameraAdjustment> found =
      AdjustCameras(priors, std::vector{priors[0].camera, priors[1].camera},
                    {std::vector{MakeMap(TrueCamera(), Way::kOrbit, 1)}});
  EXPECT_GT(found[0].num_observations, 0U);
  EXPECT_EQ(found[1].num_observations, 0U);
  EXPECT_EQ(found[1].camera, priors[1].camera);
}

}  // namespace
}  // namespace mono3d::calibration
