// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/snapshot.h"

#include <algorithm>
#include <cstddef>

#include "mono3d/fusion/confidence_histogram.h"

namespace mono3d {

PointCloud ToPointCloud(const SurfelChanges& surfels, const SurfelExportOptions& options) {
  ConfidenceHistogram histogram;
  for (const SurfelChunk& chunk : surfels.changed) histogram.Add(*chunk.surfels);
  const double min_confidence = histogram.LimitFor(options);
  PointCloud cloud;
  for (const SurfelChunk& chunk : surfels.changed) {
    const auto anchor = std::ranges::find(surfels.anchors, chunk.anchor, &SurfelAnchor::number);
    if (anchor == surfels.anchors.end()) continue;
    const Similarity& S_world_anchor = anchor->S_world_anchor;
    const Eigen::Matrix3f R = S_world_anchor.pose().rotation().toRotationMatrix().cast<float>();
    const auto scale = static_cast<float>(S_world_anchor.scale());
    const Eigen::Vector3f t = S_world_anchor.pose().translation().cast<float>();
    const PointCloud& own = *chunk.surfels;
    const bool has_frames = cloud.first_frames.size() == cloud.size() && !own.first_frames.empty();
    if (!has_frames) cloud.first_frames.clear();
    for (std::size_t i = 0; i < own.size(); ++i) {
      if (own.confidences[i] < min_confidence) continue;
      cloud.points.emplace_back(scale * (R * own.points[i]) + t);
      cloud.normals.emplace_back(R * own.normals[i]);
      cloud.colours.push_back(own.colours[i]);
      cloud.radii.push_back(scale * own.radii[i]);
      cloud.confidences.push_back(own.confidences[i]);
      cloud.observations.push_back(own.observations[i]);
      cloud.inferred.push_back(IsInferred(own, i) ? 1 : 0);
      if (has_frames) cloud.first_frames.push_back(own.first_frames[i]);
    }
  }
  return cloud;
}

}  // namespace mono3d
