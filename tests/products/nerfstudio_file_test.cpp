// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/nerfstudio_file.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/ply_file.h"
#include "products/run_with_a_lens.h"

namespace mono3d {
namespace {

class NerfstudioFileTest : public TemporaryFolderTest {
 protected:
  nlohmann::json Record() const {
    return nlohmann::json::parse(ReadText(folder_ / "nerfstudio" / "transforms.json"));
  }
};

TEST_F(NerfstudioFileTest, PutsPointsWhereTheImagesShowThem) {
  const FinishedRun run = RunWithALens(folder_);
  WriteNerfstudio(folder_ / "nerfstudio", run, /*is_undistorted=*/true);
  const nlohmann::json record = Record();
  EXPECT_EQ(record["camera_model"], "OPENCV");
  ASSERT_EQ(record["frames"].size(), 2u);
  const PointCloud points = ReadPly(folder_ / "nerfstudio" / record["ply_file_path"]);
  ASSERT_EQ(points.size(), 1u);
  for (std::size_t i = 0; i < 2; ++i) {
    const nlohmann::json& frame = record["frames"][i];
    const cv::Mat image =
        cv::imread((folder_ / "nerfstudio" / frame["file_path"].get<std::string>()).string());
    EXPECT_EQ(image.cols, record["w"]);
    EXPECT_EQ(image.at<cv::Vec3b>(20, 20)[2], 30 + static_cast<int>(i));
    Eigen::Matrix4d matrix;
    for (int row = 0; row < 4; ++row) {
      for (int column = 0; column < 4; ++column) {
        matrix(row, column) = frame["transform_matrix"][static_cast<std::size_t>(row)]
                                   [static_cast<std::size_t>(column)];
      }
    }
    // As OpenGL has it: y up, the camera looks along -z.
    const Eigen::Vector4d p = matrix.inverse() * points.points[0].cast<double>().homogeneous();
    ASSERT_LT(p.z(), 0);
    const double x = record["fl_x"].get<double>() * p.x() / -p.z() + record["cx"].get<double>();
    const double y = record["fl_y"].get<double>() * -p.y() / -p.z() + record["cy"].get<double>();
    // The same through the pinhole camera that the images have now, pixel centres at halves.
    const Eigen::Vector3d p_cam =
        run.images[i].T_world_cam.Inverse() * run.sparse.points[0].p_world;
    EXPECT_NEAR(
        x, record["fl_x"].get<double>() * p_cam.x() / p_cam.z() + record["cx"].get<double>(), 1e-4);
    EXPECT_NEAR(
        y, record["fl_y"].get<double>() * p_cam.y() / p_cam.z() + record["cy"].get<double>(), 1e-4);
    EXPECT_EQ(record["k1"], 0);
  }
}

TEST_F(NerfstudioFileTest, NamesTheImagesOfTheRun) {
  FinishedRun run = RunWithALens(folder_);
  run.images[1].camera.distortion[0] = -.2;  // each its own camera
  WriteNerfstudio(folder_ / "nerfstudio", run);
  const nlohmann::json record = Record();
  EXPECT_FALSE(record.contains("k1"));
  EXPECT_EQ(record["frames"][0]["file_path"], "../images/000004.png");
  EXPECT_EQ(record["frames"][0]["k1"], -.1);
  EXPECT_EQ(record["frames"][0]["p2"], .002);
  EXPECT_EQ(record["frames"][1]["k1"], -.2);
  EXPECT_EQ(record["frames"][1]["cx"], 31.5);
}

TEST_F(NerfstudioFileTest, NeedsImages) {
  FinishedRun run = RunWithALens(folder_);
  for (RunImage& image : run.images) image.file.clear();
  EXPECT_THROW(WriteNerfstudio(folder_ / "nerfstudio", run), Error);
}

TEST_F(NerfstudioFileTest, TakesNamesThatAreNotUtf8) {
  FinishedRun run = RunWithALens(folder_);
  const std::filesystem::path file = folder_ / "images" / "\xE4.png";
  std::filesystem::rename(run.images[0].file, file);
  run.images[0].file = file;
  WriteNerfstudio(folder_ / "nerfstudio", run);
  EXPECT_EQ(Record()["frames"].size(), 2u);
}

}  // namespace
}  // namespace mono3d
