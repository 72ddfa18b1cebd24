// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "run_report/run_sections.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <map>
#include <opencv2/imgproc.hpp>
#include <sstream>
#include <utility>

#include "common/advice.h"
#include "common/camera_choice.h"
#include "common/summary.h"
#include "drawing/chart.h"
#include "mono3d/core/statistics.h"
#include "mono3d/core/timing.h"
#include "run_report/model_drawing.h"
#include "run_report/model_view.h"
#include "run_report/overlap.h"
#include "run_report/timeline.h"

namespace mono3d::tools {
namespace {

constexpr int kPictureQuality = 82;  // JPEG
constexpr std::size_t kMaxLostShown = 12;
constexpr std::size_t kMaxDepthShown = 4;
constexpr double kGoodOverlap = 0.3;

std::string Count(std::int64_t count) { return std::to_string(count); }

Section WithTitle(const std::string& title) {
  Section section;
  section.title = title;
  return section;
}

Figure JpegFigure(const std::string& name, const cv::Mat& image, const std::string& caption,
                  const std::string& alternative) {
  Figure figure;
  figure.name = name;
  figure.image = image;
  figure.caption = caption;
  figure.alternative = alternative;
  figure.jpeg_quality = kPictureQuality;
  return figure;
}

Figure SvgFigure(const std::string& name, const std::string& svg, const std::string& caption,
                 const std::string& alternative) {
  Figure figure;
  figure.name = name;
  figure.svg = svg;
  figure.caption = caption;
  figure.alternative = alternative;
  figure.is_wide = true;
  return figure;
}

// A reason in the words of the one who flew.
std::string Explained(const std::string& reason) {
  const std::string advice = ToText(AdviceOf(reason));
  return advice.empty() ? reason : reason + ": " + advice;
}

// Images side by side with their names below, so many in a row.
cv::Mat Tiles(const std::vector<std::pair<cv::Mat, std::string>>& tiles, int columns) {
  cv::Size cell(0, 0);
  for (const auto& [image, name] : tiles) {
    cell.width = std::max(cell.width, image.cols);
    cell.height = std::max(cell.height, image.rows);
  }
  constexpr int kText = 18;
  constexpr int kGap = 6;
  const int rows = (static_cast<int>(tiles.size()) + columns - 1) / columns;
  cv::Mat sheet(rows * (cell.height + kText), columns * (cell.width + kGap) - kGap, CV_8UC3,
                cv::Scalar(255, 255, 255));
  for (int i = 0; i < static_cast<int>(tiles.size()); ++i) {
    const auto& [image, name] = tiles[static_cast<std::size_t>(i)];
    const cv::Point corner(i % columns * (cell.width + kGap), i / columns * (cell.height + kText));
    image.copyTo(sheet(cv::Rect(corner, image.size())));
    DrawText(sheet, name, {corner.x + 0.5 * cell.width, corner.y + cell.height + 8.0},
             TextAlign::kCentre, 8);
  }
  return sheet;
}

cv::Mat DepthColours(const cv::Mat& depth) {
  std::vector<float> inverse;
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      if (depth.at<float>(y, x) > 0) inverse.push_back(1 / depth.at<float>(y, x));
    }
  }
  cv::Mat levels(depth.size(), CV_8UC1, cv::Scalar(0));
  if (inverse.empty()) return cv::Mat(depth.size(), CV_8UC3, cv::Scalar(235, 235, 235));
  const float low = Quantile(inverse, 0.01);
  const float high = std::max(Quantile(inverse, 0.99), low * 1.0001F);
  cv::Mat missing(depth.size(), CV_8UC1, cv::Scalar(0));
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = 0; x < depth.cols; ++x) {
      const float value = depth.at<float>(y, x);
      missing.at<std::uint8_t>(y, x) = value > 0 ? 0 : 255;
      if (value > 0) {
        levels.at<std::uint8_t>(y, x) =
            cv::saturate_cast<std::uint8_t>(255 * (1 / value - low) / (high - low));
      }
    }
  }
  cv::Mat colours;
  cv::applyColorMap(levels, colours, cv::COLORMAP_TURBO);
  colours.setTo(cv::Scalar(235, 235, 235), missing);
  return colours;
}

cv::Mat ConfidenceColours(const cv::Mat& confidence, cv::Size size) {
  if (confidence.empty()) return cv::Mat(size, CV_8UC3, cv::Scalar(235, 235, 235));
  cv::Mat levels;
  cv::Mat colours;
  confidence.convertTo(levels, CV_8UC1, 255);
  cv::applyColorMap(levels, colours, cv::COLORMAP_VIRIDIS);
  return colours;
}

