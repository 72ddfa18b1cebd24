// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "products/triangle_views.h"

#include <Eigen/Sparse>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace mono3d {
namespace {

constexpr float kDarkest = 16;     // of 255; below, offsets and noise are as large as the value
constexpr float kBrightest = 245;  // above, values are clipped

bool IsBetter(const TriangleView& a, const TriangleView& b) {
  return std::pair(a.is_clear, a.area_px) > std::pair(b.is_clear, b.area_px);
}

float MedianLevel(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// The logarithm of one channel of a triangle in a view, where it tells anything.
struct Brightness {
  std::size_t view = 0;
  float logarithm = 0;
};

std::vector<Brightness> BrightnessesOf(const TriangleMesh& mesh, const TriangleViews& views,
                                       std::size_t num_views, std::size_t triangle, int channel) {
  std::vector<Brightness> all;
  const auto add = [&](std::size_t view, float value) {
    if (value >= kDarkest && value <= kBrightest) all.push_back({view, std::log(value)});
  };
  for (const TriangleView& view : views.Of(triangle)) {
    add(view.view, view.colour.at(static_cast<std::size_t>(channel)));
  }
  if (!all.empty()) {
    float sum = 0;
    for (const std::uint32_t corner : mesh.triangles[triangle]) {
      sum += mesh.colours[corner].at(static_cast<std::size_t>(2 - channel));  // red comes first
    }
    add(num_views, sum / 3);
  }
  return all;
}

// Normal equations of log gains: the sum over pairs of views of
// weight * (gain_a - gain_b + log a - log b)^2.
struct PairSums {
  double weight = 0;
  double difference = 0;  // of the logarithms, times the weight
};

Eigen::VectorXd SolveLogGains(const std::map<std::pair<std::size_t, std::size_t>, PairSums>& pairs,
                              std::size_t num_views) {
  // The mesh's own colours, number num_views, have the gain 1 and are no unknown.
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd right = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(num_views));
  const auto add = [&](std::size_t row, std::size_t column, double value) {
    entries.emplace_back(static_cast<int>(row), static_cast<int>(column), value);
  };
  for (std::size_t i = 0; i < num_views; ++i) add(i, i, 1e-3);  // a view that shares nothing: 1
  for (const auto& [views, sums] : pairs) {
    const auto [a, b] = views;
    if (a < num_views) {
      add(a, a, sums.weight);
      right[static_cast<Eigen::Index>(a)] -= sums.difference;
    }
    if (b < num_views) {
      add(b, b, sums.weight);
      right[static_cast<Eigen::Index>(b)] += sums.difference;
    }
    if (a < num_views && b < num_views) {
      add(a, b, -sums.weight);
      add(b, a, -sums.weight);
    }
  }
  Eigen::SparseMatrix<double> matrix(static_cast<Eigen::Index>(num_views),
                                     static_cast<Eigen::Index>(num_views));
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(matrix);
  return solver.solve(right);
}

}  // namespace

std::size_t TriangleViews::Find(std::size_t triangle, std::uint32_t view) const {
  const auto of = Of(triangle);
  return static_cast<std::size_t>(std::ranges::find(of, view, &TriangleView::view) - of.begin());
}

void TriangleViews::Add(std::size_t triangle, const TriangleView& view) {
  auto& of = views_[triangle];
  std::uint8_t& count = counts_[triangle];
  const auto end = of.begin() + count;
  const auto place = std::lower_bound(of.begin(), end, view, IsBetter);
  if (place == of.end()) return;
  const auto last = count < kMost ? end : end - 1;
  std::move_backward(place, last, last + 1);
  *place = view;
  if (count < kMost) ++count;
}

void TriangleViews::DropOutliers(std::span<const Eigen::Vector3f> gains) {
  // Noise, and what is left of the exposure: differences of fewer grey levels tell nothing.
  constexpr float kNoise = 6;
  constexpr std::size_t kFewest = 4;  // of fewer the majority is not known
  for (std::size_t triangle = 0; triangle < views_.size(); ++triangle) {
    auto& of = views_[triangle];
    const std::size_t count = counts_[triangle];
    if (count < kFewest) continue;
    std::array<bool, kMost> is_outlier = {};
    for (std::size_t channel = 0; channel < 3; ++channel) {
      std::vector<float> values(count);
      for (std::size_t i = 0; i < count; ++i) {
        values[i] = gains[of.at(i).view][static_cast<int>(channel)] * of.at(i).colour.at(channel);
      }
      std::vector<float> sorted = values;
      const float median = MedianLevel(sorted);
      for (float& value : sorted) value = std::abs(value - median);
      const float sigma = std::max(kNoise, 1.4826F * MedianLevel(sorted));
      for (std::size_t i = 0; i < count; ++i) {
        if (std::abs(values[i] - median) > 3 * sigma) is_outlier.at(i) = true;
      }
    }
    std::size_t kept = 0;
    for (std::size_t i = 0; i < count; ++i) {
      if (!is_outlier.at(i)) of.at(kept++) = of.at(i);
    }
    if (kept > 0) counts_[triangle] = static_cast<std::uint8_t>(kept);
  }
}

void TriangleViews::DropUnclear() {
  for (std::size_t triangle = 0; triangle < views_.size(); ++triangle) {
    const auto of = Of(triangle);
    const auto num_clear = std::ranges::count_if(of, &TriangleView::is_clear);
    if (num_clear > 0) counts_[triangle] = static_cast<std::uint8_t>(num_clear);
  }
}

std::vector<Eigen::Vector3f> EstimateGains(const TriangleMesh& mesh, const TriangleViews& views,
                                           std::size_t num_views) {
  // Views of one surface differ by a tenth or so; what differs by much more shows something else.
  constexpr double kScale = .1;
  constexpr int kRounds = 4;
  std::vector<Eigen::Vector3f> gains(num_views + 1, Eigen::Vector3f::Ones());
  for (int channel = 0; channel < 3; ++channel) {
    Eigen::VectorXd log_gains;
    for (int round = 0; round < kRounds; ++round) {
      std::map<std::pair<std::size_t, std::size_t>, PairSums> pairs;
      const auto gain_of = [&](std::size_t view) {
        return round == 0 || view == num_views ? 0 : log_gains[static_cast<Eigen::Index>(view)];
      };
      for (std::size_t triangle = 0; triangle < views.num_triangles(); ++triangle) {
        const auto all = BrightnessesOf(mesh, views, num_views, triangle, channel);
        for (std::size_t i = 0; i < all.size(); ++i) {
          for (std::size_t j = i + 1; j < all.size(); ++j) {
            const auto& [a, b] =
                all[i].view < all[j].view ? std::tie(all[i], all[j]) : std::tie(all[j], all[i]);
            const double difference = a.logarithm - b.logarithm;
            const double residual = (difference + gain_of(a.view) - gain_of(b.view)) / kScale;
            const double weight = round == 0 ? 1 : 1 / (1 + residual * residual);  // Cauchy
            PairSums& sums = pairs[{a.view, b.view}];
            sums.weight += weight;
            sums.difference += weight * difference;
          }
        }
      }
      log_gains = SolveLogGains(pairs, num_views);
    }
    for (std::size_t view = 0; view < num_views; ++view) {
      gains[view][channel] =
          static_cast<float>(std::exp(log_gains[static_cast<Eigen::Index>(view)]));
    }
  }
  return gains;
}

}  // namespace mono3d
