// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <atomic>
#include <exception>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "mono3d/core/options.h"
#include "mono3d/gpu/device.h"

namespace mono3d::tools {

// What tools of the chain have beside --version and --config.
struct CommonArguments {
  DeviceOptions device;
  bool list_devices = false;
  bool verbose = false;
};

// A tool of the chain computes on a Vulkan device and reads options from a file; one without device
// does the latter alone; a plain one has --version and --verbose alone.
enum class ToolKind { kOfTheChain, kWithoutDevice, kPlain };

// One tool: its name, its arguments and what it does with them.
class Tool {
 public:
  Tool(const std::string& name, const std::string& description,
       ToolKind kind = ToolKind::kOfTheChain);

  CLI::App& app() { return app_; }
  const CommonArguments& common() const { return common_; }

  // As below, to the tool itself.
  void AddOptions(const std::vector<OptionField>& fields, const std::string& prefix = {}) {
    AddOptions(app_, fields, prefix);
  }
  // Binds every field as --<prefix><name>, in one group of the help per module; --help shows those
  // of kCommonOptions, --help-all every one. The variables must outlive the tool.
  static void AddOptions(CLI::App& app, const std::vector<OptionField>& fields,
                         const std::string& prefix = {});

  // --help lists these long options alone, and below them `examples`; without a call, those that
  // IsCommonOption tells. The man page has the examples as well.
  void ShowInHelp(std::vector<std::string> names, const std::string& examples);

  // A flag that changes values of other options; what is given beside it goes first.
  CLI::Option* AddPreset(const std::string& flag, const std::string& help,
                         std::function<void()> apply);

  // Reads the arguments and runs `body`. Returns the exit status: what `body` returns, 2 for wrong
  // usage, 1 for any other failure. An error is one line on stderr.
  int Run(int argc, const char* const* argv, const std::function<int()>& body);

 private:
  struct Preset {
    std::string flag;
    std::function<void()> apply;
  };

  int PrintError(const std::string& message, int status) const;
  void HideRareOptions();
  std::string MissingValue(int argc, const char* const* argv) const;
  std::string MeaningOfExtras() const;
  // "; did you mean --mesh?" where an argument is no option.
  std::string Suggestion(int argc, const char* const* argv) const;

  std::string name_;
  CLI::App app_;
  ToolKind kind_;
  CommonArguments common_;
  std::vector<std::string> shown_;  // in the help; empty: by IsCommonOption
  std::string examples_;
  std::vector<Preset> presets_;
};

// What went wrong, in one line.
std::string WordsOf(const std::exception& error);

// True once SIGINT, SIGTERM or SIGHUP (a closed terminal) has come. A second signal of the same
// kind ends the process at once.
const std::atomic<bool>& StopRequested();
void CatchStopSignals();

}  // namespace mono3d::tools
