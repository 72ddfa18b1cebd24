// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/calibration/camera_calibration.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <numbers>
#include <optional>
#include <set>
#include <utility>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/image/undistorter.h"
#include "tracking/tracking_world.h"

namespace mono3d {
namespace {

// Frames in memory, as a folder has them.
class FramesInMemory : public FrameSource {
 public:
  FramesInMemory(const std::vector<Frame>& frames, const CameraModel& camera, int start,
                 int max_frames)
      : frames_(frames),
        camera_(camera),
        undistorter_(camera),
        next_(static_cast<std::size_t>(start)) {
    end_ = frames.size();
    if (max_frames > 0) end_ = std::min(end_, next_ + static_cast<std::size_t>(max_frames));
  }

  std::optional<Frame> Next() override {
    if (next_ >= end_) return std::nullopt;
    Frame frame = frames_[next_++];
    frame.bgr = undistorter_.Undistort(frame.bgr);
    frame.camera = undistorter_.camera();
    frame.sensor = camera_.shutter.IsGlobal() ? CameraModel() : camera_;
    return frame;
  }
  std::optional<std::int64_t> num_frames() const override {
    return static_cast<std::int64_t>(end_ - next_);
  }
  std::int64_t num_skipped() const override { return 0; }
  const CameraModel& camera() const override { return undistorter_.camera(); }

 private:
  const std::vector<Frame>& frames_;
  CameraModel camera_;
  Undistorter undistorter_;
  std::size_t next_;
  std::size_t end_ = 0;
};

FootageOpener Footage(const std::vector<Frame>& frames) {
  return [&frames](const CameraModel& camera, int start, int max_frames) {
    return std::make_unique<FramesInMemory>(frames, camera, start, max_frames);
  };
}

// A part of an orbit over houses, looking down obliquely, the camera swaying a little. The section
// of the sensor's image that is kept moves by up to `crop_motion_px`.
std::vector<Frame> FlyAnOrbit(const CameraModel& camera, double crop_motion_px = 0,
                              int num_frames = 45) {
  const tracking::TexturedGround ground(true);
  std::vector<Frame> frames;
  for (int i = 0; i < num_frames; ++i) {
    const double angle = 0.025 * i;
    const Pose T_world_cam =
        tracking::LookAt({10 * std::sin(angle), -10 * std::cos(angle), 10},
                         {0.8 * std::sin(0.2 * i), 0.8 * std::cos(0.13 * i), 0});
    CameraModel of_frame = camera;
    of_frame.cx += crop_motion_px * std::sin(0.9 * i);
    of_frame.cy += crop_motion_px * std::sin(1.3 * i);
    frames.push_back(
        {i, 0.1 * i, "frame " + std::to_string(i), ground.Render(of_frame, T_world_cam), camera});
  }
  return frames;
}

// Without a turn: tells no focal length.
std::vector<Frame> FlyStraight(const CameraModel& camera, int num_frames) {
  const tracking::TexturedGround ground(true);
  std::vector<Frame> frames;
  for (int i = 0; i < num_frames; ++i) {
    const Pose T_world_cam = tracking::LookAt({0.25 * i - 3, -10, 10}, {0.25 * i - 3, 0, 0});
    frames.push_back(
        {i, 0.1 * i, "frame " + std::to_string(i), ground.Render(camera, T_world_cam), camera});
  }
  return frames;
}

class Calibration : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    frames_ = std::make_unique<std::vector<Frame>>(FlyAnOrbit(tracking::SmallCamera()));
  }
  static void TearDownTestSuite() { frames_.reset(); }

  static std::unique_ptr<std::vector<Frame>> frames_;
};

std::unique_ptr<std::vector<Frame>> Calibration::frames_;

TEST_F(Calibration, LearnsAnUnknownCamera) {
  const CameraModel truth = tracking::SmallCamera();
  CameraPrior prior = DefaultCameraPrior(truth.width, truth.height);
  prior.camera.fx = prior.camera.fy = 1.2 * truth.fx;
  const CameraCalibration found = CalibrateCamera(prior, Footage(*frames_), {.max_rounds = 4});
  ASSERT_TRUE(found.is_learned) << found.reason;
  EXPECT_TRUE(found.determines_focal_length);
  EXPECT_EQ(found.reason, "");
  const CameraModel& camera = found.posterior.camera;
  EXPECT_NEAR(camera.fx, truth.fx, 0.01 * truth.fx);
  EXPECT_LT(std::abs(camera.fx / truth.fx - 1), 3 * found.posterior.focal_sigma);
  EXPECT_LT(LargestDifference_px(truth, camera), 3);
  EXPECT_GT(found.change_px, 30);
  EXPECT_EQ(found.prior.camera, prior.camera);
}

