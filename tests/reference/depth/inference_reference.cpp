// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "reference/depth/inference_reference.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace mono3d::reference {
namespace {

int Width(LevelSize size) { return static_cast<int>(size.width_px); }
int Height(LevelSize size) { return static_cast<int>(size.height_px); }

std::size_t At(LevelSize size, int x, int y) {
  return static_cast<std::size_t>(y * Width(size) + x);
}

bool IsIn(LevelSize size, int x, int y) {
  return x >= 0 && y >= 0 && x < Width(size) && y < Height(size);
}

const std::array<float, 4>& CellOf(const InferenceMap& cells, LevelSize size, int x, int y) {
  return cells[static_cast<std::size_t>(y / 4 * ((Width(size) + 3) / 4) + x / 4)];
}

bool IsSky(const InferenceMap& cells, LevelSize size, int x, int y) {
  return CellOf(cells, size, x, y)[3] < 0;
}

// A plane that is believed as a whole, whose confidence is one less.
bool IsBelieved(const std::array<float, 4>& cell) { return cell[3] > 1; }

std::array<float, 4> PackTexel(double a, double b, double c, double d) {
  return {static_cast<float>(a), static_cast<float>(b), static_cast<float>(c),
          static_cast<float>(d)};
}

std::array<double, 4> ReadTexel(const std::array<float, 4>& texel) {
  return {double(texel[0]), double(texel[1]), double(texel[2]), double(texel[3])};
}

double ConductanceOf(double grey, double other) {
  const double edges = (grey - other) / 6;
  return std::max(1 / ((1 + edges * edges) * (1 + edges * edges)), 1e-3);
}

}  // namespace

