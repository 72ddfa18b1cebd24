// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "run_report/run_report.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "common/summary.h"
#include "mono3d/core/version.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/io/live_input.h"
#include "mono3d/io/output_file.h"
#include "run_report/lost_frames.h"
#include "run_report/model_drawing.h"
#include "run_report/next_views_report.h"
#include "run_report/run_sections.h"

namespace mono3d::tools {
namespace {

KeyFigure PoseFigure(const std::vector<FrameOutcome>& outcomes) {
  const auto num_lost = std::ranges::count(outcomes, FrameFate::kLost, &FrameOutcome::fate);
  const auto num_frames = static_cast<double>(outcomes.size());
  return {"Images with a pose",
          outcomes.empty() ? "-" : FormatPercent(1 - static_cast<double>(num_lost) / num_frames),
          std::to_string(static_cast<std::int64_t>(outcomes.size()) - num_lost) + " of " +
              std::to_string(outcomes.size())};
}

// A model is good by what its depth maps say of each other: if they say nothing, it is not known.
KeyFigure ModelFigure(const Reconstruction& reconstruction, std::size_t num_surfels) {
  if (num_surfels == 0) return {"Model", "none", "see below"};
  const HealthState state = reconstruction.maps[0].health.state;
  if (state == HealthState::kGood && !WhyUncertain(reconstruction).empty()) {
    return {"Model", "uncertain", "of depths that are known badly"};
  }
  if (state == HealthState::kGood && !WhyNotConfirmed(reconstruction).empty()) {
    return {"Model", "unconfirmed", "no depth map confirms another"};
  }
  return {"Model", ToString(state), "by its latest depth maps"};
}

std::vector<KeyFigure> KeyFiguresOfRun(const RunReport& report,
                                       const std::vector<FrameOutcome>& outcomes) {
  const Reconstruction& reconstruction = report.reconstruction;
  const PipelineCounts& counts = reconstruction.counts;
  std::vector<KeyFigure> figures = {PoseFigure(outcomes)};
  figures.push_back({"Depth maps", std::to_string(counts.num_fused),
                     "in the model, of " + std::to_string(counts.num_bundles) + " tried"});
  const MapReconstruction* map = reconstruction.maps.empty() ? nullptr : reconstruction.maps.data();
  const std::size_t num_surfels = map != nullptr ? map->model.size() : 0;
  figures.push_back({"Surfels",
                     num_surfels >= 10'000 ? std::to_string(num_surfels / 1000) + " k"
                                           : std::to_string(num_surfels),
                     std::to_string(counts.num_keyframes) + " keyframes"});
  figures.push_back(ModelFigure(reconstruction, num_surfels));
  figures.push_back({"Time", FormatNumber(report.record.wall_s, 3) + " s",
                     "processor " + FormatNumber(report.record.cpu_s, 3) + " s"});
  return figures;
}

// Replaces what lies between `begin` and the next kEndOfPlace; false where there is no such place.
bool Replace(std::string& html, std::string_view begin, const std::string& text) {
  const std::size_t at = html.find(begin);
  if (at == std::string::npos) return false;
  const std::size_t first = at + begin.size();
  const std::size_t end = html.find(kEndOfPlace, first);
  if (end == std::string::npos) return false;
  html.replace(first, end - first, text);
  return true;
}

// The name of the input; of a folder "flight/images", as many have it, that of the flight.
std::string TitleOf(const std::string& input) {
  std::filesystem::path path = std::filesystem::path(input).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  if (path.filename() == "images" && path.parent_path().has_filename()) path = path.parent_path();
  return path.filename().string();
}

}  // namespace

Page RunPage(const RunReport& report, const cv::Mat& overview) {
  const std::vector<FrameOutcome> outcomes =
      FrameOutcomes(report.notes.frames(), report.reconstruction);
  Page page;
  page.title = TitleOf(report.record.input);
  page.subtitle = report.record.input + ", mono3d " + Version();
  page.key_figures = KeyFiguresOfRun(report, outcomes);
  page.html_after_key_figures = std::string(kBeginKeyFigures) + kEndOfPlace + "\n";
  page.html_after_sections = std::string(kBeginSections) + kEndOfPlace + "\n";
  const std::vector<MapReconstruction>& maps = report.reconstruction.maps;
  const Section next_views =
      maps.empty() ? Section() : NextViewsSection(maps.front(), report.next_views);
  for (Section& section : std::vector<Section>{
           NoticeSection(report), ModelOfRunSection(report, overview), CoverageSection(report),
           next_views, FrameSection(report, outcomes), DepthOfRunSection(report),
           PositionSection(report), CameraSection(report), TimeSection(report)}) {
    if (!section.title.empty()) page.sections.push_back(std::move(section));
  }
  return page;
}

void WriteRunReport(const std::filesystem::path& folder, const RunReport& report) {
  const cv::Mat overview =
      OverviewPicture(report.reconstruction, /*is_path=*/!report.record.are_photos);
  WritePng(folder / "overview.png", overview);
  WriteFileAtomically(folder / "report.html", ToHtml(RunPage(report, overview)));
}

std::string ShellCommand(int argc, const char* const* argv) {
  std::string command;
  for (int i = 0; i < argc; ++i) {
    const std::string word = WithoutPassword(argv[i]);
    constexpr std::string_view kPlain =
        "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-./=:,+@%";
    if (i > 0) command += ' ';
    if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) {
      command += word;
      continue;
    }
    command += '\'';
    for (const char c : word) command += c == '\'' ? std::string("'\\''") : std::string(1, c);
    command += '\'';
  }
  return command;
}

std::string WithEvaluation(std::string html, const Page& page) {
  if (!Replace(html, kBeginKeyFigures, KeyFiguresHtml(page)) ||
      !Replace(html, kBeginSections, SectionsHtml(page))) {
    return {};
  }
  return html;
}

}  // namespace mono3d::tools
