// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The tools on the shipped sequence.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <sstream>
#include <string>
#include <thread>

#include "mono3d/geometry/similarity.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/colmap_model.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/pfm_file.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"
#include "tools/command.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::Not;

// Small images keep the test short; the chain is the same.
const std::string kSmallRun = " --resize 384x224 --tracking.features.num_features 600";
const std::filesystem::path kExample = MONO3D_EXAMPLE;

class ExampleRun : public testing::Test {
 protected:
  void SetUp() override {
    const auto* test = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = std::filesystem::path(testing::TempDir()) /
              (std::string("mono3d_example_run_") + test->name());
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  std::string Command(const std::filesystem::path& output, const std::string& extra) const {
    const bool has_camera = extra.find(" --camera ") != std::string::npos;
    const std::string camera = " --camera " + (kExample / "camera.yaml").string();
    return std::string(MONO3D_RECONSTRUCT_TOOL) + " " + kExample.string() +
           (has_camera ? "" : camera) + " -o " + output.string() + kSmallRun + extra;
  }

  std::filesystem::path folder_;
};

// Root mean square distance of the camera centres from the truth, after the best similarity.
double TrajectoryRmse_m(const std::filesystem::path& trajectory) {
  std::vector<Eigen::Vector3d> estimated;
  std::vector<Eigen::Vector3d> truth;
  const std::vector<StampedPose> true_poses = ReadTrajectory(kExample / "groundtruth.txt");
  for (const StampedPose& pose : ReadTrajectory(trajectory)) {
    for (const StampedPose& true_pose : true_poses) {
      if (std::abs(true_pose.timestamp_s - pose.timestamp_s) > 1e-3) continue;
      estimated.push_back(pose.T_world_cam.translation());
      truth.push_back(true_pose.T_world_cam.translation());
    }
  }
  const Similarity S_truth_estimated = FitSimilarity(estimated, truth);
  double sum = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    sum += (S_truth_estimated * estimated[i] - truth[i]).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(truth.size()));
}

// How far the z axis of a run is from that of the truth, which points up.
double TiltOfZ_deg(const std::filesystem::path& trajectory) {
  Eigen::Matrix3d sum = Eigen::Matrix3d::Zero();
  const std::vector<StampedPose> truth = ReadTrajectory(kExample / "groundtruth.txt");
  for (const StampedPose& pose : ReadTrajectory(trajectory)) {
    const auto i = static_cast<std::size_t>(std::lround(30 * pose.timestamp_s));
    sum += (truth.at(i).T_world_cam.rotation() * pose.T_world_cam.rotation().inverse())
               .toRotationMatrix();
  }
  const Eigen::Vector3d up = sum.col(2).normalized();
  return std::acos(std::min(1.0, up.z())) * 180 / std::numbers::pi;
}

// One file that needs nothing else, small enough to send.
void ExpectReport(const std::filesystem::path& output, const std::string& text) {
  const std::string page = ReadText(output / "report.html");
  EXPECT_THAT(page, HasSubstr(text));
  EXPECT_THAT(page, HasSubstr("</html>"));
  EXPECT_THAT(page, Not(HasSubstr("http:")));
  EXPECT_THAT(page, Not(HasSubstr("https:")));
  EXPECT_LT(page.size(), 3'000'000U);
  EXPECT_GT(std::filesystem::file_size(output / "overview.png"), 1000U);
}

