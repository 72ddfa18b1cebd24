// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/surfel_export.h"

#include <algorithm>

namespace mono3d {
namespace {

// The rule of succession with one doubt to begin with: a single observation is not certain.
float Confidence(const Surfels::Uint4& history) {
  const float for_it = static_cast<float>(High16(history[3])) / 256.0F;
  const auto against_it = static_cast<float>(High16(history[1]));
  return for_it / (for_it + against_it + 1);
}

std::uint8_t Colour8(std::uint32_t colour10) {
  return static_cast<std::uint8_t>(std::min((colour10 & 0x3FFU) + 2, 0x3FFU) / 4);
}

}  // namespace

PointCloud ToPointCloud(const Surfels& surfels, int min_observations) {
  PointCloud cloud;
  for (std::size_t i = 0; i < surfels.size(); ++i) {
    const auto& history = surfels.history[i];
    const std::uint32_t observations = Low16(history[1]);
    if (IsRemoved(surfels, i) || static_cast<int>(observations) < min_observations) continue;
    const auto& p = surfels.position_radius[i];
    const auto& n = surfels.normal_weight[i];
    cloud.points.emplace_back(p[0], p[1], p[2]);
    cloud.normals.emplace_back(n[0], n[1], n[2]);
    cloud.colours.push_back(
        {Colour8(history[0]), Colour8(history[0] >> 10), Colour8(history[0] >> 20)});
    cloud.radii.push_back(p[3]);
    cloud.confidences.push_back(Confidence(history));
    cloud.observations.push_back(observations);
  }
  return cloud;
}

}  // namespace mono3d
