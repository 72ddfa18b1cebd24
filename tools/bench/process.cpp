// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <system_error>
#include <thread>

#include "mono3d/core/error.h"
#include "mono3d/core/timing.h"
#include "report/table.h"

namespace mono3d::tools {
namespace {

constexpr double kGrace_s = 10;  // between asking to end and ending by force
constexpr std::chrono::milliseconds kPoll{20};

pid_t Spawn(const std::vector<std::string>& command, const std::filesystem::path& log) {
  std::vector<char*> arguments;
  for (const std::string& word : command) arguments.push_back(const_cast<char*>(word.c_str()));
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_addopen(&files, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC,
                                   0644);
  posix_spawn_file_actions_adddup2(&files, STDOUT_FILENO, STDERR_FILENO);
  pid_t process = 0;
  const int failure =
      posix_spawn(&process, command[0].c_str(), &files, nullptr, arguments.data(), environ);
  posix_spawn_file_actions_destroy(&files);
  if (failure != 0) {
    throw Error(ErrorParts{.what = "cannot start the program",
                           .where = command[0],
                           .expected = {},
                           .found = std::strerror(failure)});
  }
  return process;
}

std::string Ending(int status, const std::string& ended_by_us) {
  if (!ended_by_us.empty()) return ended_by_us;
  if (WIFEXITED(status)) return "exit " + std::to_string(WEXITSTATUS(status));
  const int signal = WTERMSIG(status);
  return "signal " + std::to_string(signal) + " (" + strsignal(signal) + ")";
}

double Seconds(const timeval& time) {
  return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
}

}  // namespace

ProcessResult RunProcess(const std::vector<std::string>& command, const std::filesystem::path& log,
                         double time_limit_s, const std::atomic<bool>& stop) {
  const double start_ms = WallClockMs();
  const pid_t process = Spawn(command, log);
  std::string ended_by_us;
  double asked_ms = 0;
  int status = 0;
  rusage usage{};
  for (;;) {
    const pid_t ended = wait4(process, &status, WNOHANG, &usage);
    if (ended == process) break;
    if (ended < 0 && errno != EINTR) throw Error("lost sight of the program " + command[0]);
    const double now_ms = WallClockMs();
    const bool is_late = time_limit_s > 0 && now_ms - start_ms > 1e3 * time_limit_s;
    if (ended_by_us.empty() && (is_late || stop)) {
      ended_by_us = stop ? "stopped" : "time limit of " + FormatNumber(time_limit_s, 3) + " s";
      asked_ms = now_ms;
      kill(process, SIGTERM);
    } else if (!ended_by_us.empty() && now_ms - asked_ms > 1e3 * kGrace_s) {
      kill(process, SIGKILL);
    }
    std::this_thread::sleep_for(kPoll);
  }
  ProcessResult result;
  if (WIFEXITED(status) && ended_by_us.empty()) result.exit_status = WEXITSTATUS(status);
  result.ending = Ending(status, ended_by_us);
  result.wall_s = 1e-3 * (WallClockMs() - start_ms);
  result.cpu_s = Seconds(usage.ru_utime) + Seconds(usage.ru_stime);
  return result;
}

std::filesystem::path ProgramFolder() {
  std::error_code failure;
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", failure);
  if (failure) throw Error("cannot find the folder of this program: " + failure.message());
  return program.parent_path();
}

}  // namespace mono3d::tools
