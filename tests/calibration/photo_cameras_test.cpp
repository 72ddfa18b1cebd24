// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/geometry/distortion.h"
#include "mono3d/image/common_camera.h"
#include "mono3d/image/undistorter.h"
#include "tracking/tracking_world.h"

namespace mono3d {
namespace {

CameraModel OtherCamera() { return {300, 260, 400, 400, 152, 126, {-0.12, 0.02, 0, 0, 0}}; }

// As `camera`, which has a distortion, shows it.
cv::Mat RenderDistorted(const tracking::TexturedGround& ground, const CameraModel& camera,
                        const Pose& T_world_cam) {
  constexpr int kMargin = 40;
  CameraModel straight = camera.WithoutDistortion();
  straight.width += 2 * kMargin;
  straight.height += 2 * kMargin;
  straight.cx += kMargin;
  straight.cy += kMargin;
  const cv::Mat undistorted = ground.Render(straight, T_world_cam);
  cv::Mat map(camera.height, camera.width, CV_32FC2);
  for (int y = 0; y < map.rows; ++y) {
    for (int x = 0; x < map.cols; ++x) {
      const Eigen::Vector2d pixel(x, y);
      Eigen::Vector3d ray = camera.Unproject(pixel);
      for (int i = 0; i < 30; ++i) {
        const Eigen::Vector2d error = pixel - ProjectDistorted(camera, ray);
        ray.head<2>() += error / camera.fx;
      }
      const Eigen::Vector2d at = straight.Project(ray);
      map.at<cv::Vec2f>(y, x) = {static_cast<float>(at.x()), static_cast<float>(at.y())};
    }
  }
  cv::Mat image;
  cv::remap(undistorted, image, map, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  return image;
}

struct TakenPhoto {
  cv::Mat bgr;
  std::size_t camera = 0;
};

// Photos in memory, in the images of one camera, as a folder has them.
class PhotosInMemory : public FrameSource {
 public:
  PhotosInMemory(const std::vector<TakenPhoto>& photos, std::span<const CameraModel> cameras)
      : photos_(photos) {
    std::vector<PhotosOfCamera> all;
    for (const CameraModel& camera : cameras) all.push_back({camera, 1});
    common_ = CommonCamera(all);
    for (const CameraModel& camera : cameras) undistorters_.emplace_back(camera, common_);
  }

  std::optional<Frame> Next() override {
    if (next_ >= photos_.size()) return std::nullopt;
    const TakenPhoto& photo = photos_[next_];
    Frame frame;
    frame.index = static_cast<std::int64_t>(next_++);
    frame.name = "photo " + std::to_string(frame.index);
    frame.bgr = undistorters_[photo.camera].Undistort(photo.bgr);
    frame.camera = common_;
    frame.content = undistorters_[photo.camera].content();
    return frame;
  }
  std::optional<std::int64_t> num_frames() const override {
    return static_cast<std::int64_t>(photos_.size());
  }
  std::int64_t num_skipped() const override { return 0; }
  const CameraModel& camera() const override { return common_; }

 private:
  const std::vector<TakenPhoto>& photos_;
  CameraModel common_;
  std::vector<Undistorter> undistorters_;
  std::size_t next_ = 0;
};

// Part of an orbit over houses; the two cameras in turns.
std::vector<TakenPhoto> TakePhotos() {
  const tracking::TexturedGround ground(true);
  std::vector<TakenPhoto> photos;
  for (int i = 0; i < 12; ++i) {
    const double angle = 0.11 * i;
    const Pose T_world_cam =
        tracking::LookAt({10 * std::sin(angle), -10 * std::cos(angle), 10},
                         {0.8 * std::sin(0.9 * i), 0.8 * std::cos(0.7 * i), 0});
    if (i % 2 == 0) {
      photos.push_back({ground.Render(tracking::SmallCamera(), T_world_cam), 0});
    } else {
      photos.push_back({RenderDistorted(ground, OtherCamera(), T_world_cam), 1});
    }
  }
  return photos;
}

class PhotoCamerasTest : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    photos_ = std::make_unique<std::vector<TakenPhoto>>(TakePhotos());
  }
  static void TearDownTestSuite() { photos_.reset(); }

