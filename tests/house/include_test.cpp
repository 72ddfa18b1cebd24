// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iterator>
#include <set>
#include <sstream>

#include "house/include_cycles.h"
#include "house/include_rules.h"
#include "house/module_table.h"
#include "house/source_files.h"

namespace mono3d::house {
namespace {

using testing::ElementsAre;
using testing::EndsWith;
using testing::IsEmpty;

const ModuleTable& MadeUpTable() {
  static const ModuleTable table =
      ParseModuleTable("core:\nimage: core\ndepth: core image\nfusion: core image\n");
  return table;
}

TEST(ModuleTable, IsReadLineByLine) {
  EXPECT_EQ(MadeUpTable().size(), 4U);
  EXPECT_THAT(MadeUpTable().at("core"), IsEmpty());
  EXPECT_THAT(MadeUpTable().at("depth"), ElementsAre("core", "image"));
}

TEST(IncludeRules, AllowOwnModuleUsedModulesAndOutsideLibraries) {
  const SourceFile file = {
      "libmono3d/src/depth/census.cpp",
      {"#include <vector>", "#include <Eigen/Core>", "#include \"depth/census.h\"",
       "#include \"mono3d/image/frame.h\"", "#include \"depth/census.spirv.h\"",
       "#include \"common/params.h\"", "// #include \"fusion/not_code.h\""}};
  EXPECT_THAT(FindIncludeViolations(file, MadeUpTable()), IsEmpty());
}

TEST(IncludeRules, RefuseASiblingAndAModuleAbove) {
  const SourceFile sibling = {"libmono3d/src/depth/census.cpp",
                              {"#include \"depth/census.h\"", "#include \"fusion/index_map.h\""}};
  EXPECT_THAT(FindIncludeViolations(sibling, MadeUpTable()),
              ElementsAre("libmono3d/src/depth/census.cpp:2: \"fusion/index_map.h\": "
                          "depth may not use fusion"));
  const SourceFile above = {"libmono3d/include/mono3d/core/error.h",
                            {"#  include \"mono3d/image/frame.h\""}};
  EXPECT_THAT(FindIncludeViolations(above, MadeUpTable()),
              ElementsAre(EndsWith("core may not use image")));
  const SourceFile shader = {"shaders/fusion/splat.comp", {"#include \"depth/census.params.h\""}};
  EXPECT_THAT(FindIncludeViolations(shader, MadeUpTable()),
              ElementsAre(EndsWith("fusion may not use depth")));
}

TEST(IncludeRules, RefuseAPrivateHeaderInAPublicOne) {
  const SourceFile file = {"libmono3d/include/mono3d/depth/x.h", {"#include \"depth/census.h\""}};
  EXPECT_THAT(FindIncludeViolations(file, MadeUpTable()),
              ElementsAre(EndsWith("a public header includes a private one")));
}

TEST(IncludeRules, AllowTheUmbrellaHeaderAllPublicHeaders) {
  const SourceFile umbrella = {std::string(kUmbrellaHeader),
                               {"#include \"mono3d/depth/x.h\"", "#include \"mono3d/fusion/x.h\"",
                                "#include \"fusion/x.h\""}};
  EXPECT_THAT(FindIncludeViolations(umbrella, MadeUpTable()),
              ElementsAre(EndsWith("a public header includes a private one")));
}

TEST(IncludeRules, RefuseShortRelativeAndUnknownPaths) {
  const SourceFile file = {"libmono3d/src/depth/census.cpp",
                           {"#include \"census.h\"", "#include \"depth/../fusion/index_map.h\"",
                            "#include \"voxels/grid.h\"", "#include <mono3d/core/error.h>"}};
  EXPECT_THAT(FindIncludeViolations(file, MadeUpTable()),
              ElementsAre(EndsWith("not the full path of a header"),
                          EndsWith("not the full path of a header"),
                          EndsWith("there is no module voxels"), EndsWith("belongs in quotes")));
}

TEST(IncludeRules, RefuseAFileOfAModuleThatTheTableDoesNotKnow) {
  const SourceFile file = {"libmono3d/src/voxels/grid.cpp", {"#include \"mono3d/core/error.h\""}};
  EXPECT_THAT(FindIncludeViolations(file, MadeUpTable()),
              ElementsAre(EndsWith("voxels is not in the table of the modules")));
}

TEST(HiddenUses, AreOfPrivateHeadersWithASource) {
  const std::vector<SourceFile> files = {
      {"libmono3d/src/io/text.h", {}},
      {"libmono3d/src/io/text.cpp", {"#include \"io/text.h\""}},
      {"libmono3d/src/io/bytes.h", {}},
      {"libmono3d/src/pipeline/a.cpp", {"#include \"io/text.h\""}},
      {"libmono3d/src/products/a.cpp",
       {"#include \"mono3d/io/text.h\"", "#include \"io/bytes.h\"", "#include \"products/b.h\"",
        "#include \"io/text.h\""}},
      {"libmono3d/src/products/b.h", {}},
      {"libmono3d/src/products/b.cpp", {}}};
  EXPECT_THAT(FindHiddenUses(files, {"products"}),
              ElementsAre("libmono3d/src/products/a.cpp: \"io/text.h\""));
}

TEST(IncludeCycles, AreFoundOfTwoOfThreeAndThroughASource) {
  const std::vector<SourceFile> files = {
      {"libmono3d/src/depth/a.h", {"#include \"depth/b.h\""}},
      {"libmono3d/src/depth/b.h", {}},
      {"libmono3d/src/depth/b.cpp", {"#include \"depth/b.h\"", "#include \"depth/a.h\""}},
      {"tools/bench/x.h", {"#include \"bench/y.h\""}},
      {"tools/bench/y.h", {"#include \"bench/z.h\""}},
      {"tools/bench/z.h", {"#include \"bench/x.h\"", "#include \"mono3d/core/error.h\""}},
      {"libmono3d/src/depth/c.h", {"#include \"depth/a.h\"", "#include \"depth/b.h\""}}};
  EXPECT_THAT(FindIncludeCycles(files),
              ElementsAre("depth/a, depth/b", "tools/bench/x, tools/bench/y, tools/bench/z"));
}

TEST(IncludeCycles, AreNoneWhereAPublicHeaderIsImplementedByWhatIncludesIt) {
  const std::vector<SourceFile> files = {
      {"libmono3d/include/mono3d/depth/estimator.h", {}},
      {"libmono3d/src/depth/estimator.cpp",
       {"#include \"mono3d/depth/estimator.h\"", "#include \"depth/stage.h\""}},
      {"libmono3d/src/depth/stage.h", {"#include \"mono3d/depth/estimator.h\""}},
      {"libmono3d/src/depth/stage.cpp", {"#include \"depth/stage.h\""}}};
  EXPECT_THAT(FindIncludeCycles(files), IsEmpty());
}

TEST(House, KeepsItsStagesApart) {
  const ModuleTable table = ParseModuleTable(kModuleTable);
  for (const char* stage : {"tracking", "keyframes", "depth", "fusion"}) {
    ASSERT_TRUE(table.contains(stage)) << stage;
    for (const char* other : {"tracking", "keyframes", "depth", "fusion", "pipeline"}) {
      EXPECT_FALSE(table.at(stage).contains(other)) << stage << " uses " << other;
    }
  }
}

TEST(House, IncludesOnlyWhatItsTableAllows) {
  const ModuleTable table = ParseModuleTable(kModuleTable);
  const std::vector<SourceFile> files = ReadSourceFiles(MONO3D_SOURCE_DIR, {"libmono3d", "shaders"},
                                                        {".h", ".cpp", ".comp", ".glsl"});
  std::size_t num_lines = 0;
  for (const SourceFile& file : files) {
    num_lines += file.lines.size();
    for (const std::string& violation : FindIncludeViolations(file, table)) {
      ADD_FAILURE() << violation;
    }
  }
  EXPECT_GT(files.size(), 50U) << "the tree was not read";
  EXPECT_GT(num_lines, 1000U) << "the tree was not read";
}

// Else the shared library of the packages does not link with them.
TEST(House, UsesAcrossLibrariesWhatIsExported) {
  std::istringstream words{kModulesBeside};
  const std::set<std::string, std::less<>> beside{std::istream_iterator<std::string>(words), {}};
  EXPECT_TRUE(beside.contains("products"));
  EXPECT_THAT(
      FindHiddenUses(ReadSourceFiles(MONO3D_SOURCE_DIR, {"libmono3d"}, {".h", ".cpp"}), beside),
      IsEmpty());
}

// Between modules and inside them.
TEST(House, IncludesNothingInCircles) {
  const std::vector<SourceFile> files =
      ReadSourceFiles(MONO3D_SOURCE_DIR, {"libmono3d", "tools"}, {".h", ".cpp"});
  EXPECT_GT(files.size(), 300U) << "the tree was not read";
  EXPECT_THAT(FindIncludeCycles(files), IsEmpty());
}

}  // namespace
}  // namespace mono3d::house
