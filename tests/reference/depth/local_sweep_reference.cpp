// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/local_sweep_reference.h"

#include "reference/depth/plane_sweep_reference.h"

namespace mono3d::reference {

LocalVolume LocalSweep(const std::vector<std::vector<std::uint64_t>>& census,
                       const SourceProjections& projections, const std::vector<LocalRange>& ranges,
                       const LocalSweepParams& params) {
  int num_planes = 0;
  for (const LocalRange& range : ranges) {
    num_planes = std::max(num_planes, range.first_plane + kNumLocalPlanes);
  }
  // All planes of all pixels, of which each takes its own.
  const PlaneSweepParams all{.width_px = params.width_px,
                             .height_px = params.height_px,
                             .num_planes = static_cast<std::uint32_t>(num_planes),
                             .padded_planes = static_cast<std::uint32_t>(num_planes),
                             .positions_per_px = 1,
                             .inverse_depth = params.inverse_depth,
                             .inverse_depth_step = params.inverse_depth_step};
  const std::vector<std::uint8_t> costs = PlaneSweep(census, projections, all);
  LocalVolume local(ranges.size());
  for (std::size_t pixel = 0; pixel < ranges.size(); ++pixel) {
    for (std::size_t d = 0; d < local[pixel].size(); ++d) {
      const bool matched = !ranges[pixel].narrow || (d >= 4 && d < 12);
      const std::size_t plane = static_cast<std::size_t>(ranges[pixel].first_plane) + d;
      local[pixel][d] = matched ? costs[pixel * all.padded_planes + plane] : std::uint8_t{255};
    }
  }
  return local;
}

}  // namespace mono3d::reference
