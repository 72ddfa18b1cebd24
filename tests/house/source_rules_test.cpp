// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <regex>
#include <string>
#include <vector>

#include "house/definitions.h"
#include "house/include_rules.h"
#include "house/source_files.h"

namespace mono3d::house {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

const std::vector<std::string>& CodeExtensions() {
  static const std::vector<std::string> extensions = {".h", ".cpp", ".comp", ".glsl"};
  return extensions;
}

bool HasLicenceLines(const SourceFile& file) {
  const auto is = [](const std::string& line, const std::string& text) {
    return line == "// " + text || line == "# " + text;
  };
  // A script's first line says what runs it.
  const std::size_t first = !file.lines.empty() && file.lines[0].starts_with("#!") ? 1 : 0;
  return file.lines.size() > first + 1 &&
         is(file.lines[first], "SPDX-License-Identifier: Apache-2.0") &&
         is(file.lines[first + 1], "Copyright the mono3d authors");
}

// "path:line: what" for each use of what a library must not do.
std::vector<std::string> FindPrintingAndExiting(const SourceFile& file) {
  static const std::regex kForbidden(
      R"(\bstd::(cout|cerr|clog|terminate|_Exit|quick_exit)\b|\b(stdout|stderr)\b|)"
      R"(\b(printf|puts|putchar|exit|_exit|abort)\s*\()");
  std::vector<std::string> found;
  const std::vector<std::string> code = CodeOnly(file.lines);
  for (std::size_t i = 0; i < code.size(); ++i) {
    std::smatch match;
    if (!std::regex_search(code[i], match, kForbidden)) continue;
    found.push_back(file.path + ":" + std::to_string(i + 1) + ": " + match.str());
  }
  return found;
}

// Is `file_name` one of the words of a CMake file list?
bool Lists(const SourceFile& cmake_file, const std::string& file_name) {
  return std::ranges::any_of(cmake_file.lines, [&](const std::string& line) {
    std::size_t at = line.find(file_name);
    for (; at != std::string::npos; at = line.find(file_name, at + 1)) {
      const std::size_t end = at + file_name.size();
      const bool begins = at == 0 || line[at - 1] == ' ' || line[at - 1] == '(';
      const bool ends = end == line.size() || line[end] == ' ' || line[end] == ')';
      if (begins && ends) return true;
    }
    return false;
  });
}

TEST(CodeOnly, BlanksCommentsAndLiterals) {
  EXPECT_THAT(
      CodeOnly({"a(\"exit(1)\"); // exit(1)", "b /* exit(1)", "exit(1) */ c('\"', 1'000);"}),
      ElementsAre("a(\"       \");           ", "b           ", "           c(' ', 1'000);"));
}

TEST(PrintingAndExiting, IsFoundInCodeAndOnlyThere) {
  EXPECT_THAT(FindPrintingAndExiting({"x.cpp",
                                      {"// exit(1) is not called", "std::snprintf(b, 4, \"x\");",
                                       "Log(\"exit(1)\");", "on_exit (f);"}}),
              IsEmpty());
  EXPECT_THAT(
      FindPrintingAndExiting({"x.cpp",
                              {"std::cout << 1;", "std::printf(\"x\");", "if (bad) exit(1);",
                               "fputs(s, stderr);", "std::abort ();"}}),
      ElementsAre("x.cpp:1: std::cout", "x.cpp:2: printf(", "x.cpp:3: exit(", "x.cpp:4: stderr",
                  "x.cpp:5: abort ("));
}

TEST(SplitClasses, AreThoseDefinedInTwoSourcesOfAModule) {
  const SourceFile one = {
      "libmono3d/src/depth/one.cpp",
      {"Map::Map() {}", "const Eigen::Vector3d& Map::Place() const {",
       "std::optional<Found> Finder::Find(int i) {",
       "bool Map::Key::operator==(const Key& other) const {", "  Other::Call();",
       "// Comment::Function()", "const Options kOptions = Options::Default();"}};
  EXPECT_THAT(ClassesDefinedIn(one), ElementsAre("Finder", "Map"));
  const SourceFile two = {"libmono3d/src/depth/two.cpp", {"Finder::~Finder() = default;"}};
  const SourceFile elsewhere = {"libmono3d/src/fusion/map.cpp", {"Map::Map() {}"}};
  EXPECT_THAT(FindSplitClasses({one, two, elsewhere}),
              ElementsAre("Finder: libmono3d/src/depth/one.cpp libmono3d/src/depth/two.cpp"));
}

TEST(UnnamedNames, AreTypesFunctionsAndVariables) {
  const SourceFile file = {
      "libmono3d/src/depth/one.cpp",
      {"int Public();", "namespace {", "using Eigen::Vector3d;", "using Cell = std::array<int, 3>;",
       "struct Range {", "  int low = 0;", "};", "constexpr std::array<int, 2> kSizes = {1, 2};",
       "std::function<void(int)> MakeTask(const Range& range) {", "  return {};", "}",
       "[[noreturn]] void ThrowIt(int i);", "template <typename T>", "T Twice(T value) {",
       "MATCHER_P(IsNear, value, \"\") {", "TEST(Range, IsEmpty) {", "}  // namespace",
       "int AlsoPublic() {"}};
  EXPECT_THAT(UnnamedNames(file),
              ElementsAre("Cell", "IsNear", "MakeTask", "Range", "ThrowIt", "Twice", "kSizes"));
}

TEST(SharedNames, AreThoseOfOneTarget) {
  const std::vector<std::string> lines = {"namespace {", "int Size() {", "}  // namespace"};
  EXPECT_THAT(
      FindSharedNames({{"libmono3d/src/depth/one.cpp", lines},
                       {"libmono3d/src/fusion/two.cpp", lines},
                       {"tests/depth/one_test.cpp", lines},
                       {"tests/reference/depth/one_reference.cpp", lines},
                       {"tools/a.cpp", lines},
                       {"tools/b.cpp", lines}}),
      ElementsAre("Size: tests/depth/one_test.cpp tests/reference/depth/one_reference.cpp"));
}

TEST(FileList, NamesWholeWords) {
  const SourceFile list = {"CMakeLists.txt", {"SOURCES sgm_cost.cpp pyramid.cpp)"}};
  EXPECT_TRUE(Lists(list, "pyramid.cpp"));
  EXPECT_FALSE(Lists(list, "cost.cpp"));
  EXPECT_FALSE(Lists(list, "pyramid.c"));
}

TEST(House, SourcesBeginWithTheLicenceLines) {
  std::vector<std::string> extensions = CodeExtensions();
  extensions.insert(extensions.end(), {".txt", ".cmake", ".sh", ".sed", ".in"});
  const std::vector<SourceFile> files =
      ReadSourceFiles(MONO3D_SOURCE_DIR,
                      {"CMakeLists.txt", ".clang-format", ".clang-tidy", ".ci/run", "docs/Doxyfile",
                       "cmake", "docs", "examples", "libmono3d", "shaders", "tests", "tools"},
                      extensions);
  EXPECT_GT(files.size(), 100U) << "the tree was not read";
  for (const SourceFile& file : files) {
    const bool is_data = file.path.ends_with(".txt") && !file.path.ends_with("CMakeLists.txt");
    EXPECT_TRUE(is_data || HasLicenceLines(file)) << file.path;
  }
}

// In place of a limit to the lines of a file, under which a large class is cut up and not divided.
TEST(House, DefinesEachClassInOneSource) {
  const std::vector<SourceFile> sources =
      ReadSourceFiles(MONO3D_SOURCE_DIR, {"libmono3d", "tests", "tools"}, {".cpp"});
  EXPECT_GT(sources.size(), 300U) << "the tree was not read";
  EXPECT_THAT(FindSplitClasses(sources), IsEmpty());
}

// So that a unity build is the same program.
TEST(House, SharesNoNamesBetweenUnnamedNamespaces) {
  std::vector<SourceFile> sources =
      ReadSourceFiles(MONO3D_SOURCE_DIR, {"libmono3d", "tests", "tools"}, {".cpp"});
  // Their tests are not compiled that way yet.
  std::erase_if(sources, [](const SourceFile& source) {
    static const std::regex kApart("tests/(reference/)?fusion/.*");
    return std::regex_match(source.path, kApart);
  });
  EXPECT_GT(sources.size(), 200U) << "the tree was not read";
  EXPECT_THAT(FindSharedNames(sources), IsEmpty());
}

TEST(House, LibraryNeitherPrintsNorExits) {
  const std::vector<SourceFile> files =
      ReadSourceFiles(MONO3D_SOURCE_DIR, {"libmono3d"}, {".h", ".cpp"});
  EXPECT_GT(files.size(), 50U) << "the tree was not read";
  for (const SourceFile& file : files) EXPECT_THAT(FindPrintingAndExiting(file), IsEmpty());
}

std::vector<SourceFile> PublicHeaders() {
  std::vector<SourceFile> headers =
      ReadSourceFiles(MONO3D_SOURCE_DIR, {"libmono3d/include/mono3d"}, {".h"});
  std::erase_if(headers, [](const SourceFile& header) { return header.path == kUmbrellaHeader; });
  return headers;
}

// What a public header declares outside such a namespace is missing in a shared library.
TEST(House, PublicHeadersExportWhatTheyDeclare) {
  EXPECT_GT(PublicHeaders().size(), 50U) << "the tree was not read";
  for (const SourceFile& header : PublicHeaders()) {
    for (const std::string& line : header.lines) {
      EXPECT_FALSE(line.starts_with("namespace mono3d")) << header.path;
    }
  }
}

// But for those of the libraries evaluation and products.
TEST(House, TheUmbrellaHeaderIncludesEachPublicOne) {
  const std::vector<SourceFile> umbrella =
      ReadSourceFiles(MONO3D_SOURCE_DIR, {std::string(kUmbrellaHeader)}, {".h"});
  ASSERT_EQ(umbrella.size(), 1U);
  for (const SourceFile& header : PublicHeaders()) {
    const std::string module = ModuleOf(header.path);
    if (module == "evaluation" || module == "products") continue;
    const std::string include =
        "#include \"" + header.path.substr(std::string("libmono3d/include/").size()) + "\"";
    EXPECT_NE(std::ranges::find(umbrella[0].lines, include), umbrella[0].lines.end()) << include;
  }
}

// A file that no list names is built by nobody and tested by nobody.
TEST(House, FileListsAreComplete) {
  std::vector<SourceFile> lists = ReadSourceFiles(MONO3D_SOURCE_DIR, {"libmono3d/src"}, {".txt"});
  const auto list_of = [&](const std::string& module) {
    return std::ranges::find(lists, "libmono3d/src/" + module + "/CMakeLists.txt",
                             &SourceFile::path);
  };
  std::size_t num_files = 0;
  for (const SourceFile& file :
       ReadSourceFiles(MONO3D_SOURCE_DIR, {"libmono3d/include/mono3d", "libmono3d/src", "shaders"},
                       {".h", ".cpp", ".comp"})) {
    const std::filesystem::path path = file.path;
    const std::string module = ModuleOf(file.path);
    const bool is_private_header =
        path.extension() == ".h" && !file.path.starts_with("libmono3d/include/");
    if (is_private_header || file.path == kUmbrellaHeader) continue;
    ++num_files;
    // With its folders below the module's: features/matching.cpp.
    const std::size_t begin = file.path.find("/" + module + "/") + module.size() + 2;
    std::string name = file.path.substr(begin);
    if (path.extension() == ".comp") name = name.substr(0, name.rfind('.'));
    ASSERT_NE(list_of(module), lists.end()) << "no file list for " << file.path;
    EXPECT_TRUE(Lists(*list_of(module), name)) << file.path << " is in no list";
  }
  EXPECT_GT(num_files, 40U) << "the tree was not read";
}

}  // namespace
}  // namespace mono3d::house
