// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/run_writer.h"

#include <gmock/gmock.h>

#include <array>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/colmap_model.h"
#include "mono3d/io/depth_image_file.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"
#include "mono3d/pipeline/run_folder.h"

namespace mono3d {
namespace {

// A folder of the test's own, empty at the start and gone at the end.
class RunWriterTest : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) /
              (std::string("mono3d_run_writer_") + test->name());
    std::filesystem::remove_all(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::filesystem::path folder_;
};

MapReconstruction MakeMap(int map_id, int num_frames) {
  MapReconstruction map;
  map.map_id = map_id;
  for (int i = 0; i < num_frames; ++i) {
    const Eigen::Vector3d position_su(i, 2, 3);
    map.trajectory.push_back(
        {i, 0.1 * i, map_id, Pose(Eigen::Quaterniond::Identity(), position_su)});
  }
  map.online_trajectory = map.trajectory;
  map.keyframes = {map.trajectory.front()};
  map.model_trajectory = {map.trajectory.back()};
  map.model.points = {{1, 2, 3}, {4, 5, 6}};
  map.model.inferred = {0, 1};
  return map;
}

DepthMap MakeDepthMap(std::int64_t frame_index) {
  DepthMap map;
  map.depth = cv::Mat(3, 4, CV_32FC1, cv::Scalar(2));
  map.camera = CameraModel{.width = 4, .height = 3, .fx = 4, .fy = 4, .cx = 1.5, .cy = 1};
  map.frame_index = frame_index;
  return map;
}

TEST_F(RunWriterTest, WritesTheFilesOfTheFirstMapAndMarksThoseOfTheOthers) {
  Reconstruction reconstruction;
  reconstruction.maps = {MakeMap(0, 5), MakeMap(3, 2)};
  const RunWriter writer(folder_);
  writer.WriteDepthMap(MakeDepthMap(42));
  writer.WriteReconstruction(reconstruction);

  EXPECT_EQ(ReadTrajectory(folder_ / "trajectory.txt").size(), 5U);
  EXPECT_EQ(ReadTrajectory(folder_ / "trajectory_online.txt").size(), 5U);
  EXPECT_EQ(ReadTrajectory(folder_ / "keyframes.txt").size(), 1U);
  EXPECT_EQ(ReadTrajectory(folder_ / "trajectory_map3.txt").size(), 2U);
  const std::vector<StampedPose> fused = ReadTrajectory(folder_ / "model_trajectory.txt");
  ASSERT_EQ(fused.size(), 1U);
  EXPECT_EQ(fused[0].timestamp_s, 0.4);
  EXPECT_EQ(fused[0].T_world_cam.translation(), Eigen::Vector3d(4, 2, 3));
  EXPECT_EQ(ReadPly(writer.model_path()).size(), 2U);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "model_map3.ply"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "depth/000042.depth.pfm"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "depth/000042.depth.png"));
}

TEST_F(RunWriterTest, RecordsOptionsCountsReasonsAndTimes) {
  Reconstruction reconstruction;
  reconstruction.maps = {MakeMap(0, 5)};
  reconstruction.counts.num_frames = 7;
  reconstruction.counts.untracked_frames["58 to 62 matches, 100 needed"] = 2;
  PipelineOptions options;
  options.keyframes.best_angle_deg = 4;
  RunRecord record;
  record.end = RunEnd::kStopped;
  record.options = ListOptions(options);
  record.stages = {{"depth/census", 3, 12, 9}};
  record.num_skipped_images = 1;
  record.input = "bad utf-8 \xff";
  RunWriter(folder_).WriteRecord(reconstruction, record);

  const auto run = nlohmann::json::parse(std::ifstream(folder_ / "run.json"));
  EXPECT_EQ(run["end"], "stopped");
  EXPECT_EQ(run["options"]["keyframes.best_angle_deg"], 4.0);
  EXPECT_EQ(run["counts"]["frames"], 7);
  EXPECT_EQ(run["counts"]["images_skipped"], 1);
  EXPECT_EQ(run["counts"]["untracked_frames"]["58 to 62 matches, 100 needed"], 2);
  EXPECT_EQ(run["maps"][0]["surfels"], 2);
  EXPECT_EQ(run["maps"][0]["surfels_inferred"], 1);
  EXPECT_EQ(run["stages"]["depth/census"]["calls"], 3);
  EXPECT_GT(run["peak_memory_bytes"], 0);
}

