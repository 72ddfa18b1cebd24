// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Whatever happens to a run, neither the result of an earlier one nor what it has made is lost.

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

#include "io/temporary_folder.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"
#include "tools/command.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const std::filesystem::path kFlight = MONO3D_EXAMPLE;

// No map starts with so many points.
const std::string kNoModel = " --video --max-frames 3 --tracking.initialisation.min_points 100000";

class KeptResults : public TemporaryFolderTest {
 protected:
  std::filesystem::path output() const { return folder_ / "out"; }

  // On images so small that a run takes a second.
  std::string Command(const std::string& extra) const {
    return std::string(MONO3D_RECONSTRUCT_TOOL) + " " + kFlight.string() + " --camera " +
           (kFlight / "camera.yaml").string() + " -o " + output().string() +
           " --resize 384x224 --tracking.features.num_features 600" + extra;
  }
  CommandResult Reconstruct(const std::string& extra) const {
    return RunCommand(Command(extra), folder_);
  }

  // What looks like an earlier run, and a file of the user's own.
  void MakeEarlierRun() const {
    for (const char* name : {"model.ply", "trajectory.txt", "run.json", "depth/000007.depth.pfm",
                             "sparse/images.txt", "model_map3.ply", "notes.txt"}) {
      TemporaryFolderTest::WriteText(std::string("out/") + name, "earlier");
    }
  }

  // The content of every file below the output folder, by its path there.
  std::map<std::string, std::string> Files() const {
    std::map<std::string, std::string> files;
    for (const auto& entry : std::filesystem::recursive_directory_iterator(output())) {
      if (!entry.is_regular_file()) continue;
      const std::string name = entry.path().lexically_relative(output());
      files[name] = TemporaryFolderTest::ReadText(entry.path());
    }
    return files;
  }

  // Runs the tool until it has written `file`, and sends it the signal then; how it ended.
  void SendWhenThere(const std::string& extra, const std::string& file, int signal,
                     int& status) const {
    const std::string command = "exec " + Command(extra) + " >/dev/null 2>&1";
    const pid_t process = fork();
    ASSERT_GE(process, 0);
    if (process == 0) {
      execl("/bin/sh", "sh", "-c", command.c_str(), static_cast<char*>(nullptr));
      _exit(127);
    }
    while (!std::filesystem::exists(output() / file)) {
      ASSERT_EQ(waitpid(process, &status, WNOHANG), 0) << "ended before it wrote " << file;
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
    }
    kill(process, signal);
    ASSERT_EQ(waitpid(process, &status, 0), process);
  }
};

TEST_F(KeptResults, AWrongStartLeavesTheEarlierResult) {
  MakeEarlierRun();
  const std::map<std::string, std::string> before = Files();
  const CommandResult result = Reconstruct(" --map /nonexistent.map");
  EXPECT_EQ(result.exit_status, kFailure);
  EXPECT_THAT(result.errors, HasSubstr("the earlier result in " + output().string() + " stays"));
  EXPECT_TRUE(Files() == before);
}

TEST_F(KeptResults, TheEmptyFolderOfAKilledRunIsUsedAgain) {
  MakeEarlierRun();
  std::filesystem::create_directories(output() / "unfinished_1/depth");
  EXPECT_EQ(Reconstruct(" --map /nonexistent.map").exit_status, kFailure);
  EXPECT_FALSE(std::filesystem::exists(output() / "unfinished_1"));
}

TEST_F(KeptResults, WhatAFailedRunHasMadeIsBesideTheEarlierResultAndNamed) {
  MakeEarlierRun();
  const std::map<std::string, std::string> before = Files();
  const CommandResult result = Reconstruct(kNoModel);
  EXPECT_EQ(result.exit_status, kFailure);
  EXPECT_THAT(result.errors, AllOf(HasSubstr("no model"), HasSubstr("out/unfinished_1")));
  for (const auto& [name, content] : before) EXPECT_TRUE(Files()[name] == content) << name;
  EXPECT_THAT(Files()["unfinished_1/run.json"], HasSubstr("\"end\": \"finished\""));
}

