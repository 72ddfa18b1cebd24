// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "run_report/overlap.h"

#include <algorithm>
#include <set>

#include "mono3d/core/statistics.h"

namespace mono3d::tools {

std::vector<KeyframeOverlap> Overlaps(const SparseModel& sparse) {
  std::vector<const SparseImage*> images;
  for (const SparseImage& image : sparse.images) images.push_back(&image);
  std::ranges::sort(images, {}, [](const SparseImage* image) { return image->id; });
  std::vector<KeyframeOverlap> overlaps;
  std::vector<bool> was_seen(sparse.points.size());
  for (std::size_t i = 0; i < images.size(); ++i) {
    const SparseImage& image = *images[i];
    KeyframeOverlap overlap{.frame_index = image.id};
    std::vector<bool> is_seen(sparse.points.size());
    std::vector<double> depths;
    const Pose T_cam_world = image.T_world_cam.Inverse();
    int num_shared = 0;
    for (const SparseObservation& observation : image.observations) {
      if (!observation.point || *observation.point >= sparse.points.size()) continue;
      is_seen[*observation.point] = true;
      ++overlap.num_points;
      num_shared += was_seen[*observation.point] ? 1 : 0;
      depths.push_back((T_cam_world * sparse.points[*observation.point].p_world).z());
    }
    was_seen.swap(is_seen);
    if (i == 0) continue;
    if (overlap.num_points > 0) {
      overlap.shared = static_cast<double>(num_shared) / overlap.num_points;
      const double depth = Median(depths);
      const double baseline =
          (image.T_world_cam.translation() - images[i - 1]->T_world_cam.translation()).norm();
      if (depth > 0) overlap.baseline_ratio = baseline / depth;
    }
    overlaps.push_back(overlap);
  }
  return overlaps;
}

}  // namespace mono3d::tools
