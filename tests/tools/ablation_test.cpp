// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// The ablation of the depth stage, on a small simulated sequence.

#include "bench/ablation.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <set>

#include "bench/true_bundles.h"
#include "mono3d/core/error.h"
#include "mono3d/evaluation/depth_error.h"
#include "tools/command.h"

namespace mono3d::tools {
namespace {

using testing::HasSubstr;

std::vector<OptionRef> ValuesOf(DepthEstimatorOptions& options) {
  std::vector<OptionRef> values;
  for (const OptionField& field : ListOptions(options)) values.push_back(field.value);
  return values;
}

bool AreEqual(DepthEstimatorOptions a, DepthEstimatorOptions b) {
  const std::vector<OptionRef> values_a = ValuesOf(a);
  const std::vector<OptionRef> values_b = ValuesOf(b);
  for (std::size_t i = 0; i < values_a.size(); ++i) {
    const bool equal = std::visit(
        [](const auto* x, const auto* y) {
          if constexpr (std::is_same_v<decltype(x), decltype(y)>) return *x == *y;
          return false;
        },
        values_a[i], values_b[i]);
    if (!equal) return false;
  }
  return true;
}

TEST(AblationVariants, AreValidAndNoTwoAreAlike) {
  const std::vector<AblationVariant> variants = AblationVariants({});
  EXPECT_TRUE(AreEqual(variants.front().depth, {}));
  for (std::size_t i = 0; i < variants.size(); ++i) {
    EXPECT_NO_THROW(variants[i].depth.Validate()) << variants[i].name;
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_TRUE(variants[i].num_images != variants[j].num_images ||
                  !AreEqual(variants[i].depth, variants[j].depth))
          << variants[i].name;
      EXPECT_NE(variants[i].name, variants[j].name);
    }
  }
}

TEST(AblationFigures, OfManyMapsAreTheMeanOverThoseThatThereAre) {
  AblationFigures good, other, rejected;
  good = {.num_maps = 1, .num_bundles = 1, .l1_rel = 0.02, .density = 0.9, .cpu_ms = 300};
  other = {.num_maps = 1, .num_bundles = 1, .l1_rel = 0.04, .density = 0.6, .cpu_ms = 600};
  rejected.num_bundles = 1;
  const AblationFigures mean = MeanFigures({good, other, rejected});
  EXPECT_EQ(mean.num_maps, 2);
  EXPECT_EQ(mean.num_bundles, 3);
  EXPECT_DOUBLE_EQ(mean.l1_rel, 0.03);
  EXPECT_DOUBLE_EQ(mean.density, 0.5);
  EXPECT_EQ(MeanFigures({}).num_maps, 0);
}

// Twelve small images with true depth, filmed once for all tests.
class Ablation : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    std::filesystem::remove_all(folder());
    const CommandResult result = RunCommand(std::string(MONO3D_SIMULATE_TOOL) +
                                                " --camera.width 192 --camera.height 128 --fps 0.5 "
                                                "--max-frames 12 --depth-stride 1 -o " +
                                                folder().string(),
                                            std::filesystem::path(testing::TempDir()));
    ASSERT_EQ(result.exit_status, 0) << result.errors;
  }
  static void TearDownTestSuite() { std::filesystem::remove_all(folder()); }
  static std::filesystem::path folder() {
    return std::filesystem::path(testing::TempDir()) / "mono3d_ablation";
  }
};

TEST_F(Ablation, BundlesLieAStepApartAroundATrueDepth) {
  const std::vector<TrueBundle> bundles = ReadTrueBundles(folder().string(), 2, 2);
  ASSERT_EQ(bundles.size(), 2U);
  for (const TrueBundle& bundle : bundles) {
    const auto& keyframes = bundle.bundle.keyframes;
    ASSERT_EQ(keyframes.size(), kBundleSize);
    EXPECT_EQ(keyframes[1].id - keyframes[0].id, 2);
    EXPECT_EQ(keyframes[2].frame.bgr.size(), bundle.true_depth.size());
    EXPECT_FALSE(keyframes[2].sparse_depths_su.empty());
  }
  EXPECT_NE(bundles[0].bundle.reference().id, bundles[1].bundle.reference().id);
  EXPECT_THROW((void)ReadTrueBundles(folder().string(), 2, 3), Error);  // needs 13 images
}

TEST_F(Ablation, SetsVariantsBesideTheDefault) {
  const AblationOptions options{.folders = {folder().string()},
                                .num_bundles = 1,
                                .step = 2,
                                .only = {"no median", "2 matching images, not 4"},
                                .depth = {}};
  const AblationResult result = RunAblation(options, {});
  ASSERT_EQ(result.rows.size(), 3U);
  for (const AblationRow& row : result.rows) {
    EXPECT_EQ(row.mean.num_maps, 1);
    EXPECT_GT(row.mean.l1_rel, 0);
    EXPECT_LT(row.mean.l1_rel, 0.05);
    EXPECT_GT(row.mean.density, 0.5);
    EXPECT_GT(row.mean.slanted_l1_rel, 0);
    EXPECT_GE(row.mean.removed_oracle, row.mean.removed);
  }
  EXPECT_NE(result.rows[0].mean.l1_rel, result.rows[1].mean.l1_rel);
  EXPECT_NE(result.rows[0].mean.l1_rel, result.rows[2].mean.l1_rel);
  const std::vector<Table> tables = ToTables(result);
  ASSERT_EQ(tables.size(), 2U);
  for (const Table& table : tables) {
    ASSERT_EQ(table.rows.size(), 3U);
    EXPECT_EQ(table.rows[1][0], "no median");
    EXPECT_EQ(table.rows[1].size(), table.columns.size());
  }
  EXPECT_EQ(ToJson(result)["variants"][1]["mean"]["maps"], 1);
}

TEST_F(Ablation, NamesWhatThereIsNot) {
  AblationOptions options{
      .folders = {folder().string()}, .num_bundles = 1, .step = 2, .only = {"x"}, .depth = {}};
  EXPECT_THROW((void)RunAblation(options, {}), UsageError);
  options.only = {};
  options.folders = {MONO3D_EXAMPLE};
  try {
    (void)RunAblation(options, {});
    FAIL() << "the shipped sequence has no true depth";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("no true depth"));
  }
}

}  // namespace
}  // namespace mono3d::tools