TEST_F(ExampleRun, TracksTheFlightAndMakesAModelTwiceTheSame) {
  // 40 frames of a flight at 88 m mean depth: half a percent of that.
  constexpr double kMaxRmse_m = 0.44;
  // No model meets this: that it is said must not change what is made.
  const std::string never_good =
      " --fusion.health.min_registrations 1 --fusion.health.max_depth_residual 1e-6";
  for (const std::string name : {"a", "b"}) {
    const CommandResult result =
        RunCommand(Command(folder_ / name,
                           " --max-frames 40 --mesh" + (name == "b" ? never_good : std::string())),
                   folder_);
    ASSERT_EQ(result.exit_status, 0) << result.errors;
    EXPECT_THAT(result.output, HasSubstr("model.ply"));
    const auto health =
        nlohmann::json::parse(std::ifstream(folder_ / name / "run.json"))["maps"][0]["health"];
    EXPECT_EQ(health["state"], name == "b" ? "degraded" : "good");
    EXPECT_EQ(result.output.find("the model is ") != std::string::npos, name == "b");
    if (name == "a") continue;
    EXPECT_THAT(result.output,
                HasSubstr("the model is degraded: " + health["reason"].get<std::string>() + "\n"));
  }
  for (const char* file : {"model.ply", "mesh.ply", "trajectory.txt", "trajectory_online.txt",
                           "keyframes.txt", "model_trajectory.txt"}) {
    const std::string first = ReadText(folder_ / "a" / file);
    EXPECT_FALSE(first.empty()) << file;
    EXPECT_TRUE(first == ReadText(folder_ / "b" / file)) << file << " differs";
  }
  EXPECT_GE(ReadTrajectory(folder_ / "a/trajectory.txt").size(), 36U);
  EXPECT_LT(TrajectoryRmse_m(folder_ / "a/trajectory.txt"), kMaxRmse_m);
  EXPECT_GT(ReadPly(folder_ / "a/model.ply").size(), 20'000U);
  EXPECT_LT(TiltOfZ_deg(folder_ / "a/trajectory.txt"), 3);
  const auto record = nlohmann::json::parse(std::ifstream(folder_ / "a/run.json"));
  EXPECT_EQ(record["end"], "finished");
  EXPECT_GE(record["counts"]["fused"], 2);
  EXPECT_EQ(record["options"]["resize"], "384x224");
  ExpectReport(folder_ / "a", "view3d");
  ExpectReport(folder_ / "b", "The model is degraded. Likely cause: ");
}

TEST_F(ExampleRun, SavesItsMapAndSparseModelAndGoesOnInTheMap) {
  constexpr double kMaxRmse_m = 0.44;  // half a percent of the mean depth
  const std::string map = (folder_ / "first.map").string();
  const CommandResult first =
      RunCommand(Command(folder_ / "first", " --max-frames 24 --save-map " + map), folder_);
  ASSERT_EQ(first.exit_status, 0) << first.errors;
  const SparseModel sparse = ReadColmapModel(folder_ / "first/sparse");
  const auto record = nlohmann::json::parse(std::ifstream(folder_ / "first/run.json"));
  EXPECT_EQ(record["maps"][0]["sparse_images"], sparse.images.size());
  EXPECT_EQ(record["maps"][0]["sparse_points"], sparse.points.size());
  EXPECT_GT(sparse.points.size(), 300U);
  // As the images in the folder are, not as they were resized to.
  EXPECT_EQ(sparse.camera, ReadCameraFile(kExample / "camera.yaml"));
  EXPECT_TRUE(std::filesystem::exists(kExample / "images" / sparse.images[0].name));
  for (const SparseImage& image : sparse.images) {
    EXPECT_TRUE(std::filesystem::exists(folder_ / "first/images" / image.name)) << image.name;
  }
  const CameraModel depth_camera = ReadCameraFile(folder_ / "first/depth/camera.yaml");
  EXPECT_EQ(depth_camera.width, 384);
  const auto& cameras_of_files = record["cameras_of_files"];
  ASSERT_EQ(cameras_of_files.size(), 2U);
  EXPECT_EQ(cameras_of_files[0]["camera"]["fx"], depth_camera.fx);
  EXPECT_EQ(cameras_of_files[1]["camera"]["fx"], sparse.camera.fx);

  // Twelve frames need not make a model.
  const CommandResult second =
      RunCommand(Command(folder_ / "second",
                         " --start 24 --max-frames 12 --global-shutter-images --map " + map),
                 folder_);
  EXPECT_LE(second.exit_status, 1) << second.errors;
  // The keyframes of the first run have no image in the second one.
  const SparseModel shown = ReadColmapModel(folder_ / "second/sparse");
  EXPECT_EQ(shown.camera.width, 384);
  EXPECT_FALSE(shown.images.empty());
  for (const SparseImage& image : shown.images) {
    EXPECT_TRUE(std::filesystem::exists(folder_ / "second/images_global_shutter" / image.name));
  }
  const auto trajectory = ReadTrajectory(folder_ / "second/trajectory.txt");
  EXPECT_GE(trajectory.size(), 34U) << "one trajectory with the frames of the map";
  // In the axes of the first run, to which the map has gone on.
  EXPECT_EQ(record["maps"][0]["axes"]["of"], "level");
  const auto again = nlohmann::json::parse(std::ifstream(folder_ / "second/run.json"));
  EXPECT_EQ(again["maps"][0]["axes"]["of"], "saved map");
  const StampedPose before = ReadTrajectory(folder_ / "first/keyframes.txt").at(0);
  const StampedPose now = ReadTrajectory(folder_ / "second/keyframes.txt").at(0);
  const Pose moved = before.T_world_cam.Inverse() * now.T_world_cam;
  EXPECT_LT(moved.translation().norm(), 0.01);
  EXPECT_LT(moved.RotationAngle(), 0.01);
  EXPECT_LT(TrajectoryRmse_m(folder_ / "second/trajectory.txt"), kMaxRmse_m);

  WriteText(folder_ / "first.map", ReadText(folder_ / "first.map").substr(0, 5000));
  const CommandResult damaged = RunCommand(Command(folder_ / "third", " --map " + map), folder_);
  EXPECT_EQ(damaged.exit_status, 1);
  EXPECT_THAT(damaged.errors, HasSubstr("first.map: saved map: damaged"));
}

TEST_F(ExampleRun, GoesOnBehindATruncatedImageAndCountsIt) {
  const std::filesystem::path images = folder_ / "images";
  std::filesystem::copy(kExample / "images", images);
  std::vector<std::filesystem::path> names(std::filesystem::directory_iterator(images), {});
  std::sort(names.begin(), names.end());
  std::filesystem::resize_file(names.at(15), std::filesystem::file_size(names.at(15)) / 2);
  const CommandResult result =
      RunCommand(std::string(MONO3D_RECONSTRUCT_TOOL) + " " + images.string() + " --camera " +
                     (kExample / "camera.yaml").string() + " -o " + (folder_ / "out").string() +
                     kSmallRun + " --max-frames 36 --axes first-camera",
                 folder_);
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_LT(ReadTrajectory(folder_ / "out/keyframes.txt").at(0).T_world_cam.RotationAngle(), 0.01);
  EXPECT_THAT(result.errors, HasSubstr(names.at(15).filename().string()));
  const auto record = nlohmann::json::parse(std::ifstream(folder_ / "out/run.json"));
  EXPECT_EQ(record["counts"]["images_skipped"], 1);
  EXPECT_EQ(record["counts"]["frames"], 35);
  EXPECT_GE(record["counts"]["fused"], 1);
}

// Each is named once, with the reason, and no library prints a line of its own.
TEST_F(ExampleRun, GoesOnBehindDamagedImagesWithoutAWordOfTheirDecoders) {
  const std::filesystem::path images = folder_ / "images";
  std::filesystem::copy(kExample / "images", images);
  std::vector<std::filesystem::path> names(std::filesystem::directory_iterator(images), {});
  std::sort(names.begin(), names.end());
  std::vector<std::string> damaged;
  const auto damage = [&](std::size_t index, const std::string& extension, const auto& spoil) {
    std::filesystem::path path = names.at(index);
    const cv::Mat image = cv::imread(path);
    std::filesystem::remove(path);
    path.replace_extension(extension);
    ASSERT_TRUE(cv::imwrite(path, image));
    std::string bytes = ReadText(path);
    spoil(bytes);
    WriteText(path, bytes);
    damaged.push_back(path.filename());
  };
  damage(15, ".jpg", [](std::string& bytes) {  // many ones are no code
    for (std::size_t i = 0; i < 20; ++i) {
      bytes.replace(bytes.size() / 2 + 2 * i, 2, std::string("\xFF\0", 2));
    }
  });
  damage(20, ".png", [](std::string& bytes) { bytes[bytes.size() / 2] ^= 1; });
  damage(25, ".tiff", [](std::string& bytes) {
    bytes.replace(bytes.size() / 2, 2000, std::string(2000, '\xFF'));
  });
  damage(28, ".ppm", [](std::string& bytes) { bytes.resize(bytes.size() / 2); });
  damage(30, ".webp", [](std::string& bytes) { bytes.resize(bytes.size() / 2); });
  const CommandResult result =
      RunCommand(std::string(MONO3D_RECONSTRUCT_TOOL) + " " + images.string() + " --camera " +
                     (kExample / "camera.yaml").string() + " -o " + (folder_ / "out").string() +
                     kSmallRun + " --video --max-frames 36",
                 folder_);
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  std::istringstream lines(result.errors);
  for (std::string line; std::getline(lines, line);) {
    EXPECT_THAT(line, testing::StartsWith("mono3d-reconstruct: "));
  }
  for (const std::string& name : damaged) {
    const std::size_t first = result.errors.find("skipped: " + (images / name).string());
    ASSERT_NE(first, std::string::npos) << name << "\n" << result.errors;
    EXPECT_EQ(result.errors.find(name, result.errors.find('\n', first)), std::string::npos)
        << result.errors;
  }
  EXPECT_THAT(result.errors, HasSubstr("the image is damaged: copy it again (found "));
  EXPECT_THAT(result.errors, HasSubstr("cannot decode the image (found "));
  const auto record = nlohmann::json::parse(std::ifstream(folder_ / "out/run.json"));
  EXPECT_EQ(record["counts"]["images_skipped"], 5);
  EXPECT_EQ(record["counts"]["frames"], 31);
  EXPECT_GE(record["counts"]["fused"], 1);
}

TEST_F(ExampleRun, GoesOnBehindImagesOfAnotherSizeAndCountsThem) {
  const std::filesystem::path images = folder_ / "images";
  std::filesystem::copy(kExample / "images", images);
  std::vector<std::filesystem::path> names(std::filesystem::directory_iterator(images), {});
  std::sort(names.begin(), names.end());
  for (std::size_t i = 14; i < 17; ++i) {
    cv::Mat image = cv::imread(names.at(i));
    cv::resize(image, image, {}, 0.5, 0.4);
    cv::imwrite(names.at(i), image);
  }
  const CommandResult result =
      RunCommand(std::string(MONO3D_RECONSTRUCT_TOOL) + " " + images.string() + " --camera " +
                     (kExample / "camera.yaml").string() + " -o " + (folder_ / "out").string() +
                     kSmallRun + " --video --max-frames 36",
                 folder_);
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("another shape"));
  const auto record = nlohmann::json::parse(std::ifstream(folder_ / "out/run.json"));
  EXPECT_EQ(record["counts"]["images_skipped"], 3);
  EXPECT_EQ(record["counts"]["frames"], 33);
  EXPECT_EQ(record["maps"].size(), 1U);
  EXPECT_GE(record["counts"]["fused"], 1);
}

