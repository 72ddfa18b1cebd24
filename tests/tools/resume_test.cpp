// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// A run that was broken off goes on from its journal, and comes to what it would have come to.

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/videoio.hpp>
#include <string>
#include <thread>
#include <vector>

#include "io/temporary_folder.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/ply_file.h"
#include "tools/command.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

const std::filesystem::path kOrbit = MONO3D_EXAMPLE;

class Resume : public TemporaryFolderTest {
 protected:
  // On small images; a frame a second, so that every fifth one the state is saved. Of the camera
  // of the flight, which is held: nothing is calibrated.
  std::string Command(const std::string& output, const std::string& extra = "") const {
    return std::string(MONO3D_RECONSTRUCT_TOOL) + " " + input_.string() + " --camera " +
           (kOrbit / "camera.yaml").string() + " --camera-fixed -o " + (folder_ / output).string() +
           (extra.find("--fps") == std::string::npos ? " --fps 1" : "") +
           " --resize 384x224 --tracking.features.num_features 600" +
           (extra.find("--max-frames") == std::string::npos ? " --max-frames 40" : "") + extra;
  }
  // Each image of the flight `times` times, as a camera of so many times the rate would see a
  // flight by jerks.
  void Repeat(int times) {
    input_ = folder_ / "repeated";
    std::filesystem::create_directories(input_);
    int number = 1000;
    for (const std::string& image : ListImages(kOrbit.string())) {
      for (int i = 0; i < times; ++i) {
        std::filesystem::create_symlink(image, input_ / (std::to_string(number++) + ".jpg"));
      }
    }
  }
  CommandResult Reconstruct(const std::string& output, const std::string& extra = "") const {
    return RunCommand(Command(output, extra), folder_);
  }

  std::ptrdiff_t NumDepthMaps() const {
    const std::filesystem::path depth = folder_ / "out/depth";
    if (!std::filesystem::exists(depth)) return 0;
    return std::ranges::count_if(std::filesystem::directory_iterator(depth),
                                 [](const std::filesystem::path& file) {
                                   return file.filename().string().ends_with(".depth.pfm");
                                 });
  }

  // The tool as it runs until there are so many depth maps and, where it is killed, a saved state;
  // it gets the signal then. A state is there when the disk has it: on a slow one that may be after
  // the last frame. A run that is only asked to stop saves one itself.
  void Break(const std::string& extra, std::ptrdiff_t num_depth_maps, int signal) const {
    const std::string command = "exec " + Command("out", extra) + " >/dev/null 2>&1";
    const pid_t process = fork();
    ASSERT_GE(process, 0);
    if (process == 0) {
      execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
      _exit(127);
    }
    int status = 0;
    const std::filesystem::path out = folder_ / "out";
    const auto may_go_on = [&] {
      return signal != SIGKILL || std::filesystem::exists(out / "journal/manifest");
    };
    while (!may_go_on() || NumDepthMaps() < num_depth_maps) {
      ASSERT_EQ(waitpid(process, &status, WNOHANG), 0)
          << "ended before it wrote " << num_depth_maps << " depth maps";
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
    kill(process, signal);
    ASSERT_EQ(waitpid(process, &status, 0), process);
    ASSERT_TRUE(signal != SIGKILL || WIFSIGNALED(status));
  }

  // The files of a run but those that tell when it was.
  std::map<std::string, std::string> Results(const std::string& output) const {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder_ / output)) {
      if (!entry.is_regular_file()) continue;
      const std::string name = entry.path().lexically_relative(folder_ / output);
      if (name == "run.json" || name == "report.html") continue;
      files[name] = TemporaryFolderTest::ReadText(entry.path());
    }
    return files;
  }
  std::filesystem::path input_ = kOrbit;

  nlohmann::json Record(const std::string& output) const {
    return nlohmann::json::parse(std::ifstream(folder_ / output / "run.json"));
  }

  void ExpectSameResults() const {
    const auto whole = Results("whole");
    const auto resumed = Results("out");
    for (const auto& [name, content] : whole) {
      ASSERT_TRUE(resumed.contains(name)) << name;
      EXPECT_TRUE(resumed.at(name) == content) << name << " differs";
    }
    for (const auto& [name, content] : resumed) EXPECT_TRUE(whole.contains(name)) << name;
    const nlohmann::json record = Record("out");
    EXPECT_EQ(record["end"], "finished");
    EXPECT_EQ(record["counts"], Record("whole")["counts"]);
  }
};

