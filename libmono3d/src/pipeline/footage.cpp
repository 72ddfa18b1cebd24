// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/footage.h"

#include <algorithm>
#include <cstdint>
#include <memory>
#include <optional>

#include "mono3d/core/error.h"
#include "mono3d/tracking/photo_mapper.h"

namespace mono3d {
namespace {

// Medians over ten pairs: rendered, simulated and real videos 0.78 to 1, photographs 10 degrees
// apart 0.55 to 0.58, an indoor video of five frames a second 0.48, photographs of a walk around a
// building 0.27, of a strip from the air 0.12, and in another order less.
constexpr double kMinContinuityOfSparseVideo = 0.38;
constexpr double kMinContinuityOfVideo = 0.7;
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

Footage JudgeFootage(std::int64_t num_images, const PairOpener& open) {
  if (num_images < 3 || num_images > kMostImagesPlacedTogether) return Footage::kVideo;
  const std::int64_t num_pairs = std::min(kMaxNumPairs, num_images - 1);
  std::int64_t num_video = 0;
  std::int64_t num_sparse = 0;
  std::int64_t num_breaks = 0;
  const auto is_most = [&](std::int64_t count) { return 2 * count > num_pairs; };
  for (std::int64_t i = 0; i < num_pairs; ++i) {
    const std::int64_t start = num_pairs == 1 ? 0 : i * (num_images - 2) / (num_pairs - 1);
    const std::optional<double> continuity = ContinuityAt(open, start);
    if (!continuity) continue;
    ++(*continuity < kMinContinuityOfSparseVideo ? num_breaks
       : *continuity < kMinContinuityOfVideo     ? num_sparse
                                                 : num_video);
    if (is_most(num_breaks) || is_most(num_video)) break;
  }
  if (is_most(num_breaks)) return Footage::kPhotographs;
  return is_most(num_breaks + num_sparse) ? Footage::kSparseVideo : Footage::kVideo;
}

}  // namespace mono3d
