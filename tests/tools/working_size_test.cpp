// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Images that are larger than the size at which they are worked on.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <string>

#include "io/temporary_folder.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/colmap_model.h"
#include "tools/command.h"

namespace mono3d {
namespace {

using testing::HasSubstr;
using testing::Not;

class WorkingSizeOfRun : public TemporaryFolderTest {
 protected:
  CommandResult Reconstruct(const std::string& arguments) const {
    const std::filesystem::path flight = MONO3D_EXAMPLE;
    return RunCommand(std::string(MONO3D_RECONSTRUCT_TOOL) + " " + flight.string() + " --camera " +
                          (flight / "camera.yaml").string() + " --camera-fixed -o " +
                          (folder_ / "out").string() + " --tracking.features.num_features 600 " +
                          arguments,
                      folder_);
  }
};

// The images of the example have 768x448 pixels.
TEST_F(WorkingSizeOfRun, LimitsTheDepthMapsAndNotWhatIsSaidOfTheImages) {
  const CommandResult run = Reconstruct("--max-frames 36 --max-side 384");
  ASSERT_EQ(run.exit_status, 0) << run.errors;
  EXPECT_THAT(run.output, HasSubstr("images of 768x448 are worked on at 384 px"));
  const CameraModel of_depth = ReadCameraFile((folder_ / "out/depth/camera.yaml").string());
  EXPECT_EQ(of_depth.width, 384);
  EXPECT_EQ(of_depth.height, 224);
  const SparseModel sparse = ReadColmapModel(folder_ / "out/sparse");
  EXPECT_EQ(sparse.camera.width, 768);
  EXPECT_EQ(sparse.camera.height, 448);
  double right_px = 0;
  for (const SparseImage& image : sparse.images) {
    for (const SparseObservation& observation : image.observations) {
      right_px = std::max(right_px, observation.pixel.x());
    }
  }
  EXPECT_GT(right_px, 600);
}

TEST_F(WorkingSizeOfRun, LeavesSmallImagesAlone) {
  const CommandResult run = Reconstruct("--max-frames 36 --depth-files none");
  ASSERT_EQ(run.exit_status, 0) << run.errors;
  EXPECT_THAT(run.output, Not(HasSubstr("--max-side")));
  const auto options = nlohmann::json::parse(std::ifstream(folder_ / "out/run.json"))["options"];
  EXPECT_EQ(options["max_side"], "auto");
}

TEST_F(WorkingSizeOfRun, IsNoSizeThatNothingCanBeSeenAt) {
  const CommandResult run = Reconstruct("--max-side 20");
  EXPECT_EQ(run.exit_status, kWrongUsage);
  EXPECT_THAT(run.errors, HasSubstr("max-side"));
}

}  // namespace
}  // namespace mono3d
