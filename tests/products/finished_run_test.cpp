// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/finished_run.h"

#include <gtest/gtest.h>
#include <sys/stat.h>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/colmap_model.h"

namespace mono3d {
namespace {

class FinishedRunTest : public TemporaryFolderTest {
 protected:
  // Two frames of a video, one of them with a depth map.
  void WriteRun() const {
    WriteText("model.ply", "ply");
    WriteText("images/000012.jpg", "");
    WriteText("depth/000012.depth.exr", "");
    WriteText("depth/000012.confidence.exr", "");
    SparseModel sparse;
    sparse.camera = {.width = 64, .height = 48, .fx = 50, .fy = 50, .cx = 31.5, .cy = 23.5};
    sparse.images.resize(2);
    sparse.images[0].name = "000012.jpg";
    sparse.images[1].id = 1;
    sparse.images[1].name = "000020.jpg";
    sparse.images[1].T_world_cam = Pose(Eigen::Quaterniond::Identity(), {1, 2, 3});
    WriteColmapModel(folder_ / "sparse", sparse);
    WriteText("run.json",
              R"({"input": "flight.mp4", "maps": [{"axes": {"scale": 2.5}, "georeference": {
                "origin": {"latitude_deg": 49.5, "longitude_deg": 8.25, "altitude_m": 160},
                "altitude_known": true}}]})");
  }
};

TEST_F(FinishedRunTest, HasImagesDepthMapsAndOrigin) {
  WriteRun();
  const FinishedRun run = ReadFinishedRun(folder_);
  ASSERT_EQ(run.images.size(), 2u);
  EXPECT_EQ(run.images[0].file, folder_ / "images" / "000012.jpg");
  EXPECT_EQ(run.images[0].depth, folder_ / "depth" / "000012.depth.exr");
  EXPECT_EQ(run.images[0].confidence, folder_ / "depth" / "000012.confidence.exr");
  EXPECT_EQ(run.images[0].camera.width, 64);
  EXPECT_TRUE(run.images[1].file.empty());
  EXPECT_TRUE(run.images[1].depth.empty());
  EXPECT_NEAR((run.images[1].T_world_cam.translation() - Eigen::Vector3d(1, 2, 3)).norm(), 0, 1e-9);
  EXPECT_EQ(run.depth_unit, 2.5);
  ASSERT_TRUE(run.origin);
  EXPECT_EQ(run.origin->latitude_deg, 49.5);
  EXPECT_TRUE(run.is_altitude_known);
}

TEST_F(FinishedRunTest, HasWhatThereIs) {
  WriteText("model.ply", "ply");
  WriteText("run.json", "{\"maps\": 3");
  WriteText("sparse/images.txt", "nonsense\n");
  const FinishedRun run = ReadFinishedRun(folder_);
  EXPECT_TRUE(run.images.empty());
  EXPECT_FALSE(run.origin);
  EXPECT_EQ(run.depth_unit, 1);
}

// Products are written under these names.
TEST_F(FinishedRunTest, LeavesOutImagesWhoseNamesLeadElsewhere) {
  WriteRun();
  for (const char* name : {"../000012.jpg", "/tmp/000012.jpg", "below/000012.jpg", "..", "."}) {
    WriteText("sparse/images.txt", std::string("1 1 0 0 0 0 0 0 1 ") + name + "\n\n");
    EXPECT_TRUE(ReadFinishedRun(folder_).images.empty()) << name;
    EXPECT_TRUE(ReadFinishedRun(folder_).sparse.images.empty()) << name;
  }
}

TEST_F(FinishedRunTest, HasNoUnitAndNoOriginThatCannotBe) {
  WriteRun();
  WriteText("run.json", R"({"maps": [{"axes": {"scale": -2}, "georeference": {
            "origin": {"latitude_deg": 490, "longitude_deg": 8, "altitude_m": 1}}}]})");
  EXPECT_EQ(ReadFinishedRun(folder_).depth_unit, 1);
  EXPECT_FALSE(ReadFinishedRun(folder_).origin);
}

TEST_F(FinishedRunTest, DoesNotWaitForAPipe) {
  WriteRun();
  std::filesystem::remove(folder_ / "run.json");
  ASSERT_EQ(mkfifo((folder_ / "run.json").c_str(), 0600), 0);
  EXPECT_EQ(ReadFinishedRun(folder_).depth_unit, 1);
}

TEST_F(FinishedRunTest, IsRefusedWithoutAModel) { EXPECT_THROW(ReadFinishedRun(folder_), Error); }

}  // namespace
}  // namespace mono3d