TEST_F(ExampleRun, AVideoThatBreaksOffIsReconstructedUpToThere) {
  const std::string video = folder_ / "flight.avi";
  {
    cv::VideoWriter writer(video, cv::CAP_OPENCV_MJPEG, cv::VideoWriter::fourcc('M', 'J', 'P', 'G'),
                           30, {384, 224});
    const std::vector<std::string> images = ListImages(kExample);
    for (std::size_t i = 0; i < 44; ++i) {
      cv::Mat image = cv::imread(images.at(i));
      cv::resize(image, image, {384, 224}, 0, 0, cv::INTER_AREA);
      writer.write(image);
    }
  }
  std::filesystem::resize_file(video, std::filesystem::file_size(video) * 4 / 5);
  const CommandResult result = RunCommand(std::string(MONO3D_RECONSTRUCT_TOOL) + " " + video +
                                              " --camera " + (kExample / "camera.yaml").string() +
                                              " -o " + (folder_ / "out").string() + kSmallRun,
                                          folder_);
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.errors, HasSubstr("the video ends after"));
  const auto record = nlohmann::json::parse(std::ifstream(folder_ / "out/run.json"));
  EXPECT_EQ(record["end"], "finished");
  EXPECT_GE(record["counts"]["frames"], 30);
  EXPECT_LT(record["counts"]["frames"], 44);
  EXPECT_GE(record["counts"]["fused"], 1);
}

