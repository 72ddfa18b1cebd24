// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluate/surface_part.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <opencv2/core/mat.hpp>
#include <optional>
#include <string>

#include "mono3d/core/error.h"
#include "mono3d/evaluation/true_surface.h"
#include "mono3d/image/undistorter.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/depth_image_file.h"
#include "mono3d/io/timestamps_file.h"

namespace mono3d::tools {
namespace {

constexpr double kMaxFramesPerDepthMap = 5;
constexpr std::size_t kMaxRenderedViews = 100;
constexpr double kFps = 30;                    // of frames without times, as everywhere
constexpr double kMaxTimeDifference_s = 0.01;  // of a frame and its true pose

struct ViewFile {
  Pose T_world_cam;
  std::filesystem::path depth;  // empty: to be rendered
};

// True depth is in the pixels of the images as they are without distortion.
CameraModel DepthCamera(const SequenceFiles& sequence) {
  if (sequence.camera.empty()) throw Error("the sequence has no camera.yaml");
  if (!sequence.depth.empty()) {
    const auto beside = sequence.depth.begin()->second.parent_path() / "camera.yaml";
    if (std::filesystem::exists(beside)) return ReadCameraFile(beside);
  }
  const CameraModel camera = ReadCameraFile(sequence.camera);
  return camera.HasDistortion() ? Undistorter(camera).camera() : camera;
}

// Without images the true poses stand for the frames.
std::vector<double> FrameTimes(const SequenceFiles& sequence, std::span<const StampedPose> poses) {
  if (!sequence.timestamps.empty()) return ReadTimestamps(sequence.timestamps);
  std::vector<double> times_s;
  if (sequence.images.empty()) {
    for (const StampedPose& pose : poses) times_s.push_back(pose.timestamp_s);
  }
  for (std::size_t i = 0; i < sequence.images.size(); ++i) {
    times_s.push_back(static_cast<double>(i) / kFps);
  }
  return times_s;
}

// Nothing where the truth has no pose for that time.
std::optional<Pose> PoseAt(std::span<const StampedPose> poses, double time_s) {
  const auto distance = [time_s](const StampedPose& pose) {
    return std::abs(pose.timestamp_s - time_s);
  };
  const auto nearest = std::min_element(
      poses.begin(), poses.end(),
      [&](const StampedPose& a, const StampedPose& b) { return distance(a) < distance(b); });
  if (nearest == poses.end() || distance(*nearest) > kMaxTimeDifference_s) return std::nullopt;
  return nearest->T_world_cam;
}

std::vector<ViewFile> ViewsOf(const SequenceFiles& sequence, std::span<const StampedPose> poses,
                              const std::vector<double>& times_s, bool rendered) {
  const std::size_t num_frames = times_s.size();
  const std::size_t step = (num_frames + kMaxRenderedViews - 1) / kMaxRenderedViews;
  std::vector<ViewFile> views;
  for (std::size_t i = 0; i < num_frames; ++i) {
    ViewFile view;
    if (rendered) {
      if (i % step != 0) continue;
    } else {
      const auto found = sequence.depth.find(NumberOfImage(sequence, static_cast<std::int64_t>(i)));
      if (found == sequence.depth.end()) continue;
      view.depth = found->second;
    }
    const std::optional<Pose> pose = PoseAt(poses, times_s[i]);
    if (!pose) continue;
    view.T_world_cam = *pose;
    views.push_back(view);
  }
  return views;
}

std::optional<ConfidenceCalibration> CalibrationOf(const PointCloud& estimate,
                                                   const std::vector<double>& distances_m) {
  if (estimate.confidences.empty()) return std::nullopt;
  cv::Mat errors(1, static_cast<int>(distances_m.size()), CV_32FC1);
  cv::Mat confidences(1, static_cast<int>(distances_m.size()), CV_32FC1);
  std::ranges::transform(distances_m, errors.ptr<float>(),
                         [](double distance) { return static_cast<float>(distance); });
  std::ranges::copy(estimate.confidences, confidences.ptr<float>());
  return CalibrateConfidence(errors, confidences);
}

std::string HowSeen(const SequenceSurface& surface) {
  const std::string views = std::to_string(surface.num_all_views);
  return surface.is_rendered ? "in " + views + " frames, of which the true cloud was rendered"
                             : "in " + views + " frames with a true depth map";
}

}  // namespace

SequenceSurface ReadSequenceSurface(const SequenceFiles& sequence,
                                    std::span<const StampedPose> poses, const PointCloud& cloud,
                                    const DepthEvaluationOptions& options) {
  const CameraModel camera = DepthCamera(sequence);
  const double spacing_m = CloudSpacing(cloud);
  const std::vector<double> times_s = FrameTimes(sequence, poses);
  const auto num_frames = static_cast<double>(times_s.size());
  SequenceSurface surface;
  surface.is_rendered =
      static_cast<double>(sequence.depth.size()) * kMaxFramesPerDepthMap < num_frames;
  const std::vector<ViewFile> files = ViewsOf(sequence, poses, times_s, surface.is_rendered);
  if (files.empty()) throw Error("no frame of the sequence has a true pose");
  const auto png_scale = options.png_scale > 0 ? std::optional(options.png_scale) : std::nullopt;
  const TrueViewReader view = [&](std::size_t i) {
    TrueView shown = {camera, files[i].T_world_cam, {}};
    shown.depth = surface.is_rendered ? RenderTrueDepth(cloud, spacing_m, camera, shown.T_world_cam)
                                      : ReadDepthImage(files[i].depth, png_scale);
    if (options.max_depth_m > 0) shown.depth.setTo(0, shown.depth > options.max_depth_m);
    return shown;
  };
  surface.num_all_views = files.size();
  surface.cloud = surface.is_rendered ? cloud : CompleteTrueCloud(cloud, files.size(), view);
  surface.num_added = surface.cloud.size() - cloud.size();
  surface.num_views = CountViews(surface.cloud, spacing_m, files.size(), view);
  surface.frames_per_view = num_frames / static_cast<double>(files.size());
  surface.min_views =
      static_cast<std::uint32_t>(std::ceil(kMinFramesThatSee / surface.frames_per_view));
  surface.num_seen = static_cast<std::size_t>(std::ranges::count_if(
      surface.num_views, [&](std::uint32_t count) { return count >= surface.min_views; }));
  return surface;
}

SurfaceEvaluation EvaluateSurface(const PointCloud& estimate_in_truth,
                                  const SequenceSurface& surface,
                                  std::span<const double> thresholds_m) {
  SurfaceEvaluation evaluation;
  evaluation.surface = surface;
  evaluation.error = ComputeCloudError(estimate_in_truth, surface.cloud, thresholds_m);
  evaluation.confidence = CalibrationOf(estimate_in_truth, evaluation.error.estimate_distances_m);
  for (const CloudShares& all : evaluation.error.shares) {
    CloudShares seen;
    seen.threshold_m = all.threshold_m;
    seen.accuracy = all.accuracy;
    seen.completeness = CompletenessOfSeen(evaluation.error.truth_distances_m, surface.num_views,
                                           surface.min_views, all.threshold_m);
    const double sum = seen.accuracy + seen.completeness;
    seen.f_score = sum > 0 ? 2 * seen.accuracy * seen.completeness / sum : 0;
    evaluation.seen.push_back(seen);
  }
  return evaluation;
}

Json ToJson(const SurfaceEvaluation& evaluation) {
  const SequenceSurface& surface = evaluation.surface;
  Json json = {{"points", surface.cloud.size()},
               {"added_points", surface.num_added},
               {"views", surface.num_all_views},
               {"views_are", surface.is_rendered ? "rendered true cloud" : "true depth maps"},
               {"frames_per_view", surface.frames_per_view},
               {"min_frames", kMinFramesThatSee},
               {"min_views", surface.min_views},
               {"seen_points", surface.num_seen},
               {"estimate_to_truth_m", ToJson(evaluation.error.estimate_to_truth)},
               {"estimate_to_truth_plane_m", ToJson(evaluation.error.estimate_to_truth_plane)}};
  if (evaluation.confidence) {
    const ConfidenceCalibration& confidence = *evaluation.confidence;
    json["confidence"] = {
        {"error_removed_by_worst_tenth", confidence.error_removed_by_worst_tenth},
        {"error_removed_by_worst_tenth_oracle", confidence.error_removed_by_worst_tenth_oracle},
        {"area_to_oracle", confidence.area_to_oracle},
        {"random_area_to_oracle", confidence.random_area_to_oracle}};
  }
  for (const CloudShares& seen : evaluation.seen) {
    json["shares"].push_back({{"threshold_m", seen.threshold_m},
                              {"accuracy", seen.accuracy},
                              {"completeness_of_seen", seen.completeness},
                              {"f_score_of_seen", seen.f_score}});
  }
  return json;
}

Table SurfaceTable(const SurfaceEvaluation& evaluation, std::optional<double> mean_depth_m) {
  const SequenceSurface& surface = evaluation.surface;
  Table table;
  table.title = "Model: against all of the true surface that the frames show";
  table.columns = {"within", "accuracy",
                   "completeness of what " + std::to_string(kMinFramesThatSee) + " frames see",
                   "F-score"};
  for (const CloudShares& seen : evaluation.seen) {
    table.rows.push_back(
        {(mean_depth_m ? FormatPercent(seen.threshold_m / *mean_depth_m) + " = " : std::string()) +
             FormatNumber(seen.threshold_m, 3) + " m",
         FormatPercent(seen.accuracy), FormatPercent(seen.completeness),
         FormatPercent(seen.f_score)});
  }
  table.notes = {
      "RMSE of the model: " + FormatLength(evaluation.error.estimate_to_truth.rmse, mean_depth_m) +
          " point to point, " +
          FormatLength(evaluation.error.estimate_to_truth_plane.rmse, mean_depth_m) + " to planes.",
      "The true cloud and " + std::to_string(surface.num_added) +
          " points that it lacks of the true depth maps. " + std::to_string(kMinFramesThatSee) +
          " frames see " +
          FormatPercent(static_cast<double>(surface.num_seen) /
                        static_cast<double>(surface.cloud.size())) +
          " of it, as found " + HowSeen(surface) + "."};
  if (evaluation.confidence) {
    const ConfidenceCalibration& confidence = *evaluation.confidence;
    table.notes.push_back("With the least confident tenth of the model goes " +
                          FormatPercent(confidence.error_removed_by_worst_tenth) +
                          " of its mean distance, with the worst tenth " +
                          FormatPercent(confidence.error_removed_by_worst_tenth_oracle) + ".");
  }
  return table;
}

}  // namespace mono3d::tools
