// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/photo_detection.h"

#include <algorithm>
#include <optional>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/core/statistics.h"
#include "mono3d/tracking/photo_mapper.h"

namespace mono3d {
namespace {

// Between the least of rendered and real videos (0.64) and the most of photographs 9 to 11 degrees
// apart (0.39), medians over ten pairs.
constexpr double kMinContinuityOfVideo = 0.45;
constexpr std::int64_t kMaxNumPairs = 10;

std::optional<double> ContinuityAt(const PairOpener& open, std::int64_t start) {
  try {
    const std::unique_ptr<FrameSource> source = open(static_cast<int>(start));
    const std::optional<Frame> first = source->Next();
    const std::optional<Frame> second = source->Next();
    if (first && second) return ContinuityOf(first->bgr, second->bgr);
  } catch (const Error&) {
    // Who reads all of them will meet it again.
  }
  return std::nullopt;
}

}  // namespace

bool ArePhotos(std::int64_t num_images, const PairOpener& open) {
  if (num_images < 3) return false;
  const std::int64_t num_pairs = std::min(kMaxNumPairs, num_images - 1);
  std::vector<double> continuities;
  for (std::int64_t i = 0; i < num_pairs; ++i) {
    const std::int64_t start = num_pairs == 1 ? 0 : i * (num_images - 2) / (num_pairs - 1);
    if (const auto continuity = ContinuityAt(open, start)) continuities.push_back(*continuity);
  }
  return !continuities.empty() && UpperMedian(std::move(continuities)) < kMinContinuityOfVideo;
}

}  // namespace mono3d