bool HasDepthMap(const std::filesystem::path& output) {
  std::error_code not_yet;
  for (const auto& entry : std::filesystem::directory_iterator(output / "depth", not_yet)) {
    if (entry.path().extension() == ".pfm") return true;
  }
  return false;
}

// Runs it until the first depth map is there, so that there is something to keep, and interrupts it
// then.
void RunAndInterrupt(const std::string& tool, const std::filesystem::path& output) {
  const std::string command = "exec " + tool + " >/dev/null 2>&1";
  const pid_t process = fork();
  ASSERT_GE(process, 0);
  if (process == 0) {
    execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
    _exit(127);
  }
  int status = 0;
  bool is_running = true;
  while (is_running) {
    if (HasDepthMap(output)) break;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    is_running = waitpid(process, &status, WNOHANG) == 0;
  }
  ASSERT_TRUE(is_running) << "ended before it made a depth map";
  kill(process, SIGINT);
  ASSERT_EQ(waitpid(process, &status, 0), process);
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(ExampleRun, AnInterruptEndsInOrderWithTheModelSoFar) {
  const std::filesystem::path output = folder_ / "out";
  ASSERT_NO_FATAL_FAILURE(RunAndInterrupt(Command(output, ""), output));
  EXPECT_GT(ReadPly(output / "model.ply").size(), 1000U);
  const auto record = nlohmann::json::parse(std::ifstream(output / "run.json"));
  EXPECT_EQ(record["end"], "stopped");
  EXPECT_LT(record["counts"]["frames"], 76);
  ExpectReport(output, "stopped before the end");
}

TEST_F(ExampleRun, AnInterruptEndsALiveRunInOrderWithAllFiles) {
  const std::filesystem::path output = folder_ / "out";
  // Two images a second: the flight is long from its end when the first depth map is made.
  ASSERT_NO_FATAL_FAILURE(RunAndInterrupt(Command(output, " --live --fps 2"), output));
  EXPECT_GT(ReadPly(output / "model.ply").size(), 1000U);
  for (const char* name : {"trajectory.txt", "trajectory_online.txt", "keyframes.txt",
                           "model_trajectory.txt", "sparse/points3D.txt"}) {
    EXPECT_TRUE(std::filesystem::exists(output / name)) << name;
  }
  const auto record = nlohmann::json::parse(std::ifstream(output / "run.json"));
  EXPECT_EQ(record["end"], "stopped");
  EXPECT_LT(record["counts"]["frames"], 76);
}

TEST_F(ExampleRun, LiveAccountsForEveryFrameAndBundle) {
  constexpr double kMaxRmse_m = 0.44;  // as in the sequential mode
  // Frames may wait for as long as they have to: a slow machine tracks them all.
  const CommandResult result =
      RunCommand(Command(folder_ / "out", " --live --live.max_delay_s 3600"), folder_);
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("bundles dropped"));
  const auto record = nlohmann::json::parse(std::ifstream(folder_ / "out/run.json"));
  EXPECT_EQ(record["counts"]["frames"], 76);
  EXPECT_TRUE(record["live"]["frames_dropped"].empty());
  EXPECT_GT(record["live"]["frames_per_s"], 0);
  EXPECT_GE(record["live"]["latency_ms"]["max"], record["live"]["latency_ms"]["mean"]);
  const auto& counts = record["counts"];
  int num_rejected = 0;
  for (const auto& [reason, count] : counts["rejected_bundles"].items()) {
    num_rejected += count.get<int>();
  }
  EXPECT_GE(counts["fused"], 1);
  EXPECT_EQ(counts["bundles"],
            counts["bundles_dropped"].get<int>() + counts["depth_maps"].get<int>() + num_rejected);
  EXPECT_LT(TrajectoryRmse_m(folder_ / "out/trajectory.txt"), kMaxRmse_m);
}