TEST_F(Resume, AKilledRunComesToTheResultOfOneThatWasNot) {
  ASSERT_EQ(Reconstruct("whole").exit_status, 0);
  ASSERT_NO_FATAL_FAILURE(Break("", 2, SIGKILL));
  ASSERT_NO_FATAL_FAILURE(Break(" --resume", 4, SIGKILL));
  const CommandResult resumed = Reconstruct("out", " --resume");
  ASSERT_EQ(resumed.exit_status, 0) << resumed.errors;
  EXPECT_THAT(resumed.output, HasSubstr("resumed after frame"));
  ExpectSameResults();
  EXPECT_EQ(Record("out")["resumed_after_frames"].size(), 2U);
}

// Of the whole flight, so that there is much left to do when the signal comes.
TEST_F(Resume, ARunThatWasStoppedGoesOnWithTheNextFrame) {
  const std::string whole_flight = " --max-frames 76";
  ASSERT_EQ(Reconstruct("whole", whole_flight).exit_status, 0);
  ASSERT_NO_FATAL_FAILURE(Break(whole_flight, 1, SIGINT));
  const nlohmann::json stopped = Record("out");
  EXPECT_EQ(stopped["end"], "stopped");
  const CommandResult resumed = Reconstruct("out", whole_flight + " --resume");
  ASSERT_EQ(resumed.exit_status, 0) << resumed.errors;
  ExpectSameResults();
  EXPECT_THAT(Record("out")["resumed_after_frames"],
              ElementsAre(stopped["counts"]["frames"].get<int>() - 1));
}

// The model of what there is; the run itself is as it was.
TEST_F(Resume, ARunThatWasKilledIsFinishedAndStillGoesOn) {
  ASSERT_EQ(Reconstruct("whole").exit_status, 0);
  ASSERT_NO_FATAL_FAILURE(Break("", 2, SIGKILL));
  std::filesystem::remove(folder_ / "out/model.ply");
  const CommandResult finished = Reconstruct("out", " --resume --finish");
  ASSERT_EQ(finished.exit_status, 0) << finished.errors;
  const nlohmann::json record = Record("out");
  EXPECT_EQ(record["end"], "stopped");
  EXPECT_LT(record["counts"]["frames"], 40);
  EXPECT_GT(ReadPly((folder_ / "out/model.ply").string()).size(), 1000U);
  const CommandResult resumed = Reconstruct("out", " --resume");
  ASSERT_EQ(resumed.exit_status, 0) << resumed.errors;
  ExpectSameResults();
}

TEST_F(Resume, WhereNothingWasBrokenOffThereIsNothingToFinish) {
  const CommandResult finished = Reconstruct("out", " --resume --finish");
  EXPECT_NE(finished.exit_status, 0);
  EXPECT_THAT(finished.errors, HasSubstr("there is no run to finish"));
  EXPECT_EQ(Reconstruct("out", " --finish").exit_status, kWrongUsage);
}

// The images of its keyframes are written as it is read, before the run is broken off and after.
TEST_F(Resume, AVideoComesToTheResultAndTheImagesOfOneThatWasNot) {
  input_ = folder_ / "flight.avi";
  {
    const std::vector<std::string> images = ListImages(kOrbit.string());
    const cv::Size size = cv::imread(images.at(0)).size();
    cv::VideoWriter writer(input_.string(), cv::CAP_OPENCV_MJPEG,
                           cv::VideoWriter::fourcc('M', 'J', 'P', 'G'), 20, size);
    for (std::size_t i = 0; i < 40; ++i) writer.write(cv::imread(images.at(i)));
  }
  ASSERT_EQ(Reconstruct("whole").exit_status, 0);
  ASSERT_GT(Results("whole").count("images/000000.jpg"), 0U);
  ASSERT_NO_FATAL_FAILURE(Break("", 2, SIGKILL));
  EXPECT_FALSE(ListImages((folder_ / "out/images").string()).empty()) << "written early";
  const CommandResult resumed = Reconstruct("out", " --resume");
  ASSERT_EQ(resumed.exit_status, 0) << resumed.errors;
  ExpectSameResults();
}

