// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Files for other programs at the end of a run, and of a run that is there.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <filesystem>
#include <map>
#include <new>
#include <string>
#include <vector>

#include "export/product_list.h"
#include "io/temporary_folder.h"
#include "mono3d/core/error.h"
#include "tools/command.h"

namespace mono3d {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class ProductsOfRun : public TemporaryFolderTest {
 protected:
  CommandResult Reconstruct(const std::string& products) const {
    const std::filesystem::path flight = MONO3D_EXAMPLE;
    return RunCommand(std::string(MONO3D_RECONSTRUCT_TOOL) + " " + flight.string() + " --camera " +
                          (flight / "camera.yaml").string() + " --camera-fixed -o " +
                          (folder_ / "out").string() +
                          " --resize 384x224 --tracking.features.num_features 600 --max-frames 36" +
                          " --products " + products,
                      folder_);
  }
  // The content of the files in products/, by name; of those that do not tell when they were made.
  std::map<std::string, std::string> Products() const {
    std::map<std::string, std::string> files;
    const std::filesystem::path folder = folder_ / "out/products";
    for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
      if (!entry.is_regular_file()) continue;
      const std::string name = entry.path().lexically_relative(folder);
      if (name.ends_with(".ply")) files[name] = TemporaryFolderTest::ReadText(entry.path());
    }
    return files;
  }
};

TEST_F(ProductsOfRun, AreThoseOfTheExportOfThatRun) {
  const CommandResult run = Reconstruct("las,ply,splats,nerfstudio");
  ASSERT_EQ(run.exit_status, 0) << run.errors;
  for (const char* name :
       {"model.las", "model_local.ply", "splats.ply", "nerfstudio/transforms.json"}) {
    EXPECT_GT(std::filesystem::file_size(folder_ / "out/products" / name), 1000U) << name;
  }
  const auto at_the_end = Products();
  std::filesystem::remove_all(folder_ / "out/products");
  const CommandResult later =
      RunCommand(std::string(MONO3D_EXPORT_TOOL) + " " + (folder_ / "out").string() +
                     " --products ply,splats,nerfstudio",
                 folder_);
  ASSERT_EQ(later.exit_status, 0) << later.errors;
  EXPECT_TRUE(Products() == at_the_end);
}

TEST_F(ProductsOfRun, OneThatIsNotKnownIsRefusedBeforeAnythingIsWritten) {
  const CommandResult run = Reconstruct("las,dxf");
  EXPECT_EQ(run.exit_status, kWrongUsage);
  EXPECT_THAT(run.errors, AllOf(HasSubstr("dxf"), HasSubstr("orthophoto")));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "out"));
}

TEST_F(ProductsOfRun, AreNotWrittenThroughLinks) {
  const std::filesystem::path elsewhere = folder_ / "elsewhere", products = folder_ / "products";
  std::filesystem::create_directories(elsewhere);
  std::filesystem::create_directories(products / "dense");
  std::filesystem::create_directory_symlink(elsewhere, products / "dense/images");
  EXPECT_THROW((void)tools::ProductFolderOf(folder_), Error);
  std::filesystem::remove(products / "dense/images");
  EXPECT_EQ(tools::ProductFolderOf(folder_), products);
  std::filesystem::create_directories(folder_ / "other");
  std::filesystem::create_directory_symlink(elsewhere, folder_ / "other/products");
  EXPECT_THROW((void)tools::ProductFolderOf(folder_ / "other"), Error);
}

// Whatever it fails by: what a library below throws, too.
TEST_F(ProductsOfRun, AreMadeWhereAnotherOneFails) {
  const tools::Product failing{"a", "", {}, [](const auto&, const auto&) {
                                 throw std::bad_alloc();
                                 return std::vector<std::filesystem::path>();
                               }};
  bool is_made = false;
  const tools::Product other{"b", "", {}, [&](const auto&, const auto&) {
                               is_made = true;
                               return std::vector<std::filesystem::path>();
                             }};
  const std::array products = {&failing, &other};
  testing::internal::CaptureStderr();
  EXPECT_EQ(tools::WriteProducts(products, {}, folder_ / "products"), 1);
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "a: not enough memory on this machine\n");
  EXPECT_TRUE(is_made);
}

}  // namespace
}  // namespace mono3d