TEST_F(RunWriterTest, TellsOfEachCameraOfPhotos) {
  RunRecord record;
  record.are_photos = true;
  for (const int width : {100, 80}) {
    CameraOfRun& camera = record.cameras.emplace_back();
    camera.name = "Maker " + std::to_string(width);
    camera.num_photos = width / 10;
    camera.calibration.prior = camera.calibration.posterior = DefaultCameraPrior(width, 60);
  }
  const RunWriter writer(folder_);
  writer.WriteCamera(record.cameras[1].calibration.posterior.camera, 2);
  writer.WriteRecord({}, record);
  const nlohmann::json json = nlohmann::json::parse(std::ifstream(folder_ / "run.json"));
  EXPECT_FALSE(json.contains("calibration"));
  ASSERT_EQ(json["cameras"].size(), 2U);
  EXPECT_EQ(json["cameras"][0]["name"], "Maker 100");
  EXPECT_EQ(json["cameras"][1]["photos"], 8);
  EXPECT_EQ(json["cameras"][1]["width"], 80);
  EXPECT_EQ(json["cameras"][1]["camera"]["fx"]["value"], 72);
  EXPECT_GT(json["cameras"][1]["camera"]["fx"]["sigma"], 0);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "learned_camera_2.yaml"));
  const RunWriter again(folder_);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "learned_camera_2.yaml"));
}

TEST_F(RunWriterTest, SaysWhichFilesAreOfWhichCamera) {
  CameraModel taken = {.width = 8, .height = 6, .fx = 8, .fy = 8, .cx = 3.5, .cy = 2.5};
  taken.distortion = {-0.1, 0.01, 0, 0, 0};
  const DepthMap map = MakeDepthMap(7);
  const RunWriter writer(folder_);
  writer.WriteDepthMap(map);
  writer.WriteDepthCamera(map.camera);
  EXPECT_EQ(ReadCameraFile(folder_ / "depth/camera.yaml"), map.camera);
  RunRecord record;
  record.cameras_of_files = {{"depth/", map.camera}, {"images/, sparse/", taken}};
  writer.WriteRecord({}, record);
  const auto cameras =
      nlohmann::json::parse(std::ifstream(folder_ / "run.json"))["cameras_of_files"];
  ASSERT_EQ(cameras.size(), 2U);
  EXPECT_EQ(cameras[0]["files"], "depth/");
  EXPECT_EQ(cameras[0]["camera"]["width"], 4);
  EXPECT_EQ(cameras[1]["files"], "images/, sparse/");
  EXPECT_EQ(cameras[1]["camera"]["width"], 8);
  EXPECT_EQ(cameras[1]["camera"]["k1"], -0.1);
  const RunWriter next(folder_);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "depth/camera.yaml"));
}

TEST_F(RunWriterTest, ClearsWhatAnEarlierRunLeftAndNothingElse) {
  constexpr std::array kOfTheEarlierModel = {"report.html", "next_views.json", "next_views.kml",
                                             "evaluation.json", "model_errors.ply"};
  {
    const RunWriter earlier(folder_);
    earlier.WriteDepthMap(MakeDepthMap(7));
    Reconstruction reconstruction;
    reconstruction.maps = {MakeMap(0, 5)};
    earlier.WriteReconstruction(reconstruction);
    std::ofstream(folder_ / "notes.txt") << "mine";
    std::ofstream(folder_ / "depth/mine.pfm") << "mine";
    for (const char* name : kOfTheEarlierModel) std::ofstream(folder_ / name) << "of this model";
  }
  const RunWriter writer(folder_);
  EXPECT_FALSE(std::filesystem::exists(writer.model_path()));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "trajectory.txt"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "depth/000007.depth.pfm"));
  for (const char* name : kOfTheEarlierModel) {
    EXPECT_FALSE(std::filesystem::exists(folder_ / name)) << name;
  }
  EXPECT_TRUE(std::filesystem::exists(folder_ / "notes.txt"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "depth/mine.pfm"));
}

