// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "faults/small_reconstruction.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <thread>
#include <utility>

namespace mono3d::faults {
namespace {

constexpr std::string_view kEarlier = "earlier";
constexpr const char* kOwnFile = "notes.txt";
constexpr const char* kEarlierFiles[] = {
    "model.ply",         "trajectory.txt", "run.json", "depth/000007.depth.pfm",
    "sparse/images.txt", "model_map3.ply", "mesh.ply"};

// Far longer than a run takes on a machine that does much else: only one that waits for ever
// comes to it.
constexpr auto kLimit = std::chrono::seconds(600);
constexpr auto kPollInterval = std::chrono::milliseconds(2);

std::string TextOf(const std::filesystem::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void PutEarlier(const std::filesystem::path& path) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path) << kEarlier;
}

[[noreturn]] void BecomeTool(const std::vector<std::string>& words, const Environment& environment,
                             const std::filesystem::path& folder) {
  for (const auto& [name, value] : environment) setenv(name.c_str(), value.c_str(), 1);
  constexpr mode_t kMode = 0644;
  const int output = open((folder / "stdout.txt").c_str(), O_WRONLY | O_CREAT | O_TRUNC, kMode);
  const int errors = open((folder / "stderr.txt").c_str(), O_WRONLY | O_CREAT | O_TRUNC, kMode);
  const int nothing = open("/dev/null", O_RDONLY);
  dup2(nothing, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(errors, STDERR_FILENO);
  std::vector<char*> arguments;
  for (const std::string& word : words) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  execv(arguments[0], arguments.data());
  _exit(127);
}

}  // namespace

SmallReconstruction::SmallReconstruction(std::filesystem::path folder,
                                         std::vector<std::string> extra,
                                         const std::filesystem::path& video)
    : folder_(std::move(folder)) {
  const std::filesystem::path flight = MONO3D_EXAMPLE;
  const char* other_tool = std::getenv("MONO3D_FAULT_TOOL");
  arguments_ = {other_tool == nullptr ? MONO3D_RECONSTRUCT_TOOL : other_tool,
                video.empty() ? flight : video,
                "--camera",
                flight / "camera.yaml",
                "-o",
                output(),
                "--resize",
                "192x112",
                "--tracking.features.num_features",
                "400",
                "--camera-fixed",
                "--video"};
  arguments_.insert(arguments_.end(), extra.begin(), extra.end());
}

void SmallReconstruction::MakeEarlierRun() const {
  std::filesystem::remove_all(output());
  for (const char* name : kEarlierFiles) PutEarlier(output() / name);
  PutEarlier(output() / kOwnFile);
}

std::string SmallReconstruction::ChangeOfEarlierRun() const {
  std::string changed;
  if (TextOf(output() / kOwnFile) != kEarlier) changed += std::string(" ") + kOwnFile;
  for (const char* name : kEarlierFiles) {
    if (TextOf(output() / name) != kEarlier) changed += std::string(" ") + name;
  }
  return changed;
}

bool SmallReconstruction::IsEarlierRunGone() const {
  if (TextOf(output() / kOwnFile) != kEarlier) return false;
  for (const char* name : kEarlierFiles) {
    if (TextOf(output() / name) == kEarlier) return false;
  }
  return true;
}

EndedRun SmallReconstruction::Run(const Environment& environment,
                                  const std::function<void(pid_t)>& watch,
                                  const std::vector<std::string>& more) const {
  std::vector<std::string> words = arguments_;
  words.insert(words.end(), more.begin(), more.end());
  EndedRun run;
  const pid_t process = fork();
  if (process == 0) BecomeTool(words, environment, folder_);
  if (process < 0) return run;
  const auto end = std::chrono::steady_clock::now() + kLimit;
  int status = 0;
  while (waitpid(process, &status, WNOHANG) == 0) {
    if (!run.has_hung && std::chrono::steady_clock::now() > end) {
      run.has_hung = true;
      kill(process, SIGKILL);
    }
    if (watch) watch(process);
    std::this_thread::sleep_for(kPollInterval);
  }
  if (WIFEXITED(status)) run.exit_status = WEXITSTATUS(status);
  if (WIFSIGNALED(status)) run.signal = WTERMSIG(status);
  run.output = TextOf(folder_ / "stdout.txt");
  run.errors = TextOf(folder_ / "stderr.txt");
  return run;
}

Environment FileFaults(const std::filesystem::path& folder, const std::string& fault) {
  return {{"LD_PRELOAD", MONO3D_FILE_FAULTS},
          {"MONO3D_FAULT_PATHS", folder.string() + ":" + MONO3D_EXAMPLE},
          {"MONO3D_FAULT", fault}};
}

Environment DeviceFaults(const std::string& fault) {
  return {{"VK_LAYER_PATH", MONO3D_LAYER_FOLDER},
          {"VK_INSTANCE_LAYERS", "VK_LAYER_MONO3D_faults"},
          {"MONO3D_FAULT", fault}};
}

}  // namespace mono3d::faults
