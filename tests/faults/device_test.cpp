// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The device that is lost, is missing, or is one of several.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "faults/result_files.h"
#include "faults/small_reconstruction.h"
#include "io/temporary_folder.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"

namespace mono3d::faults {
namespace {

using testing::HasSubstr;

nlohmann::json RecordIn(const std::filesystem::path& folder) {
  return nlohmann::json::parse(std::ifstream(folder / "run.json"));
}

class DeviceOfRun : public TemporaryFolderTest {
 protected:
  // The description of lavapipe's driver, as the loader finds it.
  static std::filesystem::path Lavapipe() {
    for (const char* folder : {"/usr/share/vulkan/icd.d", "/etc/vulkan/icd.d"}) {
      std::error_code not_there;
      for (const auto& entry : std::filesystem::directory_iterator(folder, not_there)) {
        if (entry.path().filename().string().starts_with("lvp")) return entry.path();
      }
    }
    return {};
  }
};

// As on a GPU whose memory the host does not see: the model cannot be fetched from it any more.
TEST_F(DeviceOfRun, ALostDeviceCostsNoMoreThanTheLatestFewSeconds) {
  // A frame a second: interim results come at every fifth at the most, as the writer has time for
  // them. Each is submissions more, so these are counted in a run of one second, which has none.
  const SmallReconstruction short_run(folder_, {"--max-frames", "30"});
  const SmallReconstruction run(folder_, {"--max-frames", "30", "--fps", "1"});
  Environment environment = DeviceFaults("none:0");
  environment["MONO3D_FAULT_HIDES_MEMORY"] = "1";
  environment["MONO3D_FAULT_COUNTS"] = folder_ / "counts.txt";
  ASSERT_EQ(short_run.Run(environment).exit_status, 0);
  std::map<std::string, long> num_calls;
  std::ifstream file(folder_ / "counts.txt");
  std::string kind;
  for (long count = 0; file >> kind >> count;) num_calls[kind] = count;
  ASSERT_GT(num_calls["vkQueueSubmit"], 50);

  run.MakeEarlierRun();
  environment["MONO3D_FAULT"] =
      "vkQueueSubmit:" + std::to_string(num_calls["vkQueueSubmit"] * 9 / 10);
  const std::filesystem::path made = run.output() / "unfinished_1";
  bool had_model = false;  // a fast machine is at the end before
  const EndedRun ended = run.Run(environment, [&](pid_t) {
    had_model = had_model || std::filesystem::exists(made / "model.ply");
  });
  EXPECT_EQ(ended.exit_status, 1);
  EXPECT_THAT(ended.errors, HasSubstr("device lost"));
  EXPECT_EQ(run.ChangeOfEarlierRun(), "");
  EXPECT_EQ(FaultsOfFiles(made, RunState::kFailed), "");
  EXPECT_GT(ReadTrajectory(made / "trajectory.txt").size(), 10U);
  if (had_model) {
    EXPECT_GT(ReadPly(made / "model.ply").size(), 1000U);
  }
  EXPECT_THAT(RecordIn(made)["error"], HasSubstr("device lost"));

  const EndedRun resumed = run.Run({}, {}, {"--resume"});
  EXPECT_EQ(resumed.exit_status, 0) << resumed.errors;
  EXPECT_TRUE(run.IsEarlierRunGone());
  EXPECT_EQ(FaultsOfFiles(run.output(), RunState::kWhole), "");
  EXPECT_EQ(RecordIn(run.output())["counts"]["frames"], 30);
  EXPECT_EQ(RecordIn(run.output())["resumed_after_frames"].size(), 1U);
}

TEST_F(DeviceOfRun, WithoutADriverThePackageIsNamedAndNothingIsWritten) {
  const SmallReconstruction run(folder_, {});
  const EndedRun ended = run.Run({{"VK_DRIVER_FILES", "/nonexistent"}});
  EXPECT_EQ(ended.exit_status, 1);
  EXPECT_THAT(ended.errors, HasSubstr("mesa-vulkan-drivers"));
  EXPECT_FALSE(std::filesystem::exists(run.output()));
}

TEST_F(DeviceOfRun, OfTwoTheChoiceIsSaid) {
  if (Lavapipe().empty()) GTEST_SKIP() << "lavapipe is not installed";
  std::filesystem::copy_file(Lavapipe(), folder_ / "second.json");
  const Environment two = {
      {"VK_DRIVER_FILES", Lavapipe().string() + ":" + (folder_ / "second.json").string()}};
  // Three frames make no model.
  const EndedRun first = SmallReconstruction(folder_, {"--max-frames", "3"}).Run(two);
  EXPECT_THAT(first.output, HasSubstr("device 0 of 2: llvmpipe"));
  EXPECT_THAT(first.output, HasSubstr("--device"));
  const SmallReconstruction run(folder_, {"--max-frames", "3", "--device", "1"});
  const EndedRun second = run.Run(two);
  EXPECT_THAT(second.output, HasSubstr("device 1 of 2: llvmpipe"));
  const EndedRun only = run.Run({{"VK_DRIVER_FILES", Lavapipe()}});
  EXPECT_EQ(only.exit_status, 2);
  EXPECT_THAT(only.errors, HasSubstr("no such Vulkan device"));
}

}  // namespace
}  // namespace mono3d::faults
