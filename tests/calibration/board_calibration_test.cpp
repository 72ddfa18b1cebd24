// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/calibration/board_calibration.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "calibration/board_scene.h"
#include "mono3d/core/error.h"
#include "reference/random.h"

namespace mono3d {
namespace {

using testing::HasSubstr;

// Images as taken: a camera without distortion asks for these.
class BoardImages : public FrameSource {
 public:
  BoardImages(const std::vector<cv::Mat>& images, const CameraModel& camera)
      : images_(images), camera_(camera) {}

  std::optional<Frame> Next() override {
    if (next_ == images_.size()) return std::nullopt;
    const cv::Mat& image = images_[next_++];
    return Frame{static_cast<std::int64_t>(next_), 0, "image", image, camera_};
  }
  std::optional<std::int64_t> num_frames() const override {
    return static_cast<std::int64_t>(images_.size());
  }
  std::int64_t num_skipped() const override { return 0; }
  const CameraModel& camera() const override { return camera_; }

 private:
  const std::vector<cv::Mat>& images_;
  CameraModel camera_;
  std::size_t next_ = 0;
};

FootageOpener BoardFootage(const std::vector<cv::Mat>& images) {
  return [&images](const CameraModel& camera, int start, int max_frames) {
    EXPECT_FALSE(camera.HasDistortion());
    EXPECT_EQ(start, 0);
    EXPECT_EQ(max_frames, 0);
    return std::make_unique<BoardImages>(images, camera);
  };
}

void ExpectTheCamera(const CameraCalibration& found, double max_corner_error_px) {
  const CameraModel truth = BoardCamera();
  ASSERT_TRUE(found.is_learned) << found.reason;
  EXPECT_EQ(found.reason, "");
  EXPECT_TRUE(found.determines_focal_length);
  EXPECT_TRUE(found.determines_principal_point);
  EXPECT_TRUE(found.determines_distortion[0]);
  const CameraModel& camera = found.posterior.camera;
  EXPECT_NEAR(camera.fx, truth.fx, 0.003 * truth.fx);
  EXPECT_LT(std::abs(std::log(camera.fx / truth.fx)), 3 * found.posterior.focal_sigma);
  EXPECT_LT(LargestDifference_px(truth, camera), max_corner_error_px);
  EXPECT_LT(LargestDifference_px(truth, camera), 3 * found.uncertainty_px);
  EXPECT_LT(found.sigma_px, 0.15);
}

TEST(BoardCalibration, LearnsTheCameraFromAChessboard) {
  const CalibrationBoard board;
  const std::vector<cv::Mat> images =
      BoardScene(board, BoardCamera()).RenderMany(30, 45, SeedFromTestName());
  const CameraPrior prior = DefaultCameraPrior(640, 480);
  const CameraCalibration found = CalibrateFromBoard(prior, BoardFootage(images), board);
  ExpectTheCamera(found, 0.5);
  EXPECT_EQ(found.prior.camera, prior.camera);
  EXPECT_EQ(found.posterior.source, CameraPriorSource::kCalibration);
  EXPECT_GE(found.num_images, 25);
  EXPECT_EQ(found.num_points, 54);
  EXPECT_EQ(found.residuals.size(), 54U * static_cast<std::size_t>(found.num_images));
  EXPECT_FALSE(found.contradicts_prior) << "nothing was told";
}

TEST(BoardCalibration, LearnsAFisheyeLensFromAChessboard) {
  const CalibrationBoard board;
  const CameraModel truth = FisheyeBoardCamera();
  const std::vector<cv::Mat> images =
      BoardScene(board, truth).RenderMany(30, 45, SeedFromTestName());
  const CameraPrior prior = DefaultCameraPrior(640, 480, LensModel::kFisheye);
  const CameraCalibration found = CalibrateFromBoard(prior, BoardFootage(images), board);
  ASSERT_TRUE(found.is_learned) << found.reason;
  const CameraModel& camera = found.posterior.camera;
  EXPECT_EQ(camera.lens, LensModel::kFisheye);
  EXPECT_NEAR(camera.fx, truth.fx, 0.003 * truth.fx);
  EXPECT_LT(LargestDifference_px(truth, camera), 0.5);
  EXPECT_TRUE(found.determines_distortion[0]);
}

TEST(BoardCalibration, LearnsTheCameraFromACharucoBoardThatIsPartlyVisible) {
  const CalibrationBoard board{BoardKind::kCharuco, 10, 7, "DICT_5X5_100", 0.6};
  std::vector<cv::Mat> images =
      BoardScene(board, BoardCamera()).RenderMany(40, 45, SeedFromTestName());
  // The left of the board is hidden in some.
  for (std::size_t i = 0; i < images.size(); i += 3) images[i].colRange(0, 220).setTo(60);
  const CameraCalibration found =
      CalibrateFromBoard(DefaultCameraPrior(640, 480), BoardFootage(images), board);
  // Windows that keep the markers out make a corner twice as noisy, and k3 stays open.
  ExpectTheCamera(found, 1);
  EXPECT_GE(found.num_images, 20);
  EXPECT_LT(found.residuals.size(), 54U * static_cast<std::size_t>(found.num_images));
}

TEST(BoardCalibration, DoesNotTrustACalibrationThatTheBoardContradicts) {
  const CalibrationBoard board;
  const std::vector<cv::Mat> images =
      BoardScene(board, BoardCamera()).RenderMany(30, 45, SeedFromTestName());
  CameraModel told = BoardCamera();
  told.fx = told.fy = 1.1 * told.fx;
  const CameraCalibration found =
      CalibrateFromBoard(CalibratedCameraPrior(told), BoardFootage(images), board);
  ExpectTheCamera(found, 0.5);
  EXPECT_TRUE(found.contradicts_prior);
}

TEST(BoardCalibration, SaysThatThereIsNoBoard) {
  const std::vector<cv::Mat> images(4, cv::Mat(480, 640, CV_8UC3, cv::Scalar::all(90)));
  for (const BoardKind kind : {BoardKind::kChessboard, BoardKind::kCharuco}) {
    const CalibrationBoard board{kind, 9, 6, "DICT_5X5_100", 0.6};
    const CameraPrior prior = DefaultCameraPrior(640, 480);
    const CameraCalibration found = CalibrateFromBoard(prior, BoardFootage(images), board);
    EXPECT_FALSE(found.is_learned);
    EXPECT_THAT(found.reason, HasSubstr("is found in 0 images"));
    EXPECT_EQ(found.posterior.camera, prior.camera);
  }
}

TEST(BoardCalibration, SaysThatABoardThatFacesTheCameraIsNotEnough) {
  const CalibrationBoard board;
  const std::vector<cv::Mat> images =
      BoardScene(board, BoardCamera()).RenderMany(8, 0, SeedFromTestName());
  const CameraCalibration found =
      CalibrateFromBoard(DefaultCameraPrior(640, 480), BoardFootage(images), board);
  EXPECT_FALSE(found.is_learned);
  EXPECT_THAT(found.reason, HasSubstr("not seen from enough sides"));
}

TEST(CalibrationBoard, RefusesWhatCannotBe) {
  const BoardKind charuco = BoardKind::kCharuco;
  EXPECT_NO_THROW(CalibrationBoard{}.Validate());
  EXPECT_NO_THROW((CalibrationBoard{charuco, 7, 5, "DICT_4X4_50", 0.75}.Validate()));
  EXPECT_THROW((CalibrationBoard{.columns = 2}.Validate()), UsageError);
  EXPECT_THROW((CalibrationBoard{.rows = 51}.Validate()), UsageError);
  EXPECT_THROW((CalibrationBoard{charuco, 3, 5, "DICT_5X5_100", 0.75}.Validate()), UsageError);
  EXPECT_THROW((CalibrationBoard{charuco, 7, 5, "DICT_5X5", 0.75}.Validate()), UsageError);
  EXPECT_THROW((CalibrationBoard{charuco, 7, 5, "DICT_5X5_100", 1}.Validate()), UsageError);
  EXPECT_THROW((CalibrationBoard{charuco, 11, 10, "DICT_4X4_50", 0.75}.Validate()), UsageError);
}

}  // namespace
}  // namespace mono3d