// The picture of the frame of the stretch that is nearest to its middle.
const LostImage* ImageOf(const LostStretch& stretch, const std::vector<LostImage>& images) {
  const LostImage* best = nullptr;
  const std::int64_t middle = (stretch.first_frame + stretch.last_frame) / 2;
  for (const LostImage& image : images) {
    if (image.frame_index < stretch.first_frame || image.frame_index > stretch.last_frame) continue;
    if (best == nullptr ||
        std::abs(image.frame_index - middle) < std::abs(best->frame_index - middle)) {
      best = &image;
    }
  }
  return best;
}

std::string FramesOf(const LostStretch& stretch) {
  const std::string first = Count(stretch.first_frame);
  return stretch.num_frames == 1 ? first : first + " to " + Count(stretch.last_frame);
}

void AddLostFrames(const RunReport& report, const std::vector<FrameOutcome>& outcomes,
                   Section& section) {
  const std::vector<LostStretch> stretches = LostStretches(outcomes);
  if (stretches.empty()) return;
  const bool are_photos = report.record.are_photos;
  const bool have_names = !stretches.front().photo.empty();
  Table table;
  table.title = are_photos ? "Photographs without a pose" : "Frames without a pose";
  if (have_names) {
    table.columns = {are_photos ? "photograph" : "frame", "reason"};
  } else {
    table.columns = {"frames", "number", "reason"};
  }
  const std::vector<LostImage> images = report.notes.lost_images();
  std::vector<std::pair<cv::Mat, std::string>> tiles;
  std::map<std::string, std::int64_t> by_reason;
  for (const LostStretch& stretch : stretches) {
    by_reason[stretch.reason] += stretch.num_frames;
    if (table.rows.size() >= kMaxLostShown) continue;
    if (have_names) {
      table.rows.push_back({stretch.photo, stretch.reason});
    } else {
      table.rows.push_back({FramesOf(stretch), Count(stretch.num_frames), stretch.reason});
    }
    const LostImage* image = ImageOf(stretch, images);
    if (image != nullptr) {
      tiles.emplace_back(image->bgr, report.notes.NameOf(image->frame_index));
    }
  }
  const std::size_t num_more = stretches.size() - table.rows.size();
  if (num_more > 0) {
    table.notes = {"And " + Count(static_cast<int>(num_more)) +
                   (have_names ? " more." : " shorter parts.")};
  }
  section.tables.push_back(table);
  int num_explained = 0;
  constexpr int kMaxExplained = 3;
  for (const auto& [reason, times] : by_reason) {
    const std::string advice = ToText(AdviceOf(reason));
    if (advice.empty() || num_explained++ >= kMaxExplained) continue;
    section.paragraphs.push_back(reason + ": " + advice + ".");
  }
  if (tiles.empty()) return;
  const int columns = std::min<int>(4, static_cast<int>(tiles.size()));
  section.figures.push_back(
      JpegFigure("lost_frames", Tiles(tiles, columns),
                 are_photos ? "Photographs without a pose." : "Images of frames without a pose.",
                 "small images of what has no pose"));
}

double MedianOf(const std::vector<KeyframeOverlap>& overlaps, double KeyframeOverlap::*member) {
  std::vector<double> values;
  for (const KeyframeOverlap& overlap : overlaps) values.push_back(overlap.*member);
  return values.empty() ? 0 : Median(values);
}

void AddHealth(const RunReport& report, std::vector<std::string>& notices) {
  const Reconstruction& reconstruction = report.reconstruction;
  if (reconstruction.maps.empty()) return;
  const ModelHealth& health = reconstruction.maps[0].health;
  for (std::string why : {WhyUncertain(reconstruction), WhyNotConfirmed(reconstruction)}) {
    if (why.empty()) continue;
    why.front() = 'T';  // "the model is of one depth map"
    notices.push_back(why + ".");
  }
  if (health.state == HealthState::kGood) return;
  notices.push_back(std::string("The model is ") + ToString(health.state) + ". Likely cause: " +
                    ToText(AdviceOfModel(reconstruction, report.record)) + ".");
}

// What contradicts the survey is not found out at the end of the page.
void AddControl(const RunReport& report, std::vector<std::string>& notices) {
  if (report.reconstruction.maps.empty()) return;
  const MapReconstruction& map = report.reconstruction.maps[0];
  if (!map.georeference && !map.why_no_georeference.empty()) {
    notices.push_back("The model is not on the earth, though there are positions: " +
                      map.why_no_georeference + ".");
  }
  if (!map.georeference) return;
  if (!map.georeference->why_no_control.empty()) {
    notices.push_back("Ground control points are not used: " + map.georeference->why_no_control +
                      ".");
  }
  for (const ControlResidual& residual : map.georeference->control) {
    const std::string fault = FaultOf(residual);
    if (fault.empty()) continue;
    notices.push_back((residual.is_check ? "Check point " : "Ground control point ") +
                      residual.name + ": " + fault + ". See below, On the earth.");
  }
}

