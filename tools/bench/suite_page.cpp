// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/suite_page.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <ctime>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <set>

#include "bench/paper_figures.h"
#include "common/json_file.h"
#include "mono3d/core/error.h"
#include "mono3d/core/version.h"
#include "mono3d/io/image_file.h"

namespace mono3d::tools {
namespace {

constexpr int kThumbnailWidth_px = 640;

std::string Today() {
  const std::time_t now = std::time(nullptr);
  std::tm utc{};
  gmtime_r(&now, &utc);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%d", &utc);
  return text.data();
}

// The devices that the runs say they used.
std::string Devices(std::span<const SequenceResult> results, const std::filesystem::path& output) {
  std::set<std::string> names;
  for (const SequenceResult& result : results) {
    const Json record = ReadJsonFile<Json>(output / result.name / "run.json");
    const Json::json_pointer at("/device/name");
    if (record.is_object() && record.contains(at) && record.at(at).is_string()) {
      names.insert(record.at(at).get<std::string>());
    }
  }
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + name;
  return text.empty() ? "no device" : text;
}

// A picture of the sequence's evaluation, made small; nothing when there is none.
std::optional<Figure> Thumbnail(const SequenceResult& result, const std::filesystem::path& output,
                                const std::string& picture, const std::string& what) {
  const std::filesystem::path path = output / result.name / "pictures" / (picture + ".png");
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) return std::nullopt;
  cv::Mat image;
  try {
    image = ReadImage(path);
  } catch (const Error&) {
    return std::nullopt;
  }
  Figure figure;
  figure.name = result.name + "_" + picture;
  figure.caption = result.name + ": " + what + ".";
  figure.alternative = what + " of the sequence " + result.name + ".";
  const int width = std::min(kThumbnailWidth_px, image.cols);
  cv::resize(image, figure.image, {width, std::max(1, image.rows * width / image.cols)}, 0, 0,
             cv::INTER_AREA);
  return figure;
}

std::string UrlOf(const std::string& name) {
  std::string url;
  for (const char c : name) {
    constexpr const char* kHex = "0123456789ABCDEF";
    const auto byte = static_cast<unsigned char>(c);
    const bool is_plain =
        (byte < 128U && std::isalnum(byte) != 0) || c == '-' || c == '_' || c == '.' || c == '~';
    if (is_plain) {
      url += c;
    } else {
      url += {'%', kHex[byte / 16U], kHex[byte % 16U]};
    }
  }
  return url;
}

Section SequenceSection(const SequenceResult& result, const std::filesystem::path& output) {
  Section section;
  section.title = result.name;
  if (!result.is_success) section.paragraphs = {"Failed: " + result.reason};
  if (std::filesystem::exists(output / result.name / "report.html")) {
    section.html = "<p><a href=\"" + UrlOf(result.name) + "/report.html\">All about " +
                   EscapeHtml(result.name) + "</a></p>\n";
  }
  const std::array<std::pair<const char*, const char*>, 3> pictures = {
      {{"trajectory_final", "the trajectory over the true one, coloured by its error"},
       {"depth_middle", "a middling depth map beside the truth and its error"},
       {"model_beside_truth", "the model beside the truth"}}};
  for (const auto& [picture, what] : pictures) {
    if (auto figure = Thumbnail(result, output, picture, what)) {
      section.figures.push_back(*std::move(figure));
    }
  }
  return section;
}

KeyFigure KeyOf(const std::string& label, const std::optional<SuiteMean>& mean, int decimals,
                const std::string& detail) {
  return {label, mean ? FormatPercent(mean->mean, decimals) : "-", detail};
}

}  // namespace

Page SuitePage(std::span<const SequenceResult> results, const std::string& suite,
               const std::filesystem::path& output) {
  Page page;
  page.title = "mono3d-bench: " + suite;
  page.subtitle = std::to_string(results.size()) + " sequences, " + Devices(results, output) +
                  ", mono3d " + Version() + ", " + Today();
  int num_successes = 0;
  for (const SequenceResult& result : results) num_successes += result.is_success ? 1 : 0;
  const PaperFigures& paper = kPaperSynthetic;
  page.key_figures = {
      {"Successes", std::to_string(num_successes) + " of " + std::to_string(results.size()),
       "paper: " + std::to_string(kPaperNumSuccesses) + " of " +
           std::to_string(kPaperNumSequences)},
      KeyOf(
          "Trajectory RMSE",
          MeanOverSuccesses(results, &SequenceResult::model_trajectory, &LengthErrors::rmse), 3,
          "of the depth; paper: " + FormatPercent(paper.trajectory_rmse_m / paper.mean_depth_m, 3)),
      KeyOf("Depth L1-rel", MeanOverSuccesses(results, &SequenceResult::depth_l1_rel), 2,
            "paper: " + FormatPercent(paper.depth_mae, 1)),
      KeyOf("Model RMSE", MeanOverSuccesses(results, &SequenceResult::model, &LengthErrors::rmse),
            3,
            "of the depth; paper: " + FormatPercent(paper.model_rmse_m / paper.mean_depth_m, 3))};
  Section tables;
  tables.title = "Beside the paper";
  tables.tables = SuiteTables(results);
  page.sections = {tables};
  for (const SequenceResult& result : results) {
    page.sections.push_back(SequenceSection(result, output));
  }
  return page;
}

std::string ToMarkdown(const Page& page) {
  std::string text = "## " + page.title + "\n\n" + page.subtitle + "\n";
  for (const Section& section : page.sections) {
    for (const Table& table : section.tables) text += "\n" + ToMarkdown(table);
  }
  return text;
}

Json ToJson(std::span<const SequenceResult> results, const std::string& suite) {
  Json json = {{"mono3d", Version()}, {"suite", suite}, {"date", Today()}};
  json["success_rule"] = SuccessRule();
  json["sequences"] = Json::array();
  for (const SequenceResult& result : results) json["sequences"].push_back(ToJson(result));
  return json;
}

}  // namespace mono3d::tools
