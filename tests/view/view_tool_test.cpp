// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-view and mono3d-reconstruct --view as programs.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <thread>
#include <vector>

#include "io/temporary_folder.h"
#include "mono3d/io/colmap_model.h"
#include "mono3d/io/pfm_file.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"
#include "view/http_client.h"

namespace mono3d {
namespace {

namespace fs = std::filesystem;
using testing::StartsWith;

// A program that runs beside the test; it is told to stop at the end.
class BackgroundTool {
 public:
  BackgroundTool(std::vector<std::string> command, const fs::path& folder)
      : output_(folder / "output.txt") {
    std::vector<char*> arguments;
    for (std::string& word : command) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    process_ = fork();
    if (process_ != 0) return;
    const int file = open(output_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    dup2(file, 1);
    dup2(file, 2);
    execv(arguments[0], arguments.data());
    _exit(127);
  }
  ~BackgroundTool() { (void)Stop(); }
  BackgroundTool(const BackgroundTool&) = delete;
  BackgroundTool& operator=(const BackgroundTool&) = delete;

  // Exit status.
  int Stop() {
    if (process_ > 0) kill(process_, SIGINT);
    return Wait();
  }
  int Wait() {
    if (process_ <= 0) return -1;
    int status = 0;
    waitpid(process_, &status, 0);
    process_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

  // Of the page, once it is said; 0 where it is not.
  int WaitForPort() const {
    for (int i = 0; i < 1200; ++i) {
      const std::string text = Text();
      const std::size_t at = text.find("http://127.0.0.1:");
      if (at != std::string::npos && text.find('\n', at) != std::string::npos) {
        return std::stoi(text.substr(at + 17));
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    return 0;
  }
  std::string Text() const {
    std::ifstream file(output_, std::ios::binary);
    return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
  }

 private:
  fs::path output_;
  pid_t process_ = -1;
};

nlohmann::json ChangesAt(int port) {
  return nlohmann::json::parse(Get(port, "/changes?since=0").body, nullptr, false);
}

class ViewTool : public TemporaryFolderTest {
 protected:
  // Two keyframes of an input of three images, one of them with a depth map.
  void WriteRun() const {
    PointCloud cloud;
    for (int i = 0; i < 300; ++i) {
      cloud.points.emplace_back(static_cast<float>(i % 20), static_cast<float>(i / 20), 5.0F);
      cloud.normals.emplace_back(0, 0, -1);
      cloud.radii.push_back(0.7F);
      cloud.first_frames.push_back(i < 100 ? 12 : 90);
    }
    fs::create_directories(run_ / "depth");
    fs::create_directories(folder_ / "flight");
    WritePly(run_ / "model.ply", cloud);
    for (const char* name : {"a.png", "b.png", "c.png"}) {
      cv::imwrite((folder_ / "flight" / name).string(),
                  cv::Mat(48, 64, CV_8UC3, cv::Scalar(20, 40, 60)));
    }
    WritePfm(run_ / "depth" / "000002.depth.pfm", cv::Mat(48, 64, CV_32FC1, cv::Scalar(5)));
    SparseModel sparse;
    sparse.camera.width = 64;
    sparse.camera.height = 48;
    sparse.camera.fx = sparse.camera.fy = 60;
    sparse.images.resize(2);
    sparse.images[0].name = "a.png";
    sparse.images[1].id = 2;
    sparse.images[1].name = "c.png";
    WriteColmapModel(run_ / "sparse", sparse);
    WriteTrajectory(run_ / "trajectory.txt", {{0, Pose()}, {1, Pose()}, {2, Pose()}});
    WriteText("run/run.json", R"({"input": ")" + (folder_ / "flight").string() +
                                  R"(", "counts": {"frames": 3, "tracked": 3},
                                         "maps": [{"axes": {"of": "earth"},
                                                   "georeference": {"scale_sigma": 0.01,
                                                     "heading_sigma_deg": 0.5,
                                                     "position_sigma_m": {"east": 3, "north": 4}},
                                                   "model_frames": {"first": 12, "first_s": 0.5,
                                                                    "last": 90, "last_s": 3}}]})");
    // The second one is not whole.
    WriteText("run/next_views.json", R"({"surface_su2": 50, "views": [
        {"position": [1, 2, 3], "target": [4, 5, 6], "rotation_xyzw": [0, 0, 0, 2],
         "explanation": "thin", "gain_su2": 5},
        {"position": [1, 2], "target": "there", "explanation": 7}]})");
  }