// Whatever their names: a folder of a run that came from elsewhere may be a link to anywhere.
TEST_F(RunWriterTest, LeavesFilesBehindLinkedFoldersAlone) {
  const std::filesystem::path photos = folder_ / "photos", out = folder_ / "out";
  std::filesystem::create_directories(photos);
  std::filesystem::create_directories(out / "products/nerfstudio");
  std::ofstream(photos / "holidays.jpg") << "mine";
  std::ofstream(photos / "000007.depth.pfm") << "mine";
  std::ofstream(out / "model.ply") << "earlier";
  std::filesystem::create_directory_symlink(photos, out / "products/nerfstudio/images");
  std::filesystem::create_directory_symlink(photos, out / "depth");
  (void)RunWriter(out);
  EXPECT_FALSE(std::filesystem::exists(out / "model.ply"));
  EXPECT_TRUE(std::filesystem::exists(photos / "holidays.jpg"));
  EXPECT_TRUE(std::filesystem::exists(photos / "000007.depth.pfm"));
}

TEST_F(RunWriterTest, WritesNoDepthMapsWhereNoneAreWanted) {
  const RunWriter writer(folder_, {DepthFileForm::kNone});
  writer.WriteDepthMap(MakeDepthMap(7));
  writer.WriteDepthCamera(MakeDepthMap(7).camera);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "depth"));
}

TEST_F(RunWriterTest, SaysTheScaleOfDepthIn16Bits) {
  {
    const RunWriter writer(folder_, {DepthFileForm::kPng16, false});
    writer.WriteDepthCamera(MakeDepthMap(7).camera);
    writer.WriteDepthMap(MakeDepthMap(7));
    EXPECT_NEAR(ReadDepthImage(folder_ / "depth/000007.depth16.png").at<float>(1, 1), 2, 1e-3);
    EXPECT_FALSE(std::filesystem::exists(folder_ / "depth/000007.depth.png"));
  }
  const RunWriter of_floats(folder_, {DepthFileForm::kExr});
  EXPECT_FALSE(std::filesystem::exists(folder_ / "depth/000007.depth16.png"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "depth/scale.txt"));
  of_floats.WriteDepthMap(MakeDepthMap(8));
  of_floats.RemoveDepthMap(8);
  EXPECT_TRUE(std::filesystem::is_empty(folder_ / "depth"));
}

TEST_F(RunWriterTest, LeavesTheScaleOfOtherDepthImagesAlone) {
  std::filesystem::create_directories(folder_ / "depth");
  std::ofstream(folder_ / "depth/scale.txt") << "100";
  const RunWriter writer(folder_, {DepthFileForm::kPng16});
  EXPECT_THAT([&] { writer.WriteDepthCamera(MakeDepthMap(7).camera); },
              testing::ThrowsMessage<Error>(testing::HasSubstr("name another folder")));
  std::string scale;
  std::ifstream(folder_ / "depth/scale.txt") >> scale;
  EXPECT_EQ(scale, "100");
}

TEST_F(RunWriterTest, WritesWhatItCanAndSaysWhatItCannot) {
  Reconstruction reconstruction;
  reconstruction.maps = {MakeMap(0, 5), MakeMap(3, 2)};
  const RunWriter writer(folder_);
  std::filesystem::create_directories(folder_ / "trajectory.txt" / "in the way");
  EXPECT_THROW(writer.WriteReconstruction(reconstruction), Error);
  EXPECT_EQ(ReadPly(writer.model_path()).size(), 2U);
  EXPECT_EQ(ReadTrajectory(folder_ / "keyframes.txt").size(), 1U);
  EXPECT_EQ(ReadTrajectory(folder_ / "trajectory_map3.txt").size(), 2U);
}

TEST_F(RunWriterTest, MakesFoldersAgainThatAreRemovedMeanwhile) {
  Reconstruction reconstruction;
  reconstruction.maps = {MakeMap(0, 5)};
  const RunWriter writer(folder_);
  std::filesystem::remove_all(folder_);
  writer.WriteDepthMap(MakeDepthMap(42));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "depth/000042.depth.pfm"));
  std::filesystem::remove_all(folder_);
  writer.WriteReconstruction(reconstruction);
  EXPECT_EQ(ReadPly(writer.model_path()).size(), 2U);
}

