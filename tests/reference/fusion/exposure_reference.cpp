// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <optional>

#include "reference/fusion/fusion_reference.h"

namespace mono3d::reference {
namespace {

// In 1/4 grey values, rounded to the nearest; none where a channel is clipped.
std::optional<std::uint32_t> QuarterGrey(std::uint32_t red, std::uint32_t green,
                                         std::uint32_t blue) {
  if (std::min({red, green, blue}) < 4 || std::max({red, green, blue}) >= 1020) return {};
  return (77 * red + 150 * green + 29 * blue + 128) / 256;
}

}  // namespace

std::vector<ExposureCell> ExposureCells(const ViewParams& view, const PackedDepthMap& map,
                                        const std::vector<std::uint32_t>& association,
                                        const Surfels& surfels) {
  std::vector<ExposureCell> cells(NumExposureCells(view.width_px, view.height_px));
  const std::uint32_t cell_px = ExposureCellSize_px(view.width_px);
  for (std::size_t i = 0; i < association.size(); ++i) {
    if (!IsPixel(association[i])) continue;
    const std::uint32_t pixel = association[i];
    const std::uint32_t rgb8 = map.colour[pixel];
    const std::uint32_t rgb10 = surfels.history[i][0];
    const auto image = QuarterGrey(4 * (rgb8 & 0xFFU), 4 * (rgb8 >> 8 & 0xFFU), 4 * (rgb8 >> 16));
    const auto model = QuarterGrey(rgb10 & 0x3FFU, rgb10 >> 10 & 0x3FFU, rgb10 >> 20 & 0x3FFU);
    if (!image || !model) continue;
    const std::uint32_t row = pixel / view.width_px / cell_px;
    ExposureCell& cell = cells[row * kExposureCellsPerRow + pixel % view.width_px / cell_px];
    cell[0] += 1;
    cell[1] += *image;
    cell[2] += *model;
  }
  return cells;
}

}  // namespace mono3d::reference