void AddEnd(const RunReport& report, std::vector<std::string>& notices) {
  if (report.record.end == RunEnd::kFailed) {
    notices.push_back("The run failed: " + report.record.error +
                      ". This page shows what there was by then.");
  }
  if (report.record.end == RunEnd::kStopped) {
    notices.emplace_back("The run was stopped before the end of the input.");
  }
  if (!report.no_model.empty()) notices.push_back("There is " + report.no_model + ".");
}

}  // namespace

Section NoticeSection(const RunReport& report) {
  Section section = WithTitle("What to know first");
  std::vector<std::string>& notices = section.paragraphs;
  const PipelineCounts& counts = report.reconstruction.counts;
  AddEnd(report, notices);
  AddHealth(report, notices);
  AddControl(report, notices);
  if (report.record.calibration && report.record.calibration->contradicts_prior) {
    notices.push_back(CameraLine(*report.record.calibration) + ".");
  }
  if (report.reconstruction.maps.size() > 1) {
    notices.push_back(Count(static_cast<std::int64_t>(report.reconstruction.maps.size())) +
                      " parts have nothing in common; this page shows the one with most images. " +
                      (report.record.are_photos
                           ? "Photographs that overlap with both would join them."
                           : "Fly so that known ground is seen again."));
  }
  if (report.record.num_skipped_images > 0) {
    notices.push_back(Count(report.record.num_skipped_images) +
                      " images could not be read and were left out.");
  }
  if (counts.num_dropped_bundles > 0) {
    notices.push_back(Count(counts.num_dropped_bundles) +
                      " depth maps were left out because the device was busy: --resize makes them "
                      "cheaper, and without --live nothing is left out.");
  }
  std::int64_t num_reduced = 0;
  for (const auto& [effort, number] : counts.reduced_depth_maps) num_reduced += number;
  if (num_reduced > 0) {
    notices.push_back(Count(num_reduced) +
                      " depth maps were made with less work, so that none was left out: without "
                      "--live all have the same.");
  }
  for (const NotedWarning& warning : report.warnings) {
    notices.push_back("Warning" +
                      (warning.times > 1 ? " (" + Count(warning.times) + " times)" : "") + ": " +
                      Explained(warning.message) + ".");
  }
  if (notices.empty()) notices.emplace_back("Nothing went wrong that the run knows of.");
  return section;
}

Section ModelOfRunSection(const RunReport& report, const cv::Mat& overview) {
  Section section = WithTitle("The model and the path");
  const bool is_path = !report.record.are_photos;
  if (!report.reconstruction.maps.empty()) {
    section.html = ModelViewHtml(report.reconstruction.maps[0], is_path);
  }
  section.figures = {JpegFigure(
      "overview", overview,
      is_path ? "From above and from two sides: the path of the camera from blue (start) to red, "
                "keyframes as dots. The same as overview.png."
              : "From above and from two sides, with the places of the photographs. The same as "
                "overview.png.",
      "the model from above and from two sides, with the path of the camera")};
  return section;
}

Section CoverageSection(const RunReport& report) {
  Section section = WithTitle("Coverage and overlap");
  if (report.reconstruction.maps.empty()) return {};
  const MapReconstruction& map = report.reconstruction.maps[0];
  const std::vector<KeyframeOverlap> overlaps = Overlaps(map.sparse);
  const bool are_photos = report.record.are_photos;
  const cv::Mat coverage = CoveragePicture(map);
  if (!coverage.empty()) {
    section.figures.push_back(JpegFigure(
        "coverage", coverage,
        "How many depth maps saw each place, from above. Dark places are thin: fly over them "
        "again, from another side.",
        "the model from above, coloured by the number of depth maps that saw it"));
  }
  if (!overlaps.empty()) {
    const double shared = MedianOf(overlaps, &KeyframeOverlap::shared);
    section.paragraphs.push_back(
        std::string(are_photos ? "A photograph" : "A keyframe") + " shares " +
        FormatPercent(shared, 0) + " of its points with the one before (median), and lies " +
        FormatPercent(MedianOf(overlaps, &KeyframeOverlap::baseline_ratio), 1) +
        " of the depth away from it." +
        (shared >= kGoodOverlap ? ""
         : are_photos           ? " That is little: take photographs nearer to each other."
                                : " That is little: take more images a second, or fly slower."));
    section.figures.push_back(
        SvgFigure("overlap", OverlapSvg(overlaps, are_photos),
                  are_photos ? "Share of a photograph's points that the one before shows as well. "
                               "Low where a new strip of the flight begins."
                             : "Share of a keyframe's points that the one before shows as well. "
                               "Where it falls to zero, tracking is about to be lost.",
                  "a curve of the overlap of keyframes over the frames"));
  }
  return section.figures.empty() ? Section() : section;
}