TEST_F(RunWriterTest, AFolderThatCannotBeReadIsNotTakenForAnEmptyOne) {
  std::filesystem::create_directories(folder_);
  const std::filesystem::path folder = folder_ / std::string(300, 'a');  // 255 are allowed
  EXPECT_THAT([&] { HoldsRun(folder); },
              testing::ThrowsMessage<Error>(testing::HasSubstr("cannot read the folder")));
  EXPECT_FALSE(HoldsRun(folder_ / "none"));
}

TEST_F(RunWriterTest, PutsANewRunInPlaceOfAnEarlierOne) {
  Reconstruction reconstruction;
  reconstruction.maps = {MakeMap(0, 5), MakeMap(3, 2)};
  EXPECT_FALSE(HoldsRun(folder_));
  {
    const RunWriter earlier(folder_);
    EXPECT_FALSE(HoldsRun(folder_));
    earlier.WriteReconstruction(reconstruction);
    earlier.WriteDepthMap(MakeDepthMap(7));
    std::ofstream(folder_ / "notes.txt") << "mine";
  }
  EXPECT_TRUE(HoldsRun(folder_));
  reconstruction.maps = {MakeMap(0, 4)};
  const RunWriter next(folder_ / "unfinished_1");
  next.WriteReconstruction(reconstruction);
  next.WriteDepthMap(MakeDepthMap(8));
  ReplaceRun(folder_, folder_ / "unfinished_1");
  EXPECT_EQ(ReadTrajectory(folder_ / "trajectory.txt").size(), 4U);
  EXPECT_TRUE(std::filesystem::exists(folder_ / "notes.txt"));
  EXPECT_TRUE(std::filesystem::exists(folder_ / "depth/000008.depth.pfm"));
  for (const char* name : {"depth/000007.depth.pfm", "trajectory_map3.txt", "unfinished_1"}) {
    EXPECT_FALSE(std::filesystem::exists(folder_ / name)) << name;
  }
}

// An earlier run and a new one, of two files each, one of them of the same name.
class ReplacedRun : public TemporaryFolderTest {
 protected:
  ReplacedRun() {
    WriteText("model.ply", "earlier");
    WriteText("depth/000007.depth.pfm", "earlier");
    WriteText("notes.txt", "mine");
    WriteText("unfinished_1/model.ply", "new");
    WriteText("unfinished_1/depth/000008.depth.pfm", "new");
  }
  std::filesystem::path made() const { return folder_ / "unfinished_1"; }
  void ExpectEarlier() const {
    EXPECT_EQ(ReadText(folder_ / "model.ply"), "earlier");
    EXPECT_EQ(ReadText(folder_ / "depth/000007.depth.pfm"), "earlier");
    EXPECT_EQ(ReadText(folder_ / "notes.txt"), "mine");
    EXPECT_FALSE(std::filesystem::exists(folder_ / "depth/000008.depth.pfm"));
    EXPECT_EQ(ReadText(made() / "model.ply"), "new");
    EXPECT_EQ(ReadText(made() / "depth/000008.depth.pfm"), "new");
  }
  void ExpectNew() const {
    EXPECT_EQ(ReadText(folder_ / "model.ply"), "new");
    EXPECT_EQ(ReadText(folder_ / "depth/000008.depth.pfm"), "new");
    EXPECT_EQ(ReadText(folder_ / "notes.txt"), "mine");
    EXPECT_FALSE(std::filesystem::exists(folder_ / "depth/000007.depth.pfm"));
    EXPECT_FALSE(std::filesystem::exists(made()));
  }
};

TEST_F(ReplacedRun, LeavesBothAsTheyWereWhereAFileCannotBeMoved) {
  // A folder of the user's under the name of a file: found when files have been moved already.
  WriteText("depth/000008.depth.pfm/photo.jpg", "mine");
  EXPECT_THROW(ReplaceRun(folder_, made()), Error);
  EXPECT_EQ(ReadText(folder_ / "depth/000008.depth.pfm/photo.jpg"), "mine");
  std::filesystem::remove_all(folder_ / "depth/000008.depth.pfm");
  ExpectEarlier();
}

