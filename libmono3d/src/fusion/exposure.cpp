// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/exposure.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "fusion/surfel.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

// One independent measurement of the depth stage's windows, 9x7; of fewer surfels the mean of a
// cell still depends on which ones they are.
constexpr std::uint32_t kMinSurfelsPerCell = 63;
// Rounding to whole grey values, and colours that were: the mean of a cell is no better than this.
constexpr double kMinCellSigma = 0.5;
// What light and reflections do to a cell between views, before the cells themselves have shown how
// much that is; it counts as so many cells.
constexpr double kExpectedCellSigma = 5;
constexpr double kExpectedCells = 4;
// Cells side by side share what light and reflections do: however many there are, they tell no more
// than so many regions of the image would, a row of four by three.
constexpr double kMaxIndependentCells = 12;
constexpr double kSigmasPerMedian = 1.4826;  // of the magnitude of normal errors
constexpr double kWeightScale = 2;           // sigmas at which a residual counts a quarter
// The weights tighten from where hardly any cell is an outlier, so many times the scale of the
// first residuals: each fit's scale is half of the one before it (graduated non-convexity, Blake
// and Zisserman 1987), until the residuals' own is reached.
constexpr double kFirstScale = 4;
constexpr int kMaxFits = 20;
constexpr double kConverged = 1e-4;  // of the gain
// What is expected without any cell. From one depth map to the next exposure changes by a stop at
// most as a rule, which is a third of grey values; an offset comes from flare, haze and tone
// curves.
constexpr double kGainPrior = 0.3;
constexpr double kOffsetPrior = 10;
// Two stops and more either way leave too little that neither image clips, and too few grey values.
constexpr double kMaxGain = 4;

struct CellMeans {
  double image;
  double model;
};

std::vector<CellMeans> MeansOf(std::span<const ExposureCell> cells) {
  std::vector<CellMeans> means;
  for (const ExposureCell& cell : cells) {
    if (cell[0] < kMinSurfelsPerCell) continue;
    const double quarters = 4.0 * cell[0];
    means.push_back({cell[1] / quarters, cell[2] / quarters});
  }
  return means;
}

double ResidualOf(const CellMeans& cell, const Exposure& exposure) {
  return cell.image - exposure.gain * cell.model - exposure.offset;
}

double ScaleOf(const std::vector<CellMeans>& cells, const Exposure& exposure) {
  std::vector<double> magnitudes;
  for (const CellMeans& cell : cells) magnitudes.push_back(std::abs(ResidualOf(cell, exposure)));
  const double found = kSigmasPerMedian * Quantile(std::move(magnitudes), 0.5);
  const auto count = static_cast<double>(cells.size());
  const double variance =
      (count * found * found + kExpectedCells * kExpectedCellSigma * kExpectedCellSigma) /
      (count + kExpectedCells);
  return std::max(std::sqrt(variance), kMinCellSigma);
}

// Of Geman and McClure: 1 at 0, a quarter at kWeightScale sigmas.
double WeightOf(double in_sigmas) {
  const double root = 1 / (1 + in_sigmas * in_sigmas / (kWeightScale * kWeightScale));
  return root * root;
}

// The weighted normal equations of gain and offset, with the prior; a jump of the exposure is an
// outlier of the prior.
Exposure FitExposure(const std::vector<CellMeans>& cells, const Exposure& at, double sigma,
                     const Exposure& before) {
  const double prior = WeightOf((at.gain - before.gain) / kGainPrior) / (kGainPrior * kGainPrior);
  double mm = prior;
  double mi = prior * before.gain;
  double ones = 1 / (kOffsetPrior * kOffsetPrior);
  double m = 0;
  double i = 0;
  const double share = std::min(1.0, kMaxIndependentCells / static_cast<double>(cells.size()));
  for (const CellMeans& cell : cells) {
    const double weight = share * WeightOf(ResidualOf(cell, at) / sigma) / (sigma * sigma);
    mm += weight * cell.model * cell.model;
    mi += weight * cell.model * cell.image;
    ones += weight;
    m += weight * cell.model;
    i += weight * cell.image;
  }
  const double determinant = mm * ones - m * m;
  return {(mi * ones - m * i) / determinant, (mm * i - m * mi) / determinant};
}

