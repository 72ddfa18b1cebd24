// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/tool.h"

#include <glog/logging.h>
#include <spdlog/sinks/stdout_color_sinks.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <initializer_list>
#include <iostream>
#include <new>
#include <opencv2/core.hpp>
#include <opencv2/core/utils/logger.hpp>
#include <system_error>
#include <utility>
#include <vector>

#include "common/allocator.h"
#include "common/common_options.h"
#include "common/dotted_config.h"
#include "common/manual.h"
#include "common/warnings.h"
#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/core/printable.h"
#include "mono3d/core/version.h"

namespace mono3d::tools {
namespace {

std::atomic<bool> stop_requested = false;
static_assert(std::atomic<bool>::is_always_lock_free, "a signal handler may set it");

void OnStopSignal(int signal) {
  stop_requested = true;
  std::signal(signal, SIG_DFL);
}

// The library's messages go to stderr, so that stdout holds the result alone.
void SendLogToStderr(const std::string& name, bool verbose) {
  // Ceres would tell of each step that it tries again shorter.
  FLAGS_minloglevel = verbose ? google::GLOG_WARNING : google::GLOG_ERROR;
  auto logger = spdlog::get(name);
  if (!logger) logger = spdlog::stderr_color_st(name);
  logger->set_pattern("%n: %l: %v");
  logger->set_level(verbose ? spdlog::level::debug : spdlog::level::warn);
  SetLogSink([logger](LogLevel level, std::string_view message) {
    switch (level) {
      case LogLevel::kDebug:
        logger->debug(Printable(message));
        break;
      case LogLevel::kInfo:
        logger->info(Printable(message));
        break;
      case LogLevel::kWarning:
        if (NoteWarning(message)) logger->warn(Printable(message));  // one message once
        break;
    }
  });
}

void PrintDevices() {
  for (const DeviceInfo& device : ListDevices()) {
    std::printf("%d  %s (%s, %s)\n", device.index, device.name.c_str(), device.type.c_str(),
                device.driver.c_str());
  }
}

// Leaves out of the help what few people set.
void HideUncommonOptions(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    const std::vector<std::string>& names = option->get_lnames();
    if (!names.empty() && !IsCommonOption(names[0])) option->group("");
  }
  for (CLI::App* subcommand : app.get_subcommands([](const CLI::App*) { return true; })) {
    HideUncommonOptions(*subcommand);
  }
}

}  // namespace

Tool::Tool(const std::string& name, const std::string& description, ToolKind kind)
    : name_(name), app_(description, name), kind_(kind) {
  app_.set_help_flag("-h,--help", "list the options that people set, and end");
  app_.set_help_all_flag("--help-all", "list every option, and end");
  app_.set_version_flag("--version", std::string("mono3d ") + Version());
  app_.add_flag("--verbose", common_.verbose, "tell more on stderr");
  if (kind == ToolKind::kPlain) return;
  app_.set_config("--config", "", "read options from a file of lines \"name = value\"");
  app_.config_formatter(std::make_shared<DottedConfig>());
  app_.allow_config_extras(CLI::config_extras_mode::error);
  if (kind == ToolKind::kWithoutDevice) return;
  app_.add_option("--device", common_.device.device,
                  "Vulkan device: its index or part of its name (see --list-devices)");
  app_.add_flag("--list-devices", common_.list_devices, "list the Vulkan devices and end");
  app_.add_flag("!--no-host-kernels", common_.device.host_kernels,
                "without a GPU, all kernels by the driver, to compare: slower, the same result");
  app_.add_flag("--validation", common_.device.validation,
                "run with the Khronos validation layer (for developers)");
}

void Tool::AddOptions(CLI::App& app, const std::vector<OptionField>& fields,
                      const std::string& prefix) {
  for (const OptionField& field : fields) {
    std::string name = prefix + field.name;
    const std::size_t dot = name.find('.');
    // Options of a stage are called as in the code; the input's as on any command line.
    if (dot == std::string::npos) std::replace(name.begin(), name.end(), '_', '-');
    const std::string group = dot == std::string::npos ? "Input" : "Stage " + name.substr(0, dot);
    CLI::Option* option = std::visit(
        [&](auto* value) {
          return app.add_option("--" + name, *value, field.help)
              ->group(group)
              ->capture_default_str();
        },
        field.value);
    if (field.words.empty()) continue;
    option->transform(
        [words = field.words](const std::string& text) {
          const auto word = std::ranges::find(words, text, &OptionWord::word);
          return word == words.end() ? text : std::to_string(word->value);
        },
        "");
  }
}

