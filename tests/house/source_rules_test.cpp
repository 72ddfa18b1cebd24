// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include "house/source_files.h"

namespace mono3d::house {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

constexpr std::size_t kMaxLines = 400;  // of a file, by the house rules

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

TEST(House, KeepsItsFilesShort) {
  for (const SourceFile& file :
       ReadSourceFiles(MONO3D_SOURCE_DIR, {"examples", "libmono3d", "shaders", "tests", "tools"},
                       CodeExtensions())) {
    EXPECT_LE(file.lines.size(), kMaxLines) << file.path;
  }
}

TEST(House, LibraryNeitherPrintsNorExits) {
  const std::vector<SourceFile> files =
      ReadSourceFiles(MONO3D_SOURCE_DIR, {"libmono3d"}, {".h", ".cpp"});
  EXPECT_GT(files.size(), 50U) << "the tree was not read";
  for (const SourceFile& file : files) EXPECT_THAT(FindPrintingAndExiting(file), IsEmpty());
}

// The module of a file, and its path in the module's folder.
std::pair<std::string, std::string> SplitByModule(const std::string& path) {
  for (const std::string root : {"libmono3d/include/mono3d/", "libmono3d/src/", "shaders/"}) {
    if (!path.starts_with(root)) continue;
    const std::size_t end = path.find('/', root.size());
    if (end == std::string::npos) break;
    return {path.substr(root.size(), end - root.size()), path.substr(end + 1)};
  }
  return {};
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
    const auto [module, path_in_module] = SplitByModule(file.path);
    const bool is_private_header =
        path.extension() == ".h" && !file.path.starts_with("libmono3d/include/");
    if (is_private_header) continue;
    ++num_files;
    const std::string name = path.extension() == ".comp" ? path.stem().string() : path_in_module;
    ASSERT_NE(list_of(module), lists.end()) << "no file list for " << file.path;
    EXPECT_TRUE(Lists(*list_of(module), name)) << file.path << " is in no list";
  }
  EXPECT_GT(num_files, 40U) << "the tree was not read";
}

}  // namespace
}  // namespace mono3d::house
