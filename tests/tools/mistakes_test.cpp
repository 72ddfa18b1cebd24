// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// What people do wrong, and what the tools answer: docs/messages.md is the list of it.

#include "tools/mistakes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "tools/command.h"

namespace mono3d {
namespace {

using testing::HasSubstr;

std::string PathOfTool(const std::string& name) {
  static const std::map<std::string, std::string> paths = {{"reconstruct", MONO3D_RECONSTRUCT_TOOL},
                                                           {"depth", MONO3D_DEPTH_TOOL},
                                                           {"calibrate", MONO3D_CALIBRATE_TOOL},
                                                           {"evaluate", MONO3D_EVALUATE_TOOL},
                                                           {"render", MONO3D_RENDER_TOOL},
                                                           {"simulate", MONO3D_SIMULATE_TOOL},
                                                           {"view", MONO3D_VIEW_TOOL}};
  return paths.at(name);
}

// The bytes of all files below `folder`.
std::map<std::string, std::string> FilesIn(const std::filesystem::path& folder) {
  std::map<std::string, std::string> files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) files[entry.path().string()] = ReadText(entry.path());
  }
  return files;
}

std::string InTable(std::string text) {
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) {
    text.insert(at, "\\");
  }
  return text;
}

// A line of docs/messages.md.
std::string Row(const Mistake& mistake, const std::string& message) {
  return "| " + mistake.what + " | `mono3d-" + InTable(mistake.command) + "` | " +
         InTable(message) + " |\n";
}

class MistakesOfUsers : public testing::Test {
 protected:
  MistakesOfUsers() {
    std::filesystem::remove_all(root_);
    std::filesystem::create_directories(files());
    WriteFilesOfMistakes(files());
  }
  ~MistakesOfUsers() override { std::filesystem::remove_all(root_); }

  std::filesystem::path files() const { return root_ / "files"; }

  CommandResult Run(const Mistake& mistake) const {
    const std::size_t blank = std::min(mistake.command.find(' '), mistake.command.size());
    return RunCommand("cd " + files().string() + " && timeout 60 " +
                          PathOfTool(mistake.command.substr(0, blank)) +
                          mistake.command.substr(blank),
                      root_);
  }

  std::filesystem::path root_ =
      std::filesystem::path(testing::TempDir()) / ("mono3d_mistakes_" + std::to_string(getpid()));
};

// The one error, without the tool's name and "error: "; warnings may come before it.
std::string MessageOf(const Mistake& mistake, const CommandResult& result) {
  EXPECT_EQ(result.exit_status, mistake.status) << result.errors;
  const std::string tool = "mono3d-" + mistake.command.substr(0, mistake.command.find(' '));
  std::vector<std::string> messages;
  std::istringstream lines(result.errors);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(tool + ": warning: ")) continue;
    EXPECT_TRUE(line.starts_with(tool + ": error: ")) << line;
    messages.push_back(line.substr(std::min(line.size(), tool.size() + 9)));
  }
  EXPECT_EQ(messages.size(), 1U) << result.errors;
  return messages.empty() ? "" : messages.back();
}

TEST_F(MistakesOfUsers, GetOneLineWithCauseAndRemedyThatTheDocumentationLists) {
  const auto before = FilesIn(files());
  const std::string documentation = ReadText(MONO3D_MESSAGES);
  std::string rows;
  for (const Mistake& mistake : Mistakes()) {
    SCOPED_TRACE(mistake.what + ": mono3d-" + mistake.command);
    const std::string message = MessageOf(mistake, Run(mistake));
    EXPECT_THAT(message, HasSubstr(mistake.cause));
    EXPECT_THAT(message, HasSubstr(mistake.remedy));
    EXPECT_LT(message.size(), 500U);
    rows += Row(mistake, message);
    EXPECT_THAT(documentation, HasSubstr(Row(mistake, message)));
  }
  EXPECT_GE(Mistakes().size(), 60U);
  // No row of a mistake that is no more.
  EXPECT_EQ(std::ranges::count(documentation, '\n') - std::ranges::count(rows, '\n'),
            std::ranges::count(documentation.substr(0, documentation.find("|---|")), '\n') + 1);
  for (const auto& [name, bytes] : before) {
    EXPECT_EQ(ReadText(name), bytes) << name << " is no more as it was";
  }
  // For a change of the messages: MONO3D_WRITE_MESSAGES=rows.md
  if (const char* path = std::getenv("MONO3D_WRITE_MESSAGES")) WriteText(path, rows);
}

}  // namespace
}  // namespace mono3d