TEST_F(Calibration, LooksAtTheWholeOfShortFootage) {
  std::vector<std::pair<int, int>> parts;
  const FootageOpener all = Footage(*frames_);
  const FootageOpener open = [&](const CameraModel& camera, int start, int max_frames) {
    parts.emplace_back(start, max_frames);
    return all(camera, start, max_frames);
  };
  const CameraPrior prior =
      DefaultCameraPrior(tracking::SmallCamera().width, tracking::SmallCamera().height);
  (void)CalibrateCamera(prior, open, {.num_parts = 3, .part_frames = 20, .max_rounds = 4});
  const std::set<std::pair<int, int>> looked_at(parts.begin() + 1, parts.end());  // 0: its size
  EXPECT_EQ(looked_at, (std::set<std::pair<int, int>>{{0, 20}, {0, 45}}));
  parts.clear();
  (void)CalibrateCamera(prior, open, {.num_parts = 2, .part_frames = 14, .max_rounds = 4});
  EXPECT_TRUE(std::ranges::count(parts, std::pair(31, 14)) > 0) << "the last part";
}

TEST_F(Calibration, LooksAtLongerPartsWhereShortOnesTellTooLittle) {
  std::set<std::pair<int, int>> parts;
  const FootageOpener all = Footage(*frames_);
  const FootageOpener open = [&](const CameraModel& camera, int start, int max_frames) {
    if (max_frames > 0) parts.emplace(start, max_frames);
    return all(camera, start, max_frames);
  };
  const CameraPrior prior =
      DefaultCameraPrior(tracking::SmallCamera().width, tracking::SmallCamera().height);
  CalibrationOptions options{.num_parts = 1, .part_frames = 20, .max_share = 1, .max_rounds = 4};
  const CameraCalibration of_all = CalibrateCamera(prior, open, options);
  EXPECT_EQ(parts, (std::set<std::pair<int, int>>{{0, 20}, {0, 45}}));
  parts.clear();
  options.max_share = 0.5;  // hardly more than 20
  const CameraCalibration of_part = CalibrateCamera(prior, open, options);
  EXPECT_EQ(parts, (std::set<std::pair<int, int>>{{0, 20}}));
  EXPECT_GT(of_part.posterior.focal_sigma, 0.001);
  EXPECT_LT(of_all.posterior.focal_sigma, of_part.posterior.focal_sigma);
}

// Every fifth image of the orbit, seven degrees apart, in another order.
TEST_F(Calibration, LearnsTheCameraOfPhotographsInAnyOrder) {
  std::vector<Frame> photos;
  for (std::size_t i = 0; i < 9; ++i) photos.push_back((*frames_)[(35 * i) % 45]);
  const CameraModel truth = tracking::SmallCamera();
  CameraPrior prior = DefaultCameraPrior(truth.width, truth.height);
  prior.camera.fx = prior.camera.fy = 1.2 * truth.fx;
  const CameraCalibration found =
      CalibrateCameraOfPhotos(prior, Footage(photos), {}, {.max_rounds = 5});
  ASSERT_TRUE(found.is_learned) << found.reason;
  EXPECT_TRUE(found.determines_focal_length);
  EXPECT_EQ(found.num_images, 9);
  EXPECT_NEAR(found.posterior.camera.fx, truth.fx, 0.01 * truth.fx);
  EXPECT_LT(LargestDifference_px(truth, found.posterior.camera), 3);
}

TEST_F(Calibration, LeavesATrueCameraOfPhotographsAlone) {
  std::vector<Frame> photos;
  for (std::size_t i = 0; i < 9; ++i) photos.push_back((*frames_)[(35 * i) % 45]);
  const CameraCalibration found =
      CalibrateCameraOfPhotos(CalibratedCameraPrior(tracking::SmallCamera()), Footage(photos));
  EXPECT_FALSE(found.is_learned);
  EXPECT_FALSE(found.contradicts_prior);
}

TEST_F(Calibration, TellsOfAStabilisedImage) {
  const CameraModel truth = tracking::SmallCamera();
  CameraPrior prior = DefaultCameraPrior(truth.width, truth.height);
  prior.camera.fx = prior.camera.fy = truth.fx;
  const CameraCalibration steady = CalibrateCamera(prior, Footage(*frames_), {.max_rounds = 2});
  EXPECT_EQ(steady.variation.principal_point_px, 0);
  const std::vector<Frame> moving = FlyAnOrbit(truth, 4);
  const CameraCalibration found = CalibrateCamera(prior, Footage(moving), {.max_rounds = 2});
  EXPECT_GT(found.variation.principal_point_px, 1);
}

// 150 degrees across the width.
CameraModel SmallFisheye() {
  CameraModel camera = tracking::SmallCamera();
  camera.fx = camera.fy = camera.width / (150 * std::numbers::pi / 180);
  camera.lens = LensModel::kFisheye;
  return camera;
}

