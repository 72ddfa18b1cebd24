// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-reconstruct on photographs of two cameras, made of the shipped sequence.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <string>
#include <vector>

#include "mono3d/geometry/distortion.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/colmap_model.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"
#include "tools/command.h"

namespace mono3d {
namespace {

using testing::HasSubstr;

const std::filesystem::path kShippedSequence = MONO3D_EXAMPLE;
constexpr int kNumPhotos = 15;
constexpr int kFramesApart = 5;  // 4.75 degrees

CameraModel ShippedCamera() { return ReadCameraFile(kShippedSequence / "camera.yaml"); }

// A part of the shipped camera's field of view, at a larger scale and through a lens that bends.
CameraModel MadeCamera() { return {600, 440, 760, 760, 290, 225, {-0.08, 0, 0, 0, 0}}; }

cv::Mat AsMadeCameraShowsIt(const cv::Mat& image) {
  const CameraModel from = ShippedCamera();
  const CameraModel to = MadeCamera();
  cv::Mat map(to.height, to.width, CV_32FC2);
  for (int y = 0; y < map.rows; ++y) {
    for (int x = 0; x < map.cols; ++x) {
      const Eigen::Vector2d pixel(x, y);
      Eigen::Vector3d ray = to.Unproject(pixel);
      for (int i = 0; i < 30; ++i) ray.head<2>() += (pixel - ProjectDistorted(to, ray)) / to.fx;
      const Eigen::Vector2d at = from.Project(ray);
      map.at<cv::Vec2f>(y, x) = {static_cast<float>(at.x()), static_cast<float>(at.y())};
    }
  }
  cv::Mat made;
  cv::remap(image, made, map, cv::noArray(), cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  return made;
}

// Photo i is frame kFramesApart * i, every other one of the made camera.
void WritePhotosOfTwoCameras(const std::filesystem::path& folder) {
  std::filesystem::create_directories(folder);
  const std::vector<std::string> images = ListImages(kShippedSequence);
  for (int i = 0; i < kNumPhotos; ++i) {
    cv::Mat image = cv::imread(images.at(static_cast<std::size_t>(kFramesApart * i)));
    if (i % 2 == 1) image = AsMadeCameraShowsIt(image);
    cv::imwrite(folder / (std::to_string(10 + i) + ".jpg"), image);
  }
}

double PositionRmse_m(const std::filesystem::path& trajectory) {
  const std::vector<StampedPose> true_poses = ReadTrajectory(kShippedSequence / "groundtruth.txt");
  std::vector<Eigen::Vector3d> estimated;
  std::vector<Eigen::Vector3d> truth;
  for (const StampedPose& pose : ReadTrajectory(trajectory)) {
    const auto photo = std::lround(30 * pose.timestamp_s);
    estimated.push_back(pose.T_world_cam.translation());
    truth.push_back(
        true_poses.at(static_cast<std::size_t>(kFramesApart * photo)).T_world_cam.translation());
  }
  const Similarity S_truth_estimated = FitSimilarity(estimated, truth);
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    sum += (S_truth_estimated * estimated[i] - truth[i]).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

TEST(PhotosOfTwoCameras, AreFoundOutLearnedAndMadeAModelOf) {
  const std::filesystem::path folder =
      std::filesystem::path(testing::TempDir()) / "mono3d_photos_of_two_cameras";
  std::filesystem::remove_all(folder);
  WritePhotosOfTwoCameras(folder / "photos");
  const std::filesystem::path run = folder / "run";
  const std::string command = std::string(MONO3D_RECONSTRUCT_TOOL) + " " +
                              (folder / "photos").string() + " -o " + run.string();
  const CommandResult result = RunCommand(command, folder);
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("of several cameras"));
  EXPECT_THAT(result.output, HasSubstr("camera 2, 7 photographs of 600x440: focal length"));
  const auto record = nlohmann::json::parse(std::ifstream(run / "run.json"));
  EXPECT_EQ(record["photos"], true);
  ASSERT_EQ(record["cameras"].size(), 2U);
  const std::vector<CameraModel> truths = {ShippedCamera(), MadeCamera()};
  for (std::size_t i = 0; i < 2; ++i) {
    const auto& found = record["cameras"][i];
    EXPECT_EQ(found["learned"], true);
    EXPECT_NEAR(found["camera"]["fx"]["value"], truths[i].fx, 0.01 * truths[i].fx);
    EXPECT_LT(found["camera"]["fx"]["sigma"], 0.01 * truths[i].fx);
    const CameraModel written =
        ReadCameraFile(run / ("learned_camera_" + std::to_string(i + 1) + ".yaml"));
    EXPECT_EQ(written.width, truths[i].width);
  }
  EXPECT_NEAR(record["cameras"][1]["camera"]["k1"]["value"], MadeCamera().distortion[0], 0.02);
  EXPECT_EQ(ReadTrajectory(run / "trajectory.txt").size(), std::size_t{kNumPhotos});
  EXPECT_LT(PositionRmse_m(run / "trajectory.txt"), 0.44) << "half a percent of the mean depth";
  const SparseModel sparse = ReadColmapModel(run / "sparse");
  ASSERT_EQ(sparse.further_cameras.size(), 1U);
  for (const SparseImage& image : sparse.images) {
    EXPECT_EQ(image.camera, static_cast<std::size_t>(image.id % 2)) << image.name;
  }
  EXPECT_GT(ReadPly(run / "model.ply").size(), 20'000U);

  // A calibration of one of them.
  WriteCameraFile(folder / "told.yaml", MadeCamera());
  const CommandResult told = RunCommand(
      command + " --camera " + (folder / "told.yaml").string() + " --resize 300x300", folder);
  ASSERT_EQ(told.exit_status, 0) << told.errors;
  EXPECT_THAT(told.output, HasSubstr("camera 2, 7 photographs of 600x440: --camera is of these"));
  CameraModel neither = MadeCamera();
  neither.width = 500;
  WriteCameraFile(folder / "told.yaml", neither);
  const CommandResult refused =
      RunCommand(command + " --photos --camera " + (folder / "told.yaml").string(), folder);
  EXPECT_EQ(refused.exit_status, kWrongUsage);
  EXPECT_THAT(refused.errors, HasSubstr("another size than all photographs"));
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace mono3d