Section FrameSection(const RunReport& report, const std::vector<FrameOutcome>& outcomes) {
  Section section = WithTitle(report.record.are_photos ? "Photographs" : "Frames");
  if (outcomes.empty()) return {};
  const bool are_photos = report.record.are_photos;
  section.figures = {SvgFigure(
      "timeline", TimelineSvg(outcomes, report.reconstruction, are_photos),
      std::string(are_photos ? "Photographs in the order of their names, from 0 on. Poses: green "
                               "found, red none."
                             : "Poses: green when the frame came, yellow later, red none.") +
          " Depth maps: blue taken, red refused. Model: how well the latest depth maps fitted it "
          "(green, yellow, red).",
      "poses, keyframes, depth maps and the state of the model over the frames")};
  AddLostFrames(report, outcomes, section);
  const PipelineCounts& counts = report.reconstruction.counts;
  Table refused;
  refused.title = "No depth, or not taken into the model";
  refused.columns = {"reason", "number"};
  for (const auto* reasons : {&counts.rejected_bundles, &counts.rejected_depth_maps}) {
    for (const auto& [reason, times] : *reasons) {
      refused.rows.push_back({Explained(reason), Count(times)});
    }
  }
  if (!refused.rows.empty()) section.folded_tables.push_back(refused);
  return section;
}

Section DepthOfRunSection(const RunReport& report) {
  Section section = WithTitle("Depth maps");
  const std::vector<DepthExample> examples = report.notes.depth_examples();
  if (examples.empty()) return {};
  std::vector<std::pair<cv::Mat, std::string>> tiles;
  const std::size_t num_shown = std::min(kMaxDepthShown, examples.size());
  for (std::size_t i = 0; i < num_shown; ++i) {
    const std::size_t at =
        num_shown > 1 ? i * (examples.size() - 1) / (num_shown - 1) : examples.size() / 2;
    const DepthExample& example = examples[at];
    tiles.emplace_back(example.bgr, report.notes.NameOf(example.frame_index));
    tiles.emplace_back(DepthColours(example.depth), "depth");
    tiles.emplace_back(ConfidenceColours(example.confidence, example.bgr.size()), "confidence");
  }
  section.figures = {JpegFigure(
      "depth_examples", Tiles(tiles, 3),
      "Image, depth (red near, blue far) and confidence (yellow high, violet low). Grey: no depth, "
      "such as sky.",
      "images beside their depth and confidence")};
  return section;
}

Section TimeSection(const RunReport& report) {
  Section section = WithTitle("Times, and to run again");
  const RunRecord& record = report.record;
  const double frames =
      static_cast<double>(std::max<std::int64_t>(1, report.reconstruction.counts.num_frames));
  Table table;
  table.columns = {"", "whole run", "per frame"};
  for (const auto& [name, seconds] : {std::pair<const char*, double>{"clock", record.wall_s},
                                      {"processor, all threads", record.cpu_s}}) {
    table.rows.push_back(
        {name, FormatNumber(seconds, 3) + " s", FormatNumber(1e3 * seconds / frames, 3) + " ms"});
  }
  table.rows.push_back(
      {"peak memory", FormatNumber(1e-6 * static_cast<double>(PeakMemoryBytes()), 3) + " MB", "-"});
  table.notes = {"Device: " + record.device.name};
  section.tables = {table};
  section.html = "<p>The command:</p>\n<pre>" + EscapeHtml(report.command) + "</pre>\n";
  Table stages;
  stages.title = "Times of the stages";
  stages.columns = {"stage", "calls", "clock ms", "device ms"};
  for (const StageTime& stage : record.stages) {
    stages.rows.push_back({stage.stage, Count(stage.num_calls), FormatFixed(stage.wall_ms, 0),
                           FormatFixed(stage.gpu_ms, 0)});
  }
  Table options;
  options.title = "All options";
  options.columns = {"option", "value"};
  for (const OptionField& field : record.options) {
    const std::string value = std::visit(
        [](const auto* pointer) {
          std::ostringstream text;
          text << *pointer;
          return text.str();
        },
        field.value);
    options.rows.push_back({field.name, WordOf(field).value_or(value)});
  }
  section.folded_tables = {stages, options};
  return section;
}

}  // namespace mono3d::tools