const std::vector<Frame>& FisheyeFrames() {
  static const std::vector<Frame> frames = FlyAnOrbit(SmallFisheye());
  return frames;
}

TEST_F(Calibration, LearnsAnUnknownFisheyeLens) {
  const CameraModel truth = SmallFisheye();
  const CameraPrior prior = DefaultCameraPrior(truth.width, truth.height, LensModel::kFisheye);
  const CameraCalibration found =
      CalibrateCamera(prior, Footage(FisheyeFrames()), {.max_rounds = 3});
  ASSERT_TRUE(found.is_learned) << found.reason;
  EXPECT_TRUE(found.determines_focal_length);
  const CameraModel& camera = found.posterior.camera;
  EXPECT_EQ(camera.lens, LensModel::kFisheye);
  EXPECT_NEAR(camera.fx, truth.fx, 0.02 * truth.fx);
  EXPECT_LT(LargestDifference_px(truth, camera), 3);
  EXPECT_GT(found.change_px, 20);
}

TEST_F(Calibration, LeavesATrueFisheyeLensAlone) {
  const CameraModel truth = SmallFisheye();
  const CameraCalibration found =
      CalibrateCamera(CalibratedCameraPrior(truth), Footage(FisheyeFrames()));
  EXPECT_FALSE(found.is_learned);
  EXPECT_FALSE(found.contradicts_prior);
  EXPECT_EQ(found.posterior.camera, truth);
}

TEST_F(Calibration, LeavesATrueOneAlone) {
  const CameraModel truth = tracking::SmallCamera();
  const CameraCalibration found = CalibrateCamera(CalibratedCameraPrior(truth), Footage(*frames_));
  EXPECT_FALSE(found.is_learned);
  EXPECT_FALSE(found.contradicts_prior);
  EXPECT_EQ(found.reason, "the images agree with the calibration");
  EXPECT_EQ(found.posterior.camera, truth);
  EXPECT_EQ(found.num_rounds, 1);
}

TEST_F(Calibration, FindsThatAToldOneIsWrong) {
  const CameraModel truth = tracking::SmallCamera();
  CameraModel told = truth;
  told.fx = told.fy = 1.1 * truth.fx;
  const CameraCalibration found =
      CalibrateCamera(CalibratedCameraPrior(told), Footage(*frames_), {.max_rounds = 4});
  EXPECT_TRUE(found.is_learned);
  EXPECT_TRUE(found.contradicts_prior);
  EXPECT_NEAR(found.posterior.camera.fx, truth.fx, 0.01 * truth.fx);
}

// Nothing can be tracked with it.
TEST_F(Calibration, LearnsTheCameraOfOneThatIsToldFarOff) {
  const CameraModel truth = tracking::SmallCamera();
  CameraModel told = truth;
  told.fx = told.fy = 2 * truth.fx;
  std::vector<Frame> black;
  for (std::size_t i = 0; i < frames_->size(); ++i) {
    black.push_back(tracking::BlackFrame(static_cast<std::int64_t>(i)));
  }
  const FootageOpener open = [&](const CameraModel& camera, int start, int max_frames) {
    return Footage(camera.fx == told.fx ? black : *frames_)(camera, start, max_frames);
  };
  const CameraCalibration found =
      CalibrateCamera(CalibratedCameraPrior(told), open, {.max_rounds = 4});
  EXPECT_TRUE(found.is_learned) << found.reason;
  EXPECT_TRUE(found.contradicts_prior);
  EXPECT_EQ(found.reason, "");
  EXPECT_EQ(found.prior.camera, told);
  EXPECT_EQ(found.posterior.source, CameraPriorSource::kCalibration);
  EXPECT_NEAR(found.posterior.camera.fx, truth.fx, 0.02 * truth.fx);
  EXPECT_GT(found.change_px, 100);
}

// The first part, a straight flight without a turn, tells no focal length: the others do.
TEST_F(Calibration, FindsThatAToldOneIsWrongWhereTheFirstPartCannotTell) {
  const CameraModel truth = tracking::SmallCamera();
  std::vector<Frame> frames = FlyStraight(truth, 25);
  const std::vector<Frame> orbit = FlyAnOrbit(truth, 0, 55);
  for (Frame frame : orbit) {
    frame.index += 25;
    frame.timestamp_s += 2.5;
    frames.push_back(std::move(frame));
  }
  CameraModel told = truth;
  told.fx = told.fy = 1.1 * truth.fx;
  const CameraCalibration found =
      CalibrateCamera(CalibratedCameraPrior(told), Footage(frames),
                      {.num_parts = 3, .part_frames = 25, .max_rounds = 4});
  EXPECT_TRUE(found.is_learned);
  EXPECT_TRUE(found.contradicts_prior);
  EXPECT_NEAR(found.posterior.camera.fx, truth.fx, 0.02 * truth.fx);
}

