// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <string>

#include "report/page.h"
#include "run_report/report_contents.h"

namespace mono3d::tools {

// Two pages become one by these places in report.html, where mono3d-evaluate puts its key figures
// and its sections.
inline constexpr const char* kBeginKeyFigures = "<!-- evaluation: key figures -->";
inline constexpr const char* kBeginSections = "<!-- evaluation: sections -->";
inline constexpr const char* kEndOfPlace = "<!-- end -->";

// The page in its parts. `overview`: OverviewPicture of the result.
Page RunPage(const RunReport& report, const cv::Mat& overview);

// overview.png and report.html. Throws Error when one cannot be written.
void WriteRunReport(const std::filesystem::path& folder, const RunReport& report);

// The words of a command line as a shell takes them.
std::string ShellCommand(int argc, const char* const* argv);

// `html`, a page of WriteRunReport, with key figures and sections of `page`, in place of what an
// earlier call put there. Empty where `html` is no such page.
std::string WithEvaluation(std::string html, const Page& page);

}  // namespace mono3d::tools
