// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/footage_parts.h"

#include <algorithm>
#include <cstddef>

namespace mono3d::calibration {
namespace {

// Where all parts together would make up most of the footage, it is one: what hangs together tells
// more (decision 17).
std::vector<FootagePart> SpreadParts(std::optional<std::int64_t> num_frames, int num_parts,
                                     int part_frames) {
  constexpr double kMost = 2. / 3;
  if (!num_frames || num_parts == 1 || *num_frames <= part_frames) return {{0, part_frames}};
  if (kMost * static_cast<double>(*num_frames) <= num_parts * static_cast<double>(part_frames)) {
    return {{0, static_cast<int>(*num_frames)}};
  }
  std::vector<FootagePart> parts;
  for (int i = 0; i < num_parts; ++i) {
    const std::int64_t last = *num_frames - part_frames;
    parts.push_back({static_cast<int>(last * i / (num_parts - 1)), part_frames});
  }
  return parts;
}

}  // namespace

FootageParts ChooseParts(std::optional<std::int64_t> num_frames,
                         const CalibrationOptions& options) {
  constexpr double kMinGrowth = 1.25;  // else they tell no more
  FootageParts parts{SpreadParts(num_frames, options.num_parts, options.part_frames)};
  if (!num_frames) return parts;
  const double num_in_share =
      options.max_share * static_cast<double>(*num_frames) / options.num_parts;
  const double longest = std::min<double>(options.max_part_frames, num_in_share);
  if (longest >= kMinGrowth * parts.all[0].num_frames) {
    parts.longer = SpreadParts(num_frames, options.num_parts, static_cast<int>(longest));
  }
  return parts;
}

}  // namespace mono3d::calibration