// Stands for a map of the told camera that starts wrongly and so tells no focal length: with a
// better camera the same images tell it.
TEST_F(Calibration, FindsThatAToldOneIsWrongWhereItsMapsCannotTell) {
  const CameraModel truth = tracking::SmallCamera();
  CameraModel told = truth;
  told.fx = told.fy = 1.1 * truth.fx;
  const std::vector<Frame> straight = FlyStraight(truth, 25);
  const FootageOpener open = [&](const CameraModel& camera, int start, int max_frames) {
    return Footage(camera.fx == told.fx ? straight : *frames_)(camera, start, max_frames);
  };
  const CameraCalibration found =
      CalibrateCamera(CalibratedCameraPrior(told), open, {.max_rounds = 4});
  EXPECT_TRUE(found.is_learned);
  EXPECT_TRUE(found.contradicts_prior);
  EXPECT_NEAR(found.posterior.camera.fx, truth.fx, 0.02 * truth.fx);
}

// As where its map started wrongly: what is tracked at first tells no focal length.
TEST_F(Calibration, BeginsAnewWhereTheFocalLengthStaysInDoubt) {
  const CameraModel truth = tracking::SmallCamera();
  CameraPrior prior = DefaultCameraPrior(truth.width, truth.height);
  prior.camera.fx = prior.camera.fy = 1.2 * truth.fx;
  const std::vector<Frame> straight = FlyStraight(truth, 25);
  int num_with_prior = 0;  // once for the size, once for the first round
  const FootageOpener open = [&](const CameraModel& camera, int start, int max_frames) {
    if (camera == prior.camera) ++num_with_prior;
    return Footage(num_with_prior > 2 ? *frames_ : straight)(camera, start, max_frames);
  };
  const CameraCalibration found = CalibrateCamera(prior, open, {.max_rounds = 2});
  EXPECT_EQ(num_with_prior, 3);
  EXPECT_TRUE(found.determines_focal_length);
  EXPECT_NEAR(found.posterior.camera.fx, truth.fx, 0.02 * truth.fx);
}

// What is told of the lens is right, and says nothing of the shutter.
TEST_F(Calibration, LearnsTheReadoutTimeBesideAToldLens) {
  CameraModel sensor = tracking::SmallCamera();
  sensor.shutter.readout_s = 0.03;
  const tracking::TexturedGround ground(true);
  const tracking::Sequence flight = tracking::FlyUnsteadily(ground, sensor, 60);
  const CameraCalibration found =
      CalibrateCamera(CalibratedCameraPrior(tracking::SmallCamera()), Footage(flight.frames));
  EXPECT_TRUE(found.is_learned) << found.reason;
  EXPECT_FALSE(found.contradicts_prior);
  EXPECT_TRUE(found.determines_readout);
  EXPECT_NEAR(found.posterior.camera.shutter.readout_s, 0.03, 0.0015);
  EXPECT_FALSE(found.posterior.camera.shutter.reads_columns);
  CameraModel lens = found.posterior.camera;
  lens.shutter = {};
  EXPECT_EQ(lens, tracking::SmallCamera());
  EXPECT_EQ(found.posterior.focal_sigma,
            CalibratedCameraPrior(tracking::SmallCamera()).focal_sigma);
}

TEST_F(Calibration, OfWhatCannotBeTrackedIsThePrior) {
  std::vector<Frame> black;
  for (int i = 0; i < 10; ++i) black.push_back(tracking::BlackFrame(i));
  const CameraPrior prior = DefaultCameraPrior(black[0].camera.width, black[0].camera.height);
  const CameraCalibration found = CalibrateCamera(prior, Footage(black));
  EXPECT_FALSE(found.is_learned);
  EXPECT_EQ(found.reason, "too little of the footage can be tracked");
  EXPECT_EQ(found.posterior.camera, prior.camera);
}

TEST(CalibrationOptions, RefuseWhatCannotBe) {
  EXPECT_NO_THROW(CalibrationOptions{}.Validate());
  EXPECT_THROW(CalibrationOptions{.num_parts = 0}.Validate(), UsageError);
  EXPECT_THROW(CalibrationOptions{.part_frames = 2}.Validate(), UsageError);
  EXPECT_THROW(CalibrationOptions{.max_rounds = 0}.Validate(), UsageError);
}

TEST(LargestDifference, IsThatOfTheCorners) {
  const CameraModel a = {640, 480, 500, 500, 319.5, 239.5, {}};
  EXPECT_EQ(LargestDifference_px(a, a), 0);
  CameraModel longer = a;
  longer.fx = longer.fy = 505;
  // One percent of the way from the middle to a corner.
  EXPECT_NEAR(LargestDifference_px(a, longer), 0.01 * std::hypot(319.5, 239.5), 1e-9);
}

}  // namespace
}  // namespace mono3d
