// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <atomic>
#include <cstddef>
#include <opencv2/core/utility.hpp>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "mono3d/tracking/photo_mapper.h"
#include "tracking/photos/photo_features.h"
#include "tracking/photos/photo_matching.h"

namespace mono3d {

bool ShowTheSame(std::span<const GroupedImage> images, const PhotoMapperOptions& options) {
  options.Validate();
  std::vector<tracking::PhotoFeatures> features;
  std::vector<std::size_t> group_of;
  for (const GroupedImage& image : images) {
    if (options.IsStopped()) return false;
    const std::optional<Frame> frame = image.open();
    if (!frame) continue;
    features.push_back(
        tracking::ExtractPhotoFeatures(*frame, options.num_features, options.max_side_px));
    group_of.push_back(image.group);
  }
  std::vector<std::pair<std::size_t, std::size_t>> pairs;
  for (std::size_t a = 0; a < features.size(); ++a) {
    for (std::size_t b = a + 1; b < features.size(); ++b) {
      if (group_of[a] != group_of[b]) pairs.emplace_back(a, b);
    }
  }
  std::atomic<bool> is_found = false;
  cv::parallel_for_({0, static_cast<int>(pairs.size())}, [&](const cv::Range& range) {
    for (int i = range.start; i < range.end && !is_found && !options.IsStopped(); ++i) {
      const auto& [a, b] = pairs[static_cast<std::size_t>(i)];
      if (tracking::MatchPhotoPair(features, a, b, options)) is_found = true;
    }
  });
  return is_found;
}

}  // namespace mono3d
