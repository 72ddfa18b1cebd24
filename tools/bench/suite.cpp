// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/suite.h"

#include <fnmatch.h>

#include <algorithm>
#include <fstream>
#include <system_error>

#include "bench/process.h"
#include "common/json_file.h"
#include "common/tool.h"
#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"

namespace mono3d::tools {
namespace {

constexpr const char* kCommandFile = "bench.json";  // what made the results beside it

// Nothing when the file is not there or is no JSON object.
Json ReadJson(const std::filesystem::path& path) {
  Json json = ReadJsonFile<Json>(path);
  return json.is_object() ? json : Json::object();
}

// The line of a log that says what went wrong: the last one that calls itself an error, else the
// last one that says something.
std::string ReasonIn(const std::filesystem::path& log) {
  std::ifstream file(log);
  std::string last;
  std::string last_error;
  for (std::string line; std::getline(file, line);) {
    if (line.find(": error: ") != std::string::npos) last_error = line;
    if (line.find_first_not_of(" \t\r") != std::string::npos) last = line;
  }
  return last_error.empty() ? last : last_error;
}

struct Commands {
  std::vector<std::string> reconstruct;
  std::vector<std::string> evaluate;
};

Commands MakeCommands(const SuiteOptions& options, const std::filesystem::path& sequence,
                      const std::filesystem::path& output) {
  const std::filesystem::path programs = ProgramFolder();
  Commands commands;
  commands.reconstruct = {(programs / "mono3d-reconstruct").string(),
                          sequence.string(),
                          "--camera",
                          (sequence / "camera.yaml").string(),
                          "-o",
                          output.string()};
  commands.reconstruct.insert(commands.reconstruct.end(), options.reconstruct_arguments.begin(),
                              options.reconstruct_arguments.end());
  commands.evaluate = {(programs / "mono3d-evaluate").string(),
                       "run",
                       output.string(),
                       sequence.string(),
                       "--pictures",
                       (output / "pictures").string()};
  if (options.max_depth_m > 0) {
    commands.evaluate.insert(commands.evaluate.end(),
                             {"--max-depth", std::to_string(options.max_depth_m)});
  }
  return commands;
}

Json ToJson(const Commands& commands) {
  return {{"reconstruct", commands.reconstruct}, {"evaluate", commands.evaluate}};
}

// Runs one program; the reason why it failed, or nothing.
std::string RunCommand(const std::vector<std::string>& command, const std::filesystem::path& log,
                       double time_limit_s) {
  const ProcessResult process = RunProcess(command, log, time_limit_s, StopRequested());
  if (process.exit_status == 0) return {};
  const std::string reason = ReasonIn(log);
  const std::string program = std::filesystem::path(command[0]).filename().string();
  if (process.exit_status > 0 && !reason.empty()) return reason;
  return program + ": " + process.ending;
}

bool IsMade(const std::filesystem::path& output, const Commands& commands) {
  return ReadJson(output / kCommandFile) == ToJson(commands) &&
         std::filesystem::exists(output / "run.json") &&
         std::filesystem::exists(output / "evaluation.json");
}

SequenceResult RunSequence(const SuiteOptions& options, const std::filesystem::path& sequence) {
  const std::string name = sequence.filename().string();
  const std::filesystem::path output = std::filesystem::path(options.output) / name;
  const Commands commands = MakeCommands(options, sequence, output);
  if (!options.resume || !IsMade(output, commands)) {
    CreateOutputFolder(output);
    for (const char* file : {kCommandFile, "evaluation.json", "report.html"}) {
      std::filesystem::remove(output / file);
    }
    std::string reason =
        RunCommand(commands.reconstruct, output / "reconstruct.log", options.time_limit_s);
    if (!reason.empty()) return FailedSequence(name, reason);
    reason = RunCommand(commands.evaluate, output / "evaluate.log", options.time_limit_s);
    if (!reason.empty()) return FailedSequence(name, reason);
    // Written last: it says that the rest is complete.
    WriteFileAtomically(output / kCommandFile, JsonText(ToJson(commands)));
  }
  return ReadSequenceResult(name, ReadJson(output / "run.json"),
                            ReadJson(output / "evaluation.json"));
}

bool IsSequence(const std::filesystem::path& folder) {
  std::error_code ignored;
  // The output of a run has images/ as well.
  if (std::filesystem::exists(folder / "run.json", ignored)) return false;
  return std::filesystem::is_directory(folder / "images", ignored) ||
         std::filesystem::is_regular_file(folder / "camera.yaml", ignored);
}

}  // namespace

std::vector<std::filesystem::path> ListSequences(const SuiteOptions& options) {
  std::vector<std::filesystem::path> sequences;
  std::error_code failure;
  int num_others = 0;
  for (const auto& entry : std::filesystem::directory_iterator(options.folder, failure)) {
    if (!IsSequence(entry.path())) continue;
    const std::string name = entry.path().filename().string();
    if (fnmatch(options.only.c_str(), name.c_str(), 0) == 0) {
      sequences.push_back(entry.path());
    } else {
      ++num_others;
    }
  }
  if (failure) {
    throw Error(ErrorParts{.what = "cannot list the folder",
                           .where = options.folder,
                           .expected = {},
                           .found = failure.message()});
  }
  if (sequences.empty()) {
    throw Error(ErrorParts{
        .what = num_others == 0 ? "no sequence in the folder" : "no sequence of that name",
        .where = options.folder,
        .expected = num_others == 0 ? "folders with images/ and camera.yaml" : options.only,
        .found = num_others == 0 ? "none" : std::to_string(num_others) + " of other names"});
  }
  std::sort(sequences.begin(), sequences.end());
  return sequences;
}

std::vector<SequenceResult> RunSuite(const SuiteOptions& options,
                                     const std::function<void(const SequenceResult&)>& on_result) {
  std::vector<SequenceResult> results;
  for (const std::filesystem::path& sequence : ListSequences(options)) {
    if (StopRequested()) break;
    SequenceResult result;
    try {
      result = RunSequence(options, sequence);
    } catch (const std::exception& error) {
      result = FailedSequence(sequence.filename().string(), error.what());
    }
    if (StopRequested()) break;  // what was interrupted has not failed
    on_result(result);
    results.push_back(std::move(result));
  }
  return results;
}

}  // namespace mono3d::tools