// Its files are those of the run with the learned camera, as if it had been known.
TEST_F(ExampleRun, ALiveRunLearnsThatItsCameraIsWrong) {
  constexpr double kMaxRmse_m = 0.44;  // as with the true camera
  const CameraModel truth = ReadCameraFile(kExample / "camera.yaml");
  CameraModel wrong = truth;
  wrong.fx = wrong.fy = 1.2 * truth.fx;
  WriteCameraFile(folder_ / "wrong.yaml", wrong);
  const std::filesystem::path out = folder_ / "out";
  const CommandResult result = RunCommand(
      Command(out, " --live --live.max_delay_s 3600 --camera " + (folder_ / "wrong.yaml").string()),
      folder_);
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr(", adopted at frame "));
  const CameraModel learned = ReadCameraFile(out / "learned_camera.yaml");
  EXPECT_EQ(learned.width, truth.width);
  EXPECT_NEAR(learned.fx, truth.fx, 0.02 * truth.fx);
  EXPECT_EQ(ReadColmapModel(out / "sparse").camera.fx, learned.fx);
  const auto record = nlohmann::json::parse(std::ifstream(out / "run.json"));
  EXPECT_EQ(record["self_calibration"]["adopted"], true);
  EXPECT_EQ(record["counts"]["frames"], 76);
  EXPECT_LT(TrajectoryRmse_m(out / "trajectory.txt"), kMaxRmse_m);
  int num_depth_maps = 0;
  for (const auto& entry : std::filesystem::directory_iterator(out / "depth")) {
    num_depth_maps += entry.path().string().ends_with(".depth.pfm") ? 1 : 0;
  }
  EXPECT_EQ(num_depth_maps, record["counts"]["depth_maps"]);
}