TEST_F(ReplacedRun, GoesBackWhereTheProcessEndedBeforeAllOfTheEarlierOneHadLeft) {
  std::filesystem::create_directories(made() / ".replaced_part");
  std::filesystem::rename(folder_ / "model.ply", made() / ".replaced_part/model.ply");
  EndReplacements(folder_);
  ExpectEarlier();
}

TEST_F(ReplacedRun, GoesOnWhereTheProcessEndedBeforeAllOfTheNewOneHadCome) {
  std::filesystem::create_directories(made() / ".replaced/depth");
  for (const char* name : {"model.ply", "depth/000007.depth.pfm"}) {
    std::filesystem::rename(folder_ / name, made() / ".replaced" / name);
  }
  std::filesystem::rename(made() / "model.ply", folder_ / "model.ply");
  EndReplacements(folder_);
  ExpectNew();
}

SparseModel MakeSparseModel() {
  SparseModel model;
  model.camera = {.width = 4, .height = 3, .fx = 4, .fy = 4, .cx = 1.5, .cy = 1};
  model.points = {{{0, 0, 2}}};
  for (const char* name : {"a.jpg", "flight.mp4#7", "folder/c.png", "lost.jpg"}) {
    SparseImage& image = model.images.emplace_back();
    image.id = static_cast<std::int64_t>(model.images.size());
    image.name = name;
    image.observations = {{{1.5, 1}, 0}};
  }
  return model;
}

TEST_F(RunWriterTest, NamesTheImagesOfKeyframesAsTheSparseModelDoes) {
  Reconstruction reconstruction;
  reconstruction.maps = {MakeMap(0, 5)};
  reconstruction.maps[0].sparse = MakeSparseModel();
  const RunWriter writer(folder_);
  Frame frame;
  frame.bgr = cv::Mat(3, 4, CV_8UC3, cv::Scalar(1, 2, 3));
  frame.bgr.at<cv::Vec3b>(1, 2) = {200, 7, 100};
  for (const char* name : {"a.jpg", "flight.mp4#7", "c.png", "not_in_the_map.png"}) {
    frame.name = name;
    writer.WriteKeyframeImage(frame);
  }
  writer.WriteSparseModelsOfKeyframeImages(reconstruction);
  const SparseModel written = ReadColmapModel(folder_ / "sparse");
  EXPECT_EQ(written.camera, reconstruction.maps[0].sparse.camera);
  std::vector<std::string> names;
  for (const SparseImage& image : written.images) names.push_back(image.name);
  EXPECT_EQ(names, (std::vector<std::string>{"a.jpg.png", "flight.mp4#7.png", "c.png"}));
  for (const std::string& name : names) {
    const cv::Mat bgr = cv::imread(folder_ / "images_global_shutter" / name);
    ASSERT_EQ(bgr.size(), frame.bgr.size()) << name;
    EXPECT_EQ(cv::norm(bgr, frame.bgr, cv::NORM_INF), 0) << name;
  }
  const RunWriter next(folder_);
  EXPECT_FALSE(std::filesystem::exists(folder_ / "images_global_shutter"));
}

TEST_F(RunWriterTest, SaysWhichImageOfAKeyframeItCannotWrite) {
  const RunWriter writer(folder_);
  std::ofstream(folder_ / "images_global_shutter") << "not a folder";
  Frame frame;
  frame.name = "a.png";
  frame.bgr = cv::Mat(3, 4, CV_8UC3, cv::Scalar(1, 2, 3));
  try {
    writer.WriteKeyframeImage(frame);
    ADD_FAILURE() << "no error";
  } catch (const Error& error) {
    EXPECT_NE(std::string(error.what()).find("images_global_shutter"), std::string::npos);
  }
}

TEST_F(RunWriterTest, RefusesAFolderThatCannotBeWritten) {
  std::filesystem::create_directories(folder_);
  std::ofstream(folder_ / "file") << "not a folder";
  EXPECT_THROW(RunWriter(folder_ / "file" / "out"), Error);
}

}  // namespace
}  // namespace mono3d