// Clipped values stay; table per value of 8 bits.
std::array<std::uint8_t, 256> TableOf(const Exposure& exposure) {
  std::array<std::uint8_t, 256> table{};
  for (std::size_t value = 0; value < table.size(); ++value) {
    const double corrected = (static_cast<double>(value) - exposure.offset) / exposure.gain;
    table[value] = static_cast<std::uint8_t>(std::lround(std::clamp(corrected, 0.0, 255.0)));
  }
  table.front() = 0;
  table.back() = 255;
  return table;
}

}  // namespace

std::uint32_t ExposureCellSize_px(std::uint32_t width_px) {
  return std::max((width_px + kExposureCellsPerRow - 1) / kExposureCellsPerRow,
                  kMinExposureCell_px);
}

std::uint32_t NumExposureCells(std::uint32_t width_px, std::uint32_t height_px) {
  const std::uint32_t cell_px = ExposureCellSize_px(width_px);
  return kExposureCellsPerRow * ((height_px + cell_px - 1) / cell_px);
}

std::vector<std::uint32_t> ExposureSample(std::span<const std::uint32_t> blocks,
                                          std::uint32_t num_cells) {
  // The errors of a mean over so many are below half a grey value, kMinCellSigma, where those of
  // single surfels are below eight.
  constexpr std::uint64_t kWantedPerCell = std::uint64_t{4} * kMinSurfelsPerCell;
  const std::uint64_t num_surfels = std::uint64_t{blocks.size()} * kSurfelsPerBlock;
  const std::uint64_t wanted = kWantedPerCell * num_cells;
  if (num_surfels <= wanted) return {blocks.begin(), blocks.end()};
  // The fractional parts of multiples of the golden ratio are spread evenly (Weyl), whatever period
  // the list has.
  constexpr std::uint32_t kGoldenRatio = 0x9E3779B9U;  // in 1/2^32, without its whole part
  const auto limit = static_cast<std::uint32_t>((wanted << 32U) / num_surfels);
  std::vector<std::uint32_t> sample;
  for (std::uint32_t i = 0; i < blocks.size(); ++i) {
    if (i * kGoldenRatio < limit) sample.push_back(blocks[i]);
  }
  return sample;
}

Exposure EstimateExposure(std::span<const ExposureCell> cells, const Exposure& before) {
  const std::vector<CellMeans> means = MeansOf(cells);
  if (means.empty()) return {before.gain, 0};
  // From the median of the ratios, which half of the cells may spoil.
  std::vector<double> ratios;
  for (const CellMeans& cell : means) ratios.push_back(cell.image / std::max(cell.model, 1.0));
  Exposure exposure = {Quantile(std::move(ratios), 0.5), 0};
  const double first_scale = kFirstScale * ScaleOf(means, exposure);
  for (int fit = 0; fit < kMaxFits; ++fit) {
    const double scale = ScaleOf(means, exposure);
    const double tightened = std::ldexp(first_scale, -fit);
    const Exposure next = FitExposure(means, exposure, std::max(scale, tightened), before);
    const bool is_last = scale > tightened && std::abs(next.gain - exposure.gain) < kConverged;
    exposure = next;
    if (is_last) break;
  }
  const bool is_possible = exposure.gain >= 1 / kMaxGain && exposure.gain <= kMaxGain;
  return is_possible ? exposure : Exposure{before.gain, 0};
}

std::vector<std::uint32_t> CorrectedColours(const cv::Mat& bgr, const Exposure& exposure) {
  const std::array<std::uint8_t, 256> table = TableOf(exposure);
  std::vector<std::uint32_t> colours;
  colours.reserve(bgr.total());
  for (int y = 0; y < bgr.rows; ++y) {
    const auto* row = bgr.ptr<cv::Vec3b>(y);
    for (int x = 0; x < bgr.cols; ++x) {
      colours.push_back(static_cast<std::uint32_t>(table[row[x][2]]) |
                        static_cast<std::uint32_t>(table[row[x][1]]) << 8 |
                        static_cast<std::uint32_t>(table[row[x][0]]) << 16);
    }
  }
  return colours;
}

}  // namespace mono3d