TEST_F(KeptResults, AWholeRunTakesThePlaceOfTheEarlierOne) {
  MakeEarlierRun();
  const CommandResult result = Reconstruct(" --max-frames 24");
  ASSERT_EQ(result.exit_status, 0) << result.errors;
  EXPECT_THAT(result.output, HasSubstr("model " + (output() / "model.ply").string()));
  std::map<std::string, std::string> files = Files();
  EXPECT_EQ(files["notes.txt"], "earlier");
  files.erase("notes.txt");
  for (const auto& [name, content] : files) {
    EXPECT_THAT(name, Not(HasSubstr("unfinished")));
    EXPECT_FALSE(content == "earlier") << name;
  }
  EXPECT_GT(ReadPly(output() / "model.ply").size(), 1000U);
  EXPECT_FALSE(files.contains("depth/000007.depth.pfm"));
  EXPECT_TRUE(files.contains("sparse/images.txt"));
}

TEST_F(KeptResults, TwoRunsDoNotWriteIntoOneFolder) {
  std::filesystem::create_directories(output());
  const int folder = open(output().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  ASSERT_EQ(flock(folder, LOCK_EX | LOCK_NB), 0);
  const CommandResult result = Reconstruct(kNoModel);
  EXPECT_EQ(result.exit_status, kFailure);
  EXPECT_THAT(result.errors, HasSubstr("another run is writing into this folder"));
  EXPECT_TRUE(std::filesystem::is_empty(output()));
  close(folder);
}

TEST_F(KeptResults, AMapThatCannotBeWrittenIsSaidBeforeTheFirstFrame) {
  const std::string missing = (folder_ / "missing" / "flight.map").string();
  const CommandResult result = Reconstruct(" --max-frames 24 --save-map " + missing);
  EXPECT_EQ(result.exit_status, kFailure);
  EXPECT_THAT(result.errors, HasSubstr(missing + ": cannot create the file"));
  EXPECT_FALSE(std::filesystem::exists(output()));
}

TEST_F(KeptResults, AMapThatCanNoLongerBeWrittenCostsNothingElse) {
  const std::filesystem::path maps = folder_ / "maps";
  std::filesystem::create_directories(maps);
  // The folder of the map is gone as soon as the run has begun.
  const CommandResult result = RunCommand(
      "( until [ -e " + (output() / "depth").string() + " ]; do sleep 0.01; done; rm -rf " +
          maps.string() + " ) & " + Command(" --max-frames 24 --mesh --save-map ") +
          (maps / "flight.map").string(),
      folder_);
  EXPECT_EQ(result.exit_status, kFailure);
  EXPECT_THAT(result.errors, HasSubstr("flight.map"));
  for (const char* name : {"model.ply", "mesh.ply", "trajectory.txt", "sparse/points3D.txt"}) {
    EXPECT_TRUE(std::filesystem::exists(output() / name)) << name;
  }
  const auto record = nlohmann::json::parse(std::ifstream(output() / "run.json"));
  EXPECT_EQ(record["end"], "failed");
  EXPECT_THAT(record["error"], HasSubstr("flight.map"));
}

TEST_F(KeptResults, AClosedTerminalEndsInOrder) {
  int status = 0;
  ASSERT_NO_FATAL_FAILURE(SendWhenThere(" --fps 1", "model.ply", SIGHUP, status));
  ASSERT_TRUE(WIFEXITED(status));
  EXPECT_GT(ReadPly(output() / "model.ply").size(), 1000U);
  const auto record = nlohmann::json::parse(std::ifstream(output() / "run.json"));
  EXPECT_EQ(record["end"], "stopped");
}

TEST_F(KeptResults, ARunThatIsKilledHasAModelAndATrajectory) {
  int status = 0;
  // A frame a second: interim results come every fifth.
  ASSERT_NO_FATAL_FAILURE(SendWhenThere(" --fps 1", "model.ply", SIGKILL, status));
  ASSERT_TRUE(WIFSIGNALED(status));
  EXPECT_GT(ReadPly(output() / "model.ply").size(), 1000U);
  EXPECT_GT(ReadTrajectory(output() / "trajectory.txt").size(), 10U);
  EXPECT_GT(ReadTrajectory(output() / "keyframes.txt").size(), 2U);
  // The killed run is not replaced by one that fails.
  const CommandResult next = Reconstruct(kNoModel);
  EXPECT_THAT(next.errors, HasSubstr("stays as it was"));
}

}  // namespace
}  // namespace mono3d
