// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluate/depth_part.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <string>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/core/options.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/depth_image_file.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/io/image_file.h"

namespace mono3d::tools {
namespace {

cv::Mat ReadTruth(const std::filesystem::path& path, const DepthEvaluationOptions& options) {
  return ReadDepthImage(path,
                        options.png_scale > 0 ? std::optional(options.png_scale) : std::nullopt);
}

// `compare` between two files; what it throws names both.
template <typename Compare>
auto Named(const DepthFiles& files, const Compare& compare) {
  try {
    return compare();
  } catch (const Error& error) {
    throw Error(ErrorParts{.what = error.what(),
                           .where = files.estimate.string() + " and " + files.truth.string(),
                           .expected = {},
                           .found = {}});
  }
}

std::vector<std::optional<double>> FindScales(const std::vector<DepthFiles>& files,
                                              const DepthEvaluationOptions& options) {
  std::vector<std::optional<double>> scales;
  for (const DepthFiles& file : files) {
    const cv::Mat estimate = ReadDepthImage(file.estimate);
    const cv::Mat truth = ReadTruth(file.truth, options);
    scales.push_back(
        Named(file, [&] { return MedianDepthScale(estimate, truth, options.max_depth_m); }));
  }
  return scales;
}

std::vector<double> Present(const std::vector<std::optional<double>>& values) {
  std::vector<double> present;
  for (const auto& value : values) {
    if (value) present.push_back(*value);
  }
  return present;
}

// The estimate without what its mask, beside it, says to be inferred; empty without a mask.
cv::Mat MatchedAlone(const DepthFiles& files, const cv::Mat& estimate) {
  std::string path = files.estimate.string();
  const std::vector<std::string> endings = DepthFileEndings("depth");
  const auto ending = std::ranges::find_if(
      endings, [&](const std::string& candidate) { return path.ends_with(candidate); });
  if (ending == endings.end()) return {};
  path.replace(path.size() - ending->size(), ending->size(), ".inferred.png");
  if (!std::filesystem::exists(path)) return {};
  cv::Mat inferred;
  cv::extractChannel(ReadImage(path), inferred, 0);  // of three that are the same
  if (inferred.size() != estimate.size()) return {};
  cv::Mat matched = estimate.clone();
  matched.setTo(0, inferred);
  return matched;
}

DepthMapEvaluation EvaluateDepthMap(const DepthFiles& files, double scale,
                                    const DepthEvaluationOptions& options,
                                    const std::optional<CameraModel>& camera) {
  const cv::Mat estimate = ReadDepthImage(files.estimate);
  const cv::Mat truth = ReadTruth(files.truth, options);
  return Named(files, [&] {
    DepthMapEvaluation map;
    map.files = files;
    map.error = CompareDepth(estimate, truth, scale, options.max_depth_m);
    const cv::Mat matched = MatchedAlone(files, estimate);
    if (!matched.empty()) {
      map.matched = CompareDepth(matched, truth, scale, options.max_depth_m);
    }
    if (!files.confidence.empty()) {
      map.confidence =
          CalibrateConfidence(RelativeDepthErrorImage(estimate, truth, scale, options.max_depth_m),
                              ReadConfidence(files.confidence));
    }
    if (!files.normal.empty() && camera) {
      map.normals = CompareNormals(ReadNormals(files.normal), NormalsFromDepth(truth, *camera));
    }
    return map;
  });
}

void ComputeMeans(DepthEvaluation& evaluation) {
  std::vector<DepthError> errors;
  std::vector<DepthError> matched;
  std::vector<ConfidenceCalibration> confidences;
  std::vector<NormalError> normals;
  for (const DepthMapEvaluation& map : evaluation.maps) {
    errors.push_back(map.error);
    matched.push_back(map.matched.value_or(map.error));
    if (map.confidence) confidences.push_back(*map.confidence);
    if (map.normals) normals.push_back(*map.normals);
  }
  evaluation.mean = ComputeMeanDepthError(errors);
  const bool has_matched =
      std::any_of(evaluation.maps.begin(), evaluation.maps.end(),
                  [](const DepthMapEvaluation& map) { return map.matched.has_value(); });
  if (has_matched) evaluation.matched = ComputeMeanDepthError(matched);
  if (!confidences.empty()) evaluation.confidence = MeanCalibration(confidences);
  if (!normals.empty()) evaluation.normals = MeanNormalError(normals);
}

std::vector<DepthFiles> MatchFiles(const DepthArguments& arguments) {
  if (!std::filesystem::is_directory(arguments.estimate)) {
    DepthFiles files;
    files.frame = FrameNumber(arguments.estimate).value_or(0);
    files.estimate = arguments.estimate;
    files.truth = arguments.truth;
    return {files};
  }
  const FilesByFrame estimates = ListDepthImages(arguments.estimate);
  const FilesByFrame truth = ListDepthImages(arguments.truth);
  const FilesByFrame confidence = ListDepthMapFiles(arguments.estimate, "confidence");
  const FilesByFrame normal = ListDepthMapFiles(arguments.estimate, "normal");
  const auto find = [](const FilesByFrame& files, std::int64_t frame) {
    const auto found = files.find(frame);
    return found == files.end() ? std::filesystem::path{} : found->second;
  };
  std::vector<DepthFiles> pairs;
  for (const auto& [frame, path] : estimates) {
    const std::filesystem::path true_path = find(truth, frame);
    if (true_path.empty()) continue;
    pairs.push_back({frame, path, true_path, find(confidence, frame), find(normal, frame)});
  }
  if (pairs.empty()) {
    throw Error(ErrorParts{.what = "no estimate and truth have the same number in their names",
                           .where = arguments.estimate + " and " + arguments.truth,
                           .expected = "one of " + std::to_string(truth.size()) + " numbers from " +
                                       std::to_string(truth.begin()->first),
                           .found = std::to_string(estimates.size()) + " numbers from " +
                                    std::to_string(estimates.begin()->first)});
  }
  return pairs;
}

}  // namespace

void DepthEvaluationOptions::Validate() const {
  if (scaling != "map" && scaling != "run" && scaling != "none") {
    throw UsageError(ErrorParts{.what = "unknown scaling",
                                .where = "--scaling",
                                .expected = "map, run or none",
                                .found = scaling});
  }
  RequireOption(max_depth_m >= 0, "max-depth", "a depth in metres, 0: no bound", max_depth_m);
  RequireOption(png_scale >= 0, "png-scale", "more than 0, or 0: from scale.txt", png_scale);
}

DepthEvaluation EvaluateDepthMaps(const std::vector<DepthFiles>& files,
                                  const DepthEvaluationOptions& options,
                                  const std::optional<CameraModel>& camera) {
  options.Validate();
  DepthEvaluation evaluation;
  evaluation.options = options;
  const std::vector<std::optional<double>> scales = FindScales(files, options);
  const std::vector<double> present = Present(scales);
  const double run_scale = present.empty() ? 1 : RunDepthScale(present);
  if (!present.empty()) evaluation.scale_spread = ComputeStatistics(present).sigma / run_scale;
  for (std::size_t i = 0; i < files.size(); ++i) {
    const double scale = options.scaling == "none"  ? 1
                         : options.scaling == "run" ? run_scale
                                                    : scales[i].value_or(1);
    evaluation.maps.push_back(EvaluateDepthMap(files[i], scale, options, camera));
    evaluation.maps.back().median_scale = scales[i];
  }
  ComputeMeans(evaluation);
  return evaluation;
}

std::optional<MeanDepth> FindMeanDepth(const FilesByFrame& truth,
                                       const DepthEvaluationOptions& options) {
  constexpr std::size_t kMaxMaps = 100;
  const std::size_t step = (truth.size() + kMaxMaps - 1) / kMaxMaps;
  MeanDepth mean;
  double sum = 0;
  std::size_t index = 0;
  for (const auto& [frame, path] : truth) {
    if (index++ % step != 0) continue;
    const cv::Mat depth = ReadTruth(path, options);
    const DepthError error = CompareDepth(depth, depth, 1, options.max_depth_m);
    if (error.num_true_pixels == 0) continue;
    sum += error.mean_true_depth;
    ++mean.num_maps;
  }
  if (mean.num_maps == 0) return std::nullopt;
  mean.metres = sum / mean.num_maps;
  return mean;
}

Evaluation EvaluateDepthFiles(const DepthArguments& arguments, bool with_pictures) {
  arguments.options.Validate();
  std::optional<CameraModel> camera;
  if (!arguments.camera.empty()) camera = ReadCameraFile(arguments.camera);
  const DepthEvaluation depth = EvaluateDepthMaps(MatchFiles(arguments), arguments.options, camera);
  Evaluation evaluation;
  evaluation.page.title = "Depth";
  evaluation.page.subtitle = arguments.estimate + " against " + arguments.truth;
  evaluation.page.sections = DepthSections(depth, with_pictures);
  evaluation.json = RecordOf("depth", arguments.estimate, arguments.truth);
  evaluation.json.update(ToJson(depth));
  return evaluation;
}

}  // namespace mono3d::tools
