// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "image/inverse_depth_surface.h"

#include <Eigen/SparseCholesky>
#include <algorithm>
#include <cmath>
#include <utility>

#include "core/clamped_int.h"
#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

// Cells along the longer side: some ten points in each, of the thousand or so that a keyframe has.
constexpr int kNumCells = 16;
// A point weighs 1. To bend by a difference from a cell to the next weighs as much as a point that
// is off by that difference: bends narrower than a cell or two are not followed.
constexpr double kBendingWeight = 1;
// So does to tilt, but a thousand times less: just where the points do not tell a tilt.
constexpr double kTiltWeight = 1e-3;
constexpr int kNumRounds = 4;  // the first one with all weights 1

// Weights of points by Cauchy's function of their residuals. The scale is the residuals' own, by
// their median, but no less than 1 % of a typical inverse depth: of the way of some pixels that a
// shutter makes of it, that is a few hundredths.
std::vector<double> CauchyWeights(const std::vector<double>& residuals, double typical) {
  constexpr double kScale = 2 * 1.4826;  // two standard deviations of a normal distribution
  constexpr double kMinScale = 0.01;
  std::vector<double> sizes;
  for (const double residual : residuals) sizes.push_back(std::abs(residual));
  const double scale = std::max(kScale * Median(sizes), kMinScale * typical);
  std::vector<double> weights;
  for (const double size : sizes) weights.push_back(1 / (1 + (size / scale) * (size / scale)));
  return weights;
}

}  // namespace

// Weighted least squares for the nodes: each term is a sum of nodes that should have some value.
class InverseDepthSurface::Fit {
 public:
  explicit Fit(const InverseDepthSurface& surface)
      : surface_(surface), right_(Eigen::VectorXd::Zero(NumNodes())) {
    const int columns = surface.num_columns_;
    for (int y = 0; y < surface.num_rows_; ++y) {
      for (int x = 0; x < columns; ++x) {
        const int node = y * columns + x;
        const bool has_right = x + 1 < columns;
        const bool has_below = y + 1 < surface.num_rows_;
        if (has_right) AddFlatness(node, 1, x > 0);
        if (has_below) AddFlatness(node, columns, y > 0);
        if (has_right && has_below) {
          // Twice, as in the bending energy of a thin plate.
          Add({{node, 1}, {node + 1, -1}, {node + columns, -1}, {node + columns + 1, 1}},
              2 * kBendingWeight);
        }
      }
    }
  }

  void AddSample(const Interpolation& at, double value, double weight) {
    std::vector<Coefficient> sum;
    for (int i = 0; i < 4; ++i) sum.emplace_back(at.node[i], at.weight[i]);
    Add(sum, weight);
    for (const auto& [node, factor] : sum) right_[node] += weight * factor * value;
  }

  std::vector<double> Solve() const {
    Eigen::SparseMatrix<double> normal(NumNodes(), NumNodes());
    normal.setFromTriplets(normal_.begin(), normal_.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(normal);
    const Eigen::VectorXd nodes = solver.solve(right_);
    return {nodes.begin(), nodes.end()};
  }

 private:
  using Coefficient = std::pair<int, double>;

  Eigen::Index NumNodes() const { return static_cast<Eigen::Index>(surface_.nodes_.size()); }

  // Towards the next node `step` on; `is_inner`: there is one before as well.
  void AddFlatness(int node, int step, bool is_inner) {
    Add({{node, -1}, {node + step, 1}}, kTiltWeight);
    if (is_inner) Add({{node - step, 1}, {node, -2}, {node + step, 1}}, kBendingWeight);
  }

  // That the sum should be 0; the lower triangle alone is used.
  void Add(const std::vector<Coefficient>& sum, double weight) {
    for (const auto& [a, factor_a] : sum) {
      for (const auto& [b, factor_b] : sum) {
        if (a >= b) normal_.emplace_back(a, b, weight * factor_a * factor_b);
      }
    }
  }

  const InverseDepthSurface& surface_;
  std::vector<Eigen::Triplet<double>> normal_;
  Eigen::VectorXd right_;
};

InverseDepthSurface::InverseDepthSurface(int width, int height,
                                         const std::vector<InverseDepthSample>& samples)
    : cell_px_(std::max(1.0, (std::max(width, height) - 1.0) / kNumCells)) {
  const auto num_nodes = [&](int size) {
    return std::max(1, static_cast<int>(std::ceil((size - 1) / cell_px_))) + 1;
  };
  num_columns_ = num_nodes(width);
  num_rows_ = num_nodes(height);
  nodes_.resize(static_cast<std::size_t>(num_columns_) * static_cast<std::size_t>(num_rows_));

  std::vector<Interpolation> places;
  std::vector<double> values;
  for (const InverseDepthSample& sample : samples) {
    places.push_back(InterpolationAt(sample.pixel));
    values.push_back(sample.inverse_depth);
  }
  const double typical = Median(values);
  const Fit without_samples(*this);
  std::vector<double> weights(samples.size(), 1);
  for (int round = 0; round < kNumRounds; ++round) {
    Fit fit = without_samples;
    for (std::size_t i = 0; i < places.size(); ++i) fit.AddSample(places[i], values[i], weights[i]);
    nodes_ = fit.Solve();
    std::vector<double> residuals;
    for (std::size_t i = 0; i < places.size(); ++i) {
      residuals.push_back(values[i] - Unlimited(places[i]));
    }
    weights = CauchyWeights(residuals, typical);
  }
  for (std::size_t i = 0; i < places.size(); ++i) {
    constexpr double kAgrees = 0.5;
    constexpr double kFurther = 1.5;  // that a surface goes on to come nearer beyond its points
    if (weights[i] > kAgrees) largest_ = std::max(largest_, kFurther * values[i]);
  }
}

double InverseDepthSurface::At(const Eigen::Vector2d& pixel) const {
  if (nodes_.size() == 1) return nodes_.front();
  return std::clamp(Unlimited(InterpolationAt(pixel)), 0.0, largest_);
}

// Outside the nodes the last cell goes on.
InverseDepthSurface::Interpolation InverseDepthSurface::InterpolationAt(
    const Eigen::Vector2d& pixel) const {
  const auto cell = [&](double position, int num_nodes) {
    return ClampedInt(position, 0, num_nodes - 2);
  };
  const Eigen::Vector2d position = pixel / cell_px_;
  const int x = cell(position.x(), num_columns_);
  const int y = cell(position.y(), num_rows_);
  const double right = position.x() - x;
  const double below = position.y() - y;
  const int node = y * num_columns_ + x;
  return {{node, node + 1, node + num_columns_, node + num_columns_ + 1},
          {(1 - right) * (1 - below), right * (1 - below), (1 - right) * below, right * below}};
}

double InverseDepthSurface::Unlimited(const Interpolation& at) const {
  double sum = 0;
  for (int i = 0; i < 4; ++i) sum += at.weight[i] * nodes_[static_cast<std::size_t>(at.node[i])];
  return sum;
}

}  // namespace mono3d