void Tool::ShowInHelp(std::vector<std::string> names, const std::string& examples) {
  shown_ = std::move(names);
  examples_ = examples;
  app_.footer("\nExamples:\n" + examples + "\n--help-all lists every option.");
}

CLI::Option* Tool::AddPreset(const std::string& flag, const std::string& help,
                             std::function<void()> apply) {
  presets_.push_back({flag, std::move(apply)});
  // From a file it would come too late to be a default.
  return app_.add_flag(flag, help)->configurable(false);
}

void Tool::HideRareOptions() {
  if (shown_.empty()) {
    HideUncommonOptions(app_);
    return;
  }
  for (CLI::Option* option : app_.get_options()) {
    const std::vector<std::string>& names = option->get_lnames();
    if (!names.empty() && std::ranges::find(shown_, names[0]) == shown_.end()) option->group("");
  }
}

std::string Tool::Suggestion(int argc, const char* const* argv) const {
  for (int i = 1; i < argc; ++i) {
    std::string_view word = argv[i];
    if (!word.starts_with("--")) continue;
    word = word.substr(2, word.find('=') == word.npos ? word.npos : word.find('=') - 2);
    const std::string nearest = NearestOption(app_, word);
    if (!nearest.empty() && nearest != word) return "; did you mean --" + nearest + "?";
  }
  return {};
}

// Options of an application and of its subcommands; null: there is none of this name.
const CLI::Option* FindOption(const CLI::App& app, const std::string& name) {
  if (const CLI::Option* option = app.get_option_no_throw(name)) return option;
  for (const CLI::App* subcommand : app.get_subcommands([](const CLI::App*) { return true; })) {
    if (const CLI::Option* option = FindOption(*subcommand, name)) return option;
  }
  return nullptr;
}

// "--camera= -o out" and "--camera -o out": CLI11 would take the next option for the value.
std::string Tool::MissingValue(int argc, const char* const* argv) const {
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    const bool ends_open = word.starts_with("--") && word.ends_with('=');
    const std::string name = ends_open ? word.substr(0, word.size() - 1) : word;
    if (!name.starts_with('-')) continue;
    const CLI::Option* option = FindOption(app_, name);
    if (option == nullptr || option->get_items_expected_min() == 0) continue;
    if (ends_open) return name + ": its value is missing behind the =";
    const bool comes_option =
        i + 1 < argc && argv[i + 1][0] == '-' && FindOption(app_, argv[i + 1]) != nullptr;
    if (comes_option) return name + ": its value is missing, " + argv[i + 1] + " comes next";
  }
  return {};
}

// What is likely meant by arguments that there is no place for; empty: who knows.
std::string Tool::MeaningOfExtras() const {
  const std::vector<std::string> extras = app_.remaining(/*recurse=*/true);
  const auto has_ending = [](const std::string& word, std::initializer_list<const char*> endings) {
    return std::ranges::any_of(endings, [&](const char* end) { return word.ends_with(end); });
  };
  std::error_code ignored;
  const auto is_there = [&](const std::string& word) {
    return std::filesystem::exists(word, ignored);
  };
  if (extras.empty() || !std::ranges::all_of(extras, is_there)) return {};
  const auto is_calibration = [&](const std::string& word) {
    return has_ending(word, {".yaml", ".yml", ".xml", ".json"});
  };
  if (is_calibration(extras[0])) {
    return extras[0] + " was not expected: is it meant as --camera " + extras[0] + "?";
  }
  const CLI::Option* input = app_.get_option_no_throw("INPUT");
  if (input != nullptr && input->count() > 0 && is_calibration(input->results()[0])) {
    return extras[0] + " was not expected: is " + input->results()[0] + " meant as --camera " +
           input->results()[0] + "?";
  }
  if (std::filesystem::is_directory(extras[0], ignored) ||
      has_ending(extras[0], {".mp4", ".MP4", ".mov", ".MOV", ".avi", ".mkv", ".m4v", ".ts"})) {
    return extras[0] +
           " was not expected: there is one input at a time; of a flight in parts put "
           "the images into one folder, or join the videos, as by ffmpeg -f concat";
  }
  const std::filesystem::path folder = std::filesystem::path(extras[0]).parent_path();
  const std::string ending = std::filesystem::path(extras[0]).extension().string();
  return std::to_string(extras.size() + 1) + " files where one input is expected, to " +
         extras.back() + ": quote the pattern, as \"" + (folder / ("*" + ending)).string() +
         "\", or name the folder, " + (folder.empty() ? "." : folder.string());
}