  static std::vector<CameraCalibration> Calibrate(const std::vector<CameraPrior>& priors) {
    return CalibrateCamerasOfPhotos(
        priors,
        [](std::int64_t frame) { return (*photos_)[static_cast<std::size_t>(frame)].camera; },
        [](std::span<const CameraModel> cameras) {
          return std::make_unique<PhotosInMemory>(*photos_, cameras);
        });
  }

  static std::unique_ptr<std::vector<TakenPhoto>> photos_;
};

std::unique_ptr<std::vector<TakenPhoto>> PhotoCamerasTest::photos_;

TEST_F(PhotoCamerasTest, AreLearnedTogether) {
  const std::vector<CameraModel> truths = {tracking::SmallCamera(), OtherCamera()};
  std::vector<CameraPrior> priors;
  for (const CameraModel& truth : truths) {
    priors.push_back(DefaultCameraPrior(truth.width, truth.height));
  }
  priors[0].camera.fx = priors[0].camera.fy = 1.15 * truths[0].fx;
  priors[1].camera.fx = priors[1].camera.fy = 0.9 * truths[1].fx;
  const std::vector<CameraCalibration> found = Calibrate(priors);
  ASSERT_EQ(found.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) {
    ASSERT_TRUE(found[i].is_learned) << found[i].reason;
    EXPECT_TRUE(found[i].determines_focal_length);
    EXPECT_EQ(found[i].num_images, 6);
    const CameraModel& camera = found[i].posterior.camera;
    EXPECT_EQ(camera.width, truths[i].width);
    EXPECT_NEAR(camera.fx, truths[i].fx, 0.015 * truths[i].fx);
    EXPECT_LT(LargestDifference_px(truths[i], camera), 4);
    EXPECT_EQ(found[i].prior.camera, priors[i].camera);
  }
}

TEST_F(PhotoCamerasTest, LeaveOneThatIsToldAloneAndLearnTheOther) {
  const CameraModel truth = OtherCamera();
  const std::vector<CameraCalibration> found =
      Calibrate({CalibratedCameraPrior(tracking::SmallCamera()),
                 DefaultCameraPrior(truth.width, truth.height)});
  EXPECT_FALSE(found[0].is_learned) << found[0].change_px;
  EXPECT_EQ(found[0].posterior.camera, tracking::SmallCamera());
  ASSERT_TRUE(found[1].is_learned) << found[1].reason;
  EXPECT_NEAR(found[1].posterior.camera.fx, truth.fx, 0.01 * truth.fx);
}

TEST_F(PhotoCamerasTest, FindThatOneIsToldWrong) {
  CameraModel wrong = tracking::SmallCamera();
  wrong.fx = wrong.fy = 1.15 * wrong.fx;
  const std::vector<CameraCalibration> found =
      Calibrate({CalibratedCameraPrior(wrong), CalibratedCameraPrior(OtherCamera())});
  EXPECT_TRUE(found[0].is_learned);
  EXPECT_TRUE(found[0].contradicts_prior);
  EXPECT_NEAR(found[0].posterior.camera.fx, tracking::SmallCamera().fx, 0.02 * wrong.fx);
}

TEST_F(PhotoCamerasTest, HoldOneWithoutAStandardDeviation) {
  CameraModel wrong = tracking::SmallCamera();
  wrong.fx = wrong.fy = 1.03 * wrong.fx;
  CameraPrior held = CalibratedCameraPrior(wrong);
  held.focal_sigma = held.aspect_sigma = held.principal_point_sigma_px = 0;
  held.distortion_sigma = {};
  held.readout_sigma_s = 0;
  const std::vector<CameraCalibration> found =
      Calibrate({held, DefaultCameraPrior(OtherCamera().width, OtherCamera().height)});
  EXPECT_FALSE(found[0].is_learned);
  EXPECT_EQ(found[0].posterior.camera, wrong);
}

}  // namespace
}  // namespace mono3d