  fs::path run_ = folder_ / "run";
};

TEST_F(ViewTool, ShowsAFinishedRun) {
  WriteRun();
  BackgroundTool tool({MONO3D_VIEW_TOOL, run_.string()}, folder_);
  const int port = tool.WaitForPort();
  ASSERT_NE(port, 0) << tool.Text();
  EXPECT_THAT(Get(port, "/").body, testing::HasSubstr("<script type=\"module\" src=\"main.js\">"));
  for (const char* file :
       {"main.js", "surfels.js", "controls.js", "flight.js", "measure.js", "next_views.js"}) {
    EXPECT_THAT(Get(port, std::string("/") + file).body, StartsWith("// SPDX")) << file;
  }
  const nlohmann::json changes = ChangesAt(port);
  ASSERT_EQ(changes["blocks"].size(), 1U);
  EXPECT_EQ(changes["blocks"][0]["surfels"], 300);
  EXPECT_EQ(changes["blocks"][0]["frames"], nlohmann::json({12, 90}));
  EXPECT_EQ(changes["times"]["frames"], nlohmann::json({12, 90}));
  EXPECT_EQ(changes["times"]["seconds"], nlohmann::json({0.5, 3.0}));
  EXPECT_EQ(changes["keyframes"].size(), 2U);
  EXPECT_EQ(changes["path"].size(), 3U);
  EXPECT_EQ(changes["camera"]["width"], 64);
  EXPECT_EQ(changes["status"]["counts"]["tracked"], 3);
  EXPECT_EQ(changes["status"]["earth"], nlohmann::json({{"metres_per_unit", 1},
                                                        {"scale_sigma", 0.01},
                                                        {"heading_sigma_deg", 0.5},
                                                        {"position_sigma_m", 5.0}}));
  // Axes of the earth have z up, wherever the one camera has its top.
  EXPECT_EQ(changes["up"], nlohmann::json({0.0, 0.0, 1.0}));
  ASSERT_EQ(changes["next_views"].size(), 1U);
  EXPECT_EQ(changes["next_views"][0]["reason"], "thin");
  EXPECT_EQ(changes["next_views"][0]["target"], nlohmann::json({4.0, 5.0, 6.0}));
  EXPECT_EQ(changes["next_views"][0]["gain_share"], 0.1);
  EXPECT_EQ(Get(port, "/surfels?levels=0,0,9").body.size(), 48U + 9 * 16);
  // Two blocks, the second of which is not there, and more of the first one.
  EXPECT_EQ(Get(port, "/surfels?levels=0,0,9,77,0,5,0,298,9").body.size(), 3U * 48 + 11 * 16);
  for (const char* levels : {"", "?levels=", "?levels=0,0", "?levels=0,0,x", "?levels=0,0,9,"}) {
    EXPECT_EQ(Get(port, std::string("/surfels") + levels).status, 404) << levels;
  }
  constexpr const char* kJpeg = "\xff\xd8";
  EXPECT_THAT(Get(port, "/keyframe_image?id=0").body, StartsWith(kJpeg));
  EXPECT_THAT(Get(port, "/keyframe_image?id=1").body, StartsWith(kJpeg));
  EXPECT_THAT(Get(port, "/keyframe_depth?id=1").body, StartsWith(kJpeg));
  EXPECT_EQ(Get(port, "/keyframe_depth?id=0").status, 404) << "it has none";
  EXPECT_EQ(Get(port, "/keyframe_image?id=2").status, 404);
  EXPECT_EQ(tool.Stop(), 0);
}

TEST_F(ViewTool, SaysThatThereIsNoRun) {
  BackgroundTool tool({MONO3D_VIEW_TOOL, (folder_ / "absent").string()}, folder_);
  EXPECT_EQ(tool.Wait(), 1);
  EXPECT_THAT(tool.Text(), testing::HasSubstr("there is no run with a model"));
}

TEST_F(ViewTool, ShowsARunAsItGoesOn) {
  BackgroundTool tool(
      {MONO3D_RECONSTRUCT_TOOL, MONO3D_EXAMPLE, "--camera", MONO3D_EXAMPLE "/camera.yaml",
       "--camera-fixed", "--view", "-o", (folder_ / "out").string()},
      folder_);
  const int port = tool.WaitForPort();
  ASSERT_NE(port, 0) << tool.Text();
  bool has_grown = false;
  nlohmann::json changes;
  for (int i = 0; i < 1200 && !has_grown; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
    changes = ChangesAt(port);
    if (changes.is_discarded()) break;  // it has ended
    has_grown = changes["blocks"].size() >= 2 && changes.contains("picture_depth");
  }
  EXPECT_TRUE(has_grown) << tool.Text();
  EXPECT_EQ(changes["status"]["phase"], "running");
  EXPECT_GT(changes["keyframes"].size(), 4U);
  EXPECT_THAT(Get(port, "/depth").body, StartsWith("\xff\xd8"));
  EXPECT_EQ(tool.Stop(), 0) << tool.Text();
}

}  // namespace
}  // namespace mono3d