int Tool::PrintError(const std::string& message, int status) const {
  std::fprintf(stderr, "%s: error: %s\n", name_.c_str(), Printable(message).c_str());
  return status;
}

int Tool::Run(int argc, const char* const* argv, const std::function<int()>& body) {
  ReturnLargeBlocks();
  const auto is_given = [&](const std::string& flag) {
    return std::any_of(argv + 1, argv + argc, [&](const char* word) { return word == flag; });
  };
  // It needs none of the required arguments.
  common_.list_devices = kind_ == ToolKind::kOfTheChain && is_given("--list-devices");
  if (is_given("--man-page") || is_given("--bash-completion")) {  // for the build
    const std::string text =
        is_given("--man-page") ? ManPage(app_, examples_) : BashCompletion(app_);
    std::fputs(text.c_str(), stdout);
    return 0;
  }
  // For the help alone: a hidden option has no name in CLI11's messages.
  if (is_given("--help") || is_given("-h")) HideRareOptions();
  for (const Preset& preset : presets_) {
    if (is_given(preset.flag)) preset.apply();
  }
  // FFmpeg would print lines of its own beside ours: -8 is its AV_LOG_QUIET.
  setenv("OPENCV_FFMPEG_LOGLEVEL", "-8", /*overwrite=*/0);
  cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_SILENT);
  // Of damaged TIFF, WebP and PNM files OpenCV tells past its log; nothing of ours uses this
  // stream.
  std::cerr.setstate(std::ios_base::badbit);
  // A closed pipe or a limit of the file size is an error of the call that writes, and no reason to
  // die with half a result.
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    SendLogToStderr(name_, false);
    if (common_.list_devices) {
      PrintDevices();
      return 0;
    }
    if (const std::string missing = MissingValue(argc, argv); !missing.empty()) {
      return PrintError(missing + " (see --help)", 2);
    }
    app_.parse(argc, argv);
    SendLogToStderr(name_, common_.verbose);
    return body();
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app_.exit(error);  // --help, --version
    if (dynamic_cast<const CLI::ExtrasError*>(&error) != nullptr) {
      const std::string meaning = MeaningOfExtras();
      if (!meaning.empty()) return PrintError(meaning + " (see --help)", 2);
      return PrintError(error.what() + Suggestion(argc, argv) + " (see --help)", 2);
    }
    return PrintError(std::string(error.what()) + " (see --help)", 2);
  } catch (const UsageError& error) {
    return PrintError(error.what(), 2);
  } catch (const std::exception& error) {
    return PrintError(WordsOf(error), 1);
  }
}

std::string WordsOf(const std::exception& error) {
  const auto* of_opencv = dynamic_cast<const cv::Exception*>(&error);
  const bool is_memory = dynamic_cast<const std::bad_alloc*>(&error) != nullptr ||
                         (of_opencv != nullptr && of_opencv->code == cv::Error::StsNoMem);
  if (is_memory) return "not enough memory on this machine";
  if (of_opencv != nullptr) return "OpenCV: " + Printable(of_opencv->err);
  return error.what();
}

const std::atomic<bool>& StopRequested() { return stop_requested; }

void CatchStopSignals() {
  std::signal(SIGINT, OnStopSignal);
  std::signal(SIGTERM, OnStopSignal);
  // Ignored by nohup: it stays so.
  if (std::signal(SIGHUP, OnStopSignal) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
}

}  // namespace mono3d::tools