TEST_F(ExampleRun, ReadsOptionsFromAConfigFile) {
  WriteText(folder_ / "options.txt",
            "max-frames = 3\nkeyframes.best_angle_deg = 4\n"
            "[tracking.features]\nnum_levels = 7\n"
            "[tracking.initialisation]\nmin_points = 100000\n");
  const CommandResult result = RunCommand(
      Command(folder_ / "out", " --video --config " + (folder_ / "options.txt").string()), folder_);
  EXPECT_EQ(result.exit_status, 1) << "no map starts with so many points";
  const auto record = nlohmann::json::parse(std::ifstream(folder_ / "out/run.json"));
  EXPECT_EQ(record["counts"]["frames"], 3);
  EXPECT_EQ(record["options"]["keyframes.best_angle_deg"], 4.0);
  EXPECT_EQ(record["options"]["tracking.features.num_levels"], 7);
}

// Every third of the first images, with their true poses, for mono3d-depth.
class ExampleBundle : public ExampleRun {
 protected:
  void SetUp() override {
    ExampleRun::SetUp();
    std::filesystem::create_directories(folder_ / "five");
    std::vector<std::filesystem::path> names(
        std::filesystem::directory_iterator(kExample / "images"), {});
    std::sort(names.begin(), names.end());
    const std::vector<StampedPose> truth = ReadTrajectory(kExample / "groundtruth.txt");
    std::vector<StampedPose> poses;
    for (std::size_t i = 0; i < 15; i += 3) {
      std::filesystem::copy(names.at(i), folder_ / "five");
      poses.push_back(truth.at(i));
    }
    WriteTrajectory(folder_ / "poses.txt", poses);
    reference_ = names.at(6).stem();
  }

  // `poses` empty: estimated.
  CommandResult Depth(const std::string& prefix = {}, const std::string& poses = "poses.txt",
                      const std::string& output = "out") const {
    const std::string given = poses.empty() ? "" : " --poses " + (folder_ / poses).string();
    return RunCommand(prefix + MONO3D_DEPTH_TOOL + " " + (folder_ / "five").string() +
                          " --camera " + (kExample / "camera.yaml").string() + given +
                          " --resize 384x224 -o " + (folder_ / output).string(),
                      folder_);
  }

  std::string reference_;
};

TEST_F(ExampleBundle, TheDepthToolWritesDepthNormalsConfidenceAndCloud) {
  const CommandResult result = Depth();
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  const std::string stem = (folder_ / "out" / reference_).string();
  const cv::Mat depth = ReadPfm(stem + ".depth.pfm");
  EXPECT_EQ(depth.size(), cv::Size(384, 224));
  EXPECT_EQ(ReadPfm(stem + ".normal.pfm").type(), CV_32FC3);
  EXPECT_EQ(ReadPfm(stem + ".confidence.pfm").type(), CV_32FC1);
  EXPECT_TRUE(std::filesystem::exists(stem + ".depth.png"));
  const auto record = nlohmann::json::parse(std::ifstream(folder_ / "out/bundle.json"));
  EXPECT_EQ(ReadPly(folder_ / "out/cloud.ply").size(), record["estimates"]);
  EXPECT_GT(record["estimates"].get<double>(), 0.7 * record["pixels"].get<double>());
}

