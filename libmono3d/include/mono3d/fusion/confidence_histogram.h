// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "mono3d/core/export.h"
#include "mono3d/fusion/surfel_map.h"
#include "mono3d/geometry/point_cloud.h"

namespace MONO3D_EXPORT mono3d {

// How many surfels have which confidence, in steps of 9 % of its value. Of a few images of a
// camera that hardly moved no surfel may have what is asked for; the surest are shown then.
class ConfidenceHistogram {
 public:
  void Add(double confidence);  // 0 to 1
  // Those that were matched. The cloud must have confidences.
  void Add(const PointCloud& surfels);
  void Add(const ConfidenceHistogram& other);

  // From which confidence on surfels are to be shown: options.min_confidence, or less, more than 0,
  // where less than options.min_share of them have that: as much as that share has.
  double LimitFor(const SurfelExportOptions& options) const;

 private:
  static constexpr int kBinsPerOctave = 8;
  static constexpr std::size_t kNumBins = 16 * kBinsPerOctave;  // what is less is in the last one

  std::array<std::uint32_t, kNumBins> num_of_bin_{};  // from a confidence of 1 down
};

}  // namespace mono3d
