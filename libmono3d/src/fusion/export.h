// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>

#include "fusion/surfel.h"
#include "mono3d/fusion/surfel_map.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/geometry/similarity.h"

namespace mono3d {

// The surfels that are not removed and meet the options, in their order; the fields as
// SurfelMap::Export states them; those of gap_confidence behind those of min_confidence. With a
// min_confidence above 0, those that stand alone among the others are left out as well
// (FindIsolated: fewer than 8 within three radii).
// `S_world_anchor` and `frames`, of which depth map that is: per anchor.
PointCloud ToPointCloud(const Surfels& surfels, std::span<const Similarity> S_world_anchor,
                        std::span<const std::uint32_t> frames, const SurfelExportOptions& options);
// The surfels of a model in parts, one after the other.
struct SurfelParts {
  std::function<void(const std::function<void(const Surfels&)>&)> for_each;
  std::size_t num_at_most = 0;  // of all parts together
};

// The same of those that were matched, and behind them of those that are inferred, marked. With a
// min_confidence above 0 an inferred surfel in the place of a matched one is left out.
PointCloud ToPointCloud(const Surfels& matched, const Surfels& inferred,
                        std::span<const Similarity> S_world_anchor,
                        std::span<const std::uint32_t> frames, const SurfelExportOptions& options);

// The surfels that meet the options by what each holds alone.
struct ChosenSurfels {
  PointCloud matched;
  PointCloud unsure;  // of gap_confidence alone
  PointCloud inferred;
  SurfelExportOptions options;  // with the least confidence that was taken
};
ChosenSurfels Choose(const SurfelParts& matched, const SurfelParts& inferred,
                     std::span<const Similarity> S_world_anchor,
                     std::span<const std::uint32_t> frames, const SurfelExportOptions& options);
// Without those that stand alone or in the place of surer ones.
PointCloud ToPointCloud(ChosenSurfels chosen);

}  // namespace mono3d