TEST_F(ExampleBundle, TheDepthToolEstimatesPosesAndTakesThemBackInBothForms) {
  const CommandResult result = Depth({}, "");
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  const auto record = nlohmann::json::parse(std::ifstream(folder_ / "out/bundle.json"));
  EXPECT_EQ(record["poses"]["from"], "estimated");
  EXPECT_EQ(record["poses"]["images"].size(), 5U);
  EXPECT_GT(record["poses"]["points"], 200);
  EXPECT_LT(record["poses"]["reprojection_px"], 1);
  EXPECT_GT(record["estimates"].get<double>(), 0.7 * record["pixels"].get<double>());
  // The middle camera is the world; the steps to the others are the true ones but for the scale.
  const std::vector<StampedPose> truth = ReadTrajectory(folder_ / "poses.txt");
  const std::vector<StampedPose> found = ReadTrajectory(folder_ / "out/poses.txt");
  ASSERT_EQ(found.size(), 5U);
  for (const std::size_t i : {0U, 4U}) {
    const Pose expected = truth[2].T_world_cam.Inverse() * truth[i].T_world_cam;
    constexpr double kMaxAngle_rad = 0.002;  // 0.7 px at a focal length of 346
    EXPECT_LT((expected.Inverse() * found[i].T_world_cam).RotationAngle(), kMaxAngle_rad);
  }
  for (const std::string poses : {"out/poses.txt", "out/sparse"}) {
    const CommandResult again = Depth({}, poses, "again");
    ASSERT_EQ(again.exit_status, 0) << poses << ": " << again.errors;
    const cv::Mat depth = ReadPfm((folder_ / "again" / reference_).string() + ".depth.pfm");
    EXPECT_GT(cv::countNonZero(depth), 0.7 * static_cast<double>(depth.total())) << poses;
  }
}

TEST_F(ExampleBundle, TheDepthToolSaysWhyItFindsNoPoses) {
  const std::filesystem::path five = folder_ / "five";
  std::vector<std::filesystem::path> names(std::filesystem::directory_iterator(five), {});
  for (const std::filesystem::path& name : names) {
    if (name != names[0]) {
      std::filesystem::copy(names[0], name, std::filesystem::copy_options::overwrite_existing);
    }
  }
  const CommandResult result = Depth({}, "");
  EXPECT_EQ(result.exit_status, 1);
  EXPECT_THAT(result.errors, HasSubstr("no poses: no two images make a start: "));
  EXPECT_THAT(result.errors, HasSubstr("parallax"));
}

TEST_F(ExampleBundle, AFullDiskIsNamedAndLeavesNoHalfWrittenFile) {
  // Files of at most 32 KiB (the depth has 336), and no signal when one would grow larger.
  const CommandResult result = Depth("trap '' XFSZ; ulimit -f 64; ");
  EXPECT_EQ(result.exit_status, 1);
  EXPECT_THAT(result.errors, HasSubstr(reference_ + ".depth.pfm: cannot write the file"));
  for (const auto& entry : std::filesystem::directory_iterator(folder_ / "out")) {
    EXPECT_EQ(entry.path().filename(), "bundle.json") << "half-written or left behind";
  }
}

// How many options a help lists.
int NumOptionsOf(const std::string& help) {
  int num_options = 0;
  std::istringstream lines(help);
  for (std::string line; std::getline(lines, line);) {
    num_options += line.starts_with("  -") ? 1 : 0;
  }
  return num_options;
}

TEST(Tools, HelpListsTheDozenThatMatterAndHelpAllEverything) {
  const std::filesystem::path folder = testing::TempDir();
  const std::string tool = MONO3D_RECONSTRUCT_TOOL;
  const CommandResult help = RunCommand(tool + " --help", folder);
  EXPECT_EQ(help.exit_status, 0);
  EXPECT_THAT(help.output, HasSubstr("--help-all"));
  EXPECT_THAT(help.output, HasSubstr("--camera "));
  EXPECT_THAT(help.output, HasSubstr("--photos"));
  EXPECT_THAT(help.output, HasSubstr("\nExamples:\n  mono3d-reconstruct "));
  EXPECT_THAT(help.output, Not(HasSubstr("--depth.")));
  EXPECT_LE(NumOptionsOf(help.output), 16);
  const CommandResult all = RunCommand(tool + " --help-all", folder);
  EXPECT_EQ(all.exit_status, 0);
  EXPECT_THAT(all.output, HasSubstr("--depth.pyramid.level"));
  EXPECT_THAT(all.output, HasSubstr("--depth.sgm.p1"));
  EXPECT_GE(NumOptionsOf(all.output), 90);
}

