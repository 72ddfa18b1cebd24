// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/dense_workspace.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstring>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/colmap_model.h"
#include "products/run_with_a_lens.h"

namespace mono3d {
namespace {

class DenseWorkspaceTest : public TemporaryFolderTest {
 protected:
  // The value at a place of an array that COLMAP reads: x first, then y, then the channel.
  float ValueAt(const std::filesystem::path& file, int x, int y, int channel) const {
    const std::string bytes = ReadText(folder_ / "dense" / "stereo" / file);
    const std::string header =
        channel == 0 && file.string().starts_with("depth") ? "64&48&1&" : "64&48&3&";
    EXPECT_TRUE(bytes.starts_with(header)) << bytes.substr(0, 10);
    float value = -1;
    const std::size_t at = static_cast<std::size_t>((channel * 48 + y) * 64 + x) * sizeof(float);
    EXPECT_LE(header.size() + at + sizeof(float), bytes.size());
    std::memcpy(&value, bytes.data() + header.size() + at, sizeof(float));
    return value;
  }
};

TEST_F(DenseWorkspaceTest, HasDepthInTheUnitOfTheModel) {
  WriteDenseWorkspace(folder_ / "dense", RunWithALens(folder_));
  const std::string depth = "depth_maps/000004.png.geometric.bin";
  const std::string normal = "normal_maps/000004.png.geometric.bin";
  EXPECT_EQ(ValueAt(depth, 0, 0, 0), 6);
  EXPECT_EQ(ValueAt(depth, 7, 5, 0), 2.5F);
  EXPECT_EQ(ValueAt(depth, 7, 6, 0), 0);
  EXPECT_EQ(ValueAt(normal, 7, 5, 0), .6F);
  EXPECT_EQ(ValueAt(normal, 7, 5, 2), -.8F);
  EXPECT_EQ(ValueAt(normal, 7, 6, 2), 0);
  EXPECT_EQ(ReadText(folder_ / "dense" / "stereo" / "fusion.cfg"), "000004.png\n");
  EXPECT_FALSE(std::filesystem::exists(folder_ / "dense" / "stereo" / "depth_maps" /
                                       "000009.png.geometric.bin"));
}

TEST_F(DenseWorkspaceTest, LeavesOutWhatIsUncertain) {
  WriteDenseWorkspace(folder_ / "dense", RunWithALens(folder_), .6);
  EXPECT_EQ(ValueAt("depth_maps/000004.png.geometric.bin", 0, 0, 0), 0);
  EXPECT_EQ(ValueAt("depth_maps/000004.png.geometric.bin", 7, 5, 0), 2.5F);
}

TEST_F(DenseWorkspaceTest, HasImagesAndPointsWithoutTheLens) {
  WriteDenseWorkspace(folder_ / "dense", RunWithALens(folder_));
  const SparseModel sparse = ReadColmapModel(folder_ / "dense" / "sparse");
  EXPECT_FALSE(sparse.camera.HasDistortion());
  ASSERT_EQ(sparse.images.size(), 2u);
  EXPECT_EQ(sparse.images[0].observations.size(), 1u);
  EXPECT_LT(ReprojectionErrors_px(sparse).at(0), 1e-4);
  const cv::Mat image = cv::imread((folder_ / "dense" / "images" / "000009.png").string());
  EXPECT_EQ(image.size(), cv::Size(64, 48));
  EXPECT_EQ(image.at<cv::Vec3b>(24, 32), cv::Vec3b(10, 20, 31));
}

TEST_F(DenseWorkspaceTest, WritesTiffsOfFloats) {
  const auto written = WriteDepthTiffs(folder_ / "tiff", RunWithALens(folder_));
  EXPECT_THAT(written, testing::ElementsAre(folder_ / "tiff" / "000004.tif"));
  const cv::Mat depth = cv::imread(written[0].string(), cv::IMREAD_UNCHANGED);
  ASSERT_EQ(depth.type(), CV_32FC1);
  EXPECT_EQ(depth.at<float>(5, 7), 2.5F);
  EXPECT_EQ(depth.at<float>(6, 7), 0);
  EXPECT_EQ(depth.at<float>(0, 0), 6);
}

TEST_F(DenseWorkspaceTest, HasDepthMapsOfImagesThatTheSparseModelDropped) {
  FinishedRun run = RunWithALens(folder_);
  for (const char* kind : {"depth", "normal"}) {
    std::filesystem::copy(folder_ / "depth" / ("000004." + std::string(kind) + ".pfm"),
                          folder_ / "depth" / ("000001." + std::string(kind) + ".pfm"));
  }
  std::filesystem::copy(run.images[0].file, folder_ / "images" / "000002.png");
  WriteText("run.json", R"({"input": ")" + (folder_ / "images").string() + R"(", "maps": [
    {"fusions": [{"frame": 4, "fused": true}, {"frame": 1, "fused": true},
                 {"frame": 3, "fused": false}]}]})");
  WriteText("model_trajectory.txt", "0.1 7 8 9 0 0 0 1\n0.4 0 0 0 0 0 0 1\n");
  // Frame 1 of the folder's images 000002, 000004, 000009 is the second one.
  run.images[0].file = folder_ / "images" / "000002.png";
  run.images[0].name = "000002.png";
  run.sparse.images[0].name = "000002.png";
  EXPECT_EQ(WriteDepthTiffs(folder_ / "tiff", run).size(), 2u);
  WriteDenseWorkspace(folder_ / "dense", run);
  EXPECT_EQ(ReadText(folder_ / "dense" / "stereo" / "fusion.cfg"), "000002.png\n000004.png\n");
  const SparseModel sparse = ReadColmapModel(folder_ / "dense" / "sparse");
  ASSERT_EQ(sparse.images.size(), 3u);
  EXPECT_EQ(sparse.images[2].name, "000004.png");
  EXPECT_NEAR((sparse.images[2].T_world_cam.translation() - Eigen::Vector3d(7, 8, 9)).norm(), 0,
              1e-6);
}

TEST_F(DenseWorkspaceTest, NeedsDepthMapsOfTheRightSize) {
  FinishedRun run = RunWithALens(folder_);
  run.depth_camera.width = 32;
  EXPECT_THROW(WriteDenseWorkspace(folder_ / "dense", run), Error);
  run.images[0].depth.clear();
  EXPECT_THROW(WriteDenseWorkspace(folder_ / "dense", run), Error);
  EXPECT_THROW(WriteDepthTiffs(folder_ / "tiff", run), Error);
}

}  // namespace
}  // namespace mono3d
