// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "evaluate/depth_part.h"
#include "evaluate/evaluation.h"
#include "evaluate/files.h"
#include "mono3d/evaluation/cloud_error.h"
#include "mono3d/evaluation/confidence_calibration.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/stamped_pose.h"

namespace mono3d::tools {

// A surface that fewer frames see is not asked of a model: a bundle has five.
inline constexpr int kMinFramesThatSee = 5;

// All that a sequence truly shows: its true cloud, with what the cloud lacks of the true depth
// maps, and how many views see each point. The views are the frames with a true depth map; where
// there are fewer than one in five frames, up to 100 frames at which the cloud is rendered.
struct SequenceSurface {
  PointCloud cloud;
  std::size_t num_added = 0;             // points that the true cloud lacked
  std::vector<std::uint32_t> num_views;  // that see the point
  std::size_t num_all_views = 0;
  bool is_rendered = false;     // the views
  double frames_per_view = 1;   // of the sequence; each view speaks for as many
  std::uint32_t min_views = 0;  // that speak for kMinFramesThatSee frames
  std::size_t num_seen = 0;     // points that so many see
};

// Throws Error when there are no images, no camera, no pose for one of the frames, or a file cannot
// be read.
SequenceSurface ReadSequenceSurface(const SequenceFiles& sequence,
                                    std::span<const StampedPose> poses, const PointCloud& cloud,
                                    const DepthEvaluationOptions& options);

// A model, in the frame of the truth, against that.
struct SurfaceEvaluation {
  CloudError error;
  std::vector<CloudShares> seen;  // completeness and F-score over the points that enough views see
  // Does the confidence of the model's points know how far they are off? Where they have one.
  std::optional<ConfidenceCalibration> confidence;
  SequenceSurface surface;
};
SurfaceEvaluation EvaluateSurface(const PointCloud& estimate_in_truth,
                                  const SequenceSurface& surface,
                                  std::span<const double> thresholds_m);

Json ToJson(const SurfaceEvaluation& evaluation);
Table SurfaceTable(const SurfaceEvaluation& evaluation, std::optional<double> mean_depth_m);

}  // namespace mono3d::tools
