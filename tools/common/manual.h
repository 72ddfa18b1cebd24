// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <CLI/CLI.hpp>
#include <string>
#include <string_view>

namespace mono3d::tools {

// What can be read of a tool beside its help, from the same table of options.

// A page of the manual, section 1, in the form of man(7). `examples`: lines for a shell.
std::string ManPage(const CLI::App& app, const std::string& examples);

// For bash: completes the options of the tool and of its subcommands, the values of those that have
// a list of them, and else files.
std::string BashCompletion(const CLI::App& app);

// The long option of the tool, or of a subcommand, that `word` (without dashes) most likely means;
// empty where none is near.
std::string NearestOption(const CLI::App& app, std::string_view word);

}  // namespace mono3d::tools