TEST(Tools, HelpOfTheOthersIsShortToo) {
  const std::filesystem::path folder = testing::TempDir();
  for (const char* tool : {MONO3D_DEPTH_TOOL, MONO3D_CALIBRATE_TOOL, MONO3D_RENDER_TOOL}) {
    const CommandResult help = RunCommand(std::string(tool) + " --help", folder);
    EXPECT_EQ(help.exit_status, 0);
    EXPECT_LE(NumOptionsOf(help.output), 30) << tool;
  }
}

TEST(Tools, AMisspeltOptionIsAnsweredByTheOneThatIsMeant) {
  const std::filesystem::path folder = testing::TempDir();
  const auto errors_of = [&](const std::string& arguments) {
    const CommandResult result = RunCommand(arguments, folder);
    EXPECT_EQ(result.exit_status, kWrongUsage) << arguments;
    return result.errors;
  };
  const std::string reconstruct = std::string(MONO3D_RECONSTRUCT_TOOL) + " in -o out ";
  EXPECT_THAT(errors_of(reconstruct + "--mehs"), HasSubstr("did you mean --mesh?"));
  EXPECT_THAT(errors_of(reconstruct + "--max_frames=3"), HasSubstr("did you mean --max-frames?"));
  EXPECT_THAT(errors_of(reconstruct + "--xyzzyxyzzy"), Not(HasSubstr("did you mean")));
  EXPECT_THAT(errors_of(std::string(MONO3D_EVALUATE_TOOL) + " depth a b --max-dept 3"),
              HasSubstr("did you mean --max-depth?"));
  EXPECT_THAT(errors_of(reconstruct + "--fast --best"), HasSubstr("--best"));
}

TEST(Tools, TheManualAndTheCompletionComeFromTheSameTable) {
  const std::filesystem::path folder = testing::TempDir();
  const std::string tool = MONO3D_RECONSTRUCT_TOOL;
  const CommandResult page = RunCommand(tool + " --man-page", folder);
  EXPECT_EQ(page.exit_status, 0);
  EXPECT_THAT(page.output, HasSubstr(".TH MONO3D\\-RECONSTRUCT 1 "));
  EXPECT_THAT(page.output, HasSubstr("\\-\\-depth.sgm.p1"));
  EXPECT_THAT(page.output, HasSubstr("\n.BI \"\\-\\-mesh\"\nwrite mesh.ply"));
  EXPECT_THAT(page.output, HasSubstr("\n.BI \"\\-\\-device\" \" TEXT\"\nVulkan device"));
  EXPECT_THAT(page.output, HasSubstr(".SH EXAMPLES"));
  const std::string script = (folder / "mono3d_completion").string();
  ASSERT_EQ(RunCommand(tool + " --bash-completion > " + script, folder).exit_status, 0);
  const CommandResult completed =
      RunCommand("bash -c '. " + script +
                     "; COMP_WORDS=(mono3d-reconstruct --mes); COMP_CWORD=1; _mono3d_reconstruct; "
                     "echo \"${COMPREPLY[@]}\"'",
                 folder);
  EXPECT_THAT(completed.output, testing::StartsWith("--mesh"));
  EXPECT_THAT(completed.output, Not(HasSubstr("--camera")));
  std::filesystem::remove(script);
}

TEST(Tools, HelpVersionAndDevicesNeedNoInput) {
  const std::filesystem::path folder = testing::TempDir();
  for (const char* tool : {MONO3D_DEPTH_TOOL, MONO3D_RECONSTRUCT_TOOL}) {
    const CommandResult help = RunCommand(std::string(tool) + " --help", folder);
    EXPECT_EQ(help.exit_status, 0);
    EXPECT_THAT(help.output, HasSubstr("--camera"));
    const CommandResult version = RunCommand(std::string(tool) + " --version", folder);
    EXPECT_EQ(version.exit_status, 0);
    EXPECT_THAT(version.output, HasSubstr("mono3d 0."));
    const CommandResult devices = RunCommand(std::string(tool) + " --list-devices", folder);
    EXPECT_EQ(devices.exit_status, 0);
    EXPECT_THAT(devices.output, HasSubstr("0  "));
  }
}

}  // namespace
}  // namespace mono3d