TEST_F(Resume, ImagesThatAreChosenByMotionAreTheSameAgain) {
  Repeat(3);
  const std::string by_motion = " --fps 3 --stride auto";
  const CommandResult whole = Reconstruct("whole", by_motion);
  ASSERT_EQ(whole.exit_status, 0) << whole.errors;
  EXPECT_THAT(whole.output, HasSubstr("images taken 40, left out with next to no motion 78"));
  EXPECT_EQ(Record("whole")["options"]["stride"], "auto");
  EXPECT_EQ(Record("whole")["counts"]["images_passed_over"], 78);
  // The last frame taken is number 3 * 39.
  ASSERT_NO_FATAL_FAILURE(Break(by_motion, 2, SIGKILL));
  const CommandResult resumed = Reconstruct("out", by_motion + " --resume");
  ASSERT_EQ(resumed.exit_status, 0) << resumed.errors;
  ExpectSameResults();
  // What is left out is missed by nobody: the model is that of a camera of a third of the rate.
  input_ = kOrbit;
  ASSERT_EQ(Reconstruct("plain").exit_status, 0);
  const PointCloud of_plain = ReadPly(folder_ / "plain" / "model.ply");
  PointCloud of_whole = ReadPly(folder_ / "whole" / "model.ply");
  // But for the numbers of the frames, each of which is there three times.
  for (std::uint32_t& frame : of_whole.first_frames) {
    EXPECT_EQ(frame % 3, 0U);
    frame /= 3;
  }
  EXPECT_EQ(of_plain.first_frames, of_whole.first_frames);
  WritePly(folder_ / "renumbered.ply", of_whole);
  EXPECT_TRUE(Results("plain").at("model.ply") ==
              TemporaryFolderTest::ReadText(folder_ / "renumbered.ply"));
  EXPECT_EQ(Results("plain").at("trajectory.txt"), Results("whole").at("trajectory.txt"));
}

TEST_F(Resume, RefusesOtherOptionsAndADamagedJournal) {
  ASSERT_NO_FATAL_FAILURE(Break("", 2, SIGKILL));
  const auto before = Results("out");
  const CommandResult other = Reconstruct("out", " --resume --fusion.max_surfels 100000");
  EXPECT_EQ(other.exit_status, kWrongUsage) << other.errors;
  EXPECT_THAT(other.errors,
              AllOf(HasSubstr("had another --fusion.max_surfels"), HasSubstr("100000")));
  EXPECT_TRUE(Results("out") == before);
  TemporaryFolderTest::WriteText("out/journal/manifest", "no manifest");
  const CommandResult damaged = Reconstruct("out", " --resume");
  EXPECT_EQ(damaged.exit_status, kFailure);
  EXPECT_THAT(damaged.errors, HasSubstr("manifest"));
}

// An image more, others under the same names, one that is gone: all that was read is the same.
TEST_F(Resume, RefusesImagesThatHaveChanged) {
  const std::filesystem::path images = folder_ / "images";
  std::filesystem::copy(kOrbit / "images", images);
  input_ = images;
  ASSERT_NO_FATAL_FAILURE(Break("", 2, SIGKILL));
  const auto before = Results("out");
  const auto expect_refusal = [&](const char* what) {
    const CommandResult result = Reconstruct("out", " --resume");
    EXPECT_EQ(result.exit_status, kFailure) << what;
    EXPECT_THAT(result.errors, HasSubstr("the images have changed")) << what;
    EXPECT_TRUE(Results("out") == before) << what;
  };
  std::filesystem::copy(images / "000030.jpg", images / "000002a.jpg");
  expect_refusal("one more");
  std::filesystem::remove(images / "000002a.jpg");
  std::filesystem::rename(images / "000003.jpg", images / "000002b.jpg");
  expect_refusal("another name");
  std::filesystem::rename(images / "000002b.jpg", images / "000003.jpg");
  std::filesystem::copy(kOrbit / "images/000004.jpg", images / "000003.jpg",
                        std::filesystem::copy_options::overwrite_existing);
  expect_refusal("another one");
  std::filesystem::copy(kOrbit / "images/000003.jpg", images / "000003.jpg",
                        std::filesystem::copy_options::overwrite_existing);
  EXPECT_EQ(Reconstruct("out", " --resume").exit_status, 0);
}

TEST_F(Resume, WithoutAJournalTheRunStartsFromItsBeginning) {
  const CommandResult result = Reconstruct("out", " --resume --max-frames 20");
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("nothing to resume"));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out/journal"));
  EXPECT_FALSE(Record("out").contains("resumed_after_frames"));
}

}  // namespace
}  // namespace mono3d