InferenceMap InferenceData(LevelSize size, const std::vector<float>& depth,
                           const FilteredDepth& estimates, const cv::Mat& halved,
                           const InferenceMap& cells) {
  InferenceMap data;
  const LevelSize half = size.Halved();
  for (int y = 0; y < Height(half); ++y) {
    for (int x = 0; x < Width(half); ++x) {
      double weights = 0, depths = 0, confidences = 0;
      bool any_textured = false;
      for (const auto& [dx, dy] : {std::array{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
        if (!IsIn(size, 2 * x + dx, 2 * y + dy) || IsSky(cells, size, 2 * x, 2 * y)) continue;
        const std::size_t pixel = At(size, 2 * x + dx, 2 * y + dy);
        const bool textured = depth[pixel] > 0;
        any_textured = any_textured || textured;
        if (estimates.inverse_depth[pixel] <= 0) continue;
        const double confidence = double(estimates.confidence[pixel]);
        const double weight = textured ? 0.3 + 4 * confidence : 0.05;
        weights += weight;
        depths += weight * double(estimates.inverse_depth[pixel]);
        confidences += weight * (textured ? confidence : 0.25 * confidence);
      }
      const std::array<double, 4> cell = ReadTexel(CellOf(cells, size, 2 * x, 2 * y));
      if (cell[3] > 0 && !any_textured) {
        const double from_middle_x = 2 * x + 0.5 - (2 * x / 4 * 4 + 1.5);
        const double from_middle_y = 2 * y + 0.5 - (2 * y / 4 * 4 + 1.5);
        weights = 1;
        depths = cell[0] + from_middle_x * cell[1] + from_middle_y * cell[2];
        confidences = cell[3] - (IsBelieved(CellOf(cells, size, 2 * x, 2 * y)) ? 1 : 0);
      }
      const double share = weights > 0 ? 1 / weights : 0;
      data.push_back(PackTexel(share * depths, weights, share * confidences,
                               double(halved.at<std::uint8_t>(y, x))));
    }
  }
  return data;
}

InferenceMap InferenceHalve(LevelSize size, const InferenceMap& fine) {
  InferenceMap coarse;
  const LevelSize half = size.Halved();
  for (int y = 0; y < Height(half); ++y) {
    for (int x = 0; x < Width(half); ++x) {
      double weights = 0, depths = 0, confidences = 0, greys = 0, count = 0;
      for (const auto& [dx, dy] : {std::array{0, 0}, {1, 0}, {0, 1}, {1, 1}}) {
        if (!IsIn(size, 2 * x + dx, 2 * y + dy)) continue;
        const auto one = ReadTexel(fine[At(size, 2 * x + dx, 2 * y + dy)]);
        weights += one[1];
        depths += one[1] * one[0];
        confidences += one[1] * one[2];
        greys += one[3];
        count += 1;
      }
      const double share = weights > 0 ? 1 / weights : 0;
      coarse.push_back(PackTexel(share * depths, weights, share * confidences, greys / count));
    }
  }
  return coarse;
}

InferenceMap InferenceExpand(LevelSize coarse_size, LevelSize size, const InferenceMap& coarse,
                             const InferenceMap& data) {
  InferenceMap state;
  for (int y = 0; y < Height(size); ++y) {
    for (int x = 0; x < Width(size); ++x) {
      const double at_x = (x + 0.5) / 2 - 0.5;
      const double at_y = (y + 0.5) / 2 - 0.5;
      cv::Vec2d value(0, 0);
      for (const int row : {int(std::floor(at_y)), int(std::floor(at_y)) + 1}) {
        for (const int column : {int(std::floor(at_x)), int(std::floor(at_x)) + 1}) {
          const auto one =
              ReadTexel(coarse[At(coarse_size, std::clamp(column, 0, Width(coarse_size) - 1),
                                  std::clamp(row, 0, Height(coarse_size) - 1))]);
          const double weight = (1 - std::abs(at_x - column)) * (1 - std::abs(at_y - row));
          value += weight * cv::Vec2d(one[0], one[1]);
        }
      }
      state.push_back(PackTexel(value[0], value[1], double(data[At(size, x, y)][3]), 0));
    }
  }
  return state;
}

InferenceMap InferenceRelax(LevelSize size, float leak, const InferenceMap& data,
                            const InferenceMap& before) {
  InferenceMap after;
  for (int y = 0; y < Height(size); ++y) {
    for (int x = 0; x < Width(size); ++x) {
      const auto own = ReadTexel(data[At(size, x, y)]);
      double weights = own[1], depths = own[1] * own[0], confidences = own[1] * own[2];
      for (const auto& [dx, dy] : {std::array{-1, 0}, {1, 0}, {0, -1}, {0, 1}}) {
        if (!IsIn(size, x + dx, y + dy)) continue;
        const auto other = ReadTexel(before[At(size, x + dx, y + dy)]);
        const double weight = ConductanceOf(own[3], other[2]);
        weights += weight;
        depths += weight * other[0];
        confidences += weight * other[1];
      }
      after.push_back(PackTexel(weights > 0 ? depths / weights : 0,
                                confidences / (weights + double(leak)), own[3], 0));
    }
  }
  return after;
}

FilteredDepth Inference(const InferenceParams& params, const std::vector<float>& depth,
                        const std::vector<float>& winners, const InferenceMap& state,
                        const cv::Mat& grey, const InferenceMap& cells,
                        const SourceProjections& projections) {
  const LevelSize size{params.width_px, params.height_px};
  const LevelSize half = size.Halved();
  FilteredDepth inferred;
  for (int y = 0; y < Height(size); ++y) {
    for (int x = 0; x < Width(size); ++x) {
      const double at_x = (x + 0.5) / 2 - 0.5;
      const double at_y = (y + 0.5) / 2 - 0.5;
      double weights = 0, depths = 0, confidences = 0;
      for (const int row : {int(std::floor(at_y)), int(std::floor(at_y)) + 1}) {
        for (const int column : {int(std::floor(at_x)), int(std::floor(at_x)) + 1}) {
          const auto one = ReadTexel(state[At(half, std::clamp(column, 0, Width(half) - 1),
                                              std::clamp(row, 0, Height(half) - 1))]);
          const double weight = (1 - std::abs(at_x - column)) * (1 - std::abs(at_y - row)) *
                                ConductanceOf(double(grey.at<std::uint8_t>(y, x)), one[2]);
          weights += weight;
          depths += weight * one[0];
          confidences += weight * one[1];
        }
      }
      const double w = depths / weights;
      std::vector<double> differences = {1e30, 1e30};
      for (const auto& [dx, dy] : {std::array{0, 0}, {-2, 0}, {2, 0}, {0, -2}, {0, 2}}) {
        if (!IsIn(size, x + dx, y + dy)) continue;
        const int level = static_cast<int>(params.winner_level);
        const LevelSize of_winners{params.winner_width_px, 0};
        const double winner =
            std::abs(double(winners[At(of_winners, (x + dx) >> level, (y + dy) >> level)]));
        if (winner > 0)
          differences.push_back(std::abs(w - winner) / double(params.inverse_depth_step));
      }
      std::sort(differences.begin(), differences.end());
      const auto& cell = CellOf(cells, size, x, y);
      const double difference = IsBelieved(cell) ? std::min(differences[1], 1.0) : differences[1];
      const bool is_matched_coarsely = cell[3] == 0 && cell[1] > 0;
      const double from_coarse =
          is_matched_coarsely ? std::abs(w - double(cell[0])) / double(cell[1]) : 1e30;
      int num_views = 0;
      for (const SourceProjection& source : projections) {
        const Eigen::Vector3d at = source.A * Eigen::Vector3d(x, y, 1) + w * source.b;
        const Eigen::Vector2d u = at.hnormalized();
        const bool is_visible = at.z() > 0 && u.x() >= 0 && u.y() >= 0 && u.x() < Width(size) - 1 &&
                                u.y() < Height(size) - 1 && source.bounds.Contain(u) &&
                                source.reference.Contain({x, y});
        num_views += is_visible ? 1 : 0;
      }
      const bool is_matched = depth[At(size, x, y)] > 0;
      const bool is_guess =
          difference <= double(params.max_difference) && num_views >= int(params.min_views);
      const bool is_coarse =
          from_coarse <= double(params.max_difference) && num_views >= int(params.min_coarse_views);
      const bool is_inferred =
          !is_matched && w > 0 && !IsSky(cells, size, x, y) && (is_guess || is_coarse);
      inferred.inverse_depth.push_back(is_matched    ? 1 / depth[At(size, x, y)]
                                       : is_inferred ? static_cast<float>(w)
                                                     : 0.F);
      const double guessed = is_guess ? confidences / weights / (1 + difference * difference) : 0;
      const double coarsely = is_coarse ? double(cell[2]) / (1 + from_coarse * from_coarse) : 0;
      const double confidence = std::clamp(std::max(guessed, coarsely), 0.004, 0.125);
      inferred.confidence.push_back(
          is_inferred ? static_cast<float>(is_coarse ? -confidence : confidence) : 0.F);
    }
  }
  return inferred;
}

}  // namespace mono3d::reference
