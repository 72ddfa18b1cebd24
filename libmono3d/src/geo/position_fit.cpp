// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geo/position_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

namespace mono3d {
namespace {

using Eigen::Vector3d;
using Increment = MapPlacement::Increment;
using Information = Eigen::Matrix<double, 8, 8>;
// The columns of the increments, then the residual.
using Rows = Eigen::Matrix<double, Eigen::Dynamic, 9>;

constexpr int kNumIncrements = 8;
constexpr int kClock = 7;

Eigen::Matrix3d CrossMatrix(const Vector3d& v) {
  Eigen::Matrix3d matrix;
  matrix << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return matrix;
}

// Umeyama 1991 with weights, about the given centres' weighted means.
MapPlacement FitWeighted(const std::vector<PositionPair>& pairs,
                         const std::vector<double>& weights) {
  double sum = 0;
  Vector3d mean_map = Vector3d::Zero();
  Vector3d mean_enu = Vector3d::Zero();
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    sum += weights[i];
    mean_map += weights[i] * pairs[i].p_map;
    mean_enu += weights[i] * pairs[i].p_enu_m;
  }
  mean_map /= sum;
  mean_enu /= sum;
  Eigen::Matrix3d cross = Eigen::Matrix3d::Zero();
  double variance_map = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    const Vector3d p_map = pairs[i].p_map - mean_map;
    cross += weights[i] * (pairs[i].p_enu_m - mean_enu) * p_map.transpose();
    variance_map += weights[i] * p_map.squaredNorm();
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(cross, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Vector3d signs = Vector3d::Ones();
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) signs.z() = -1;
  MapPlacement placement;
  placement.centre_map = mean_map;
  placement.p_enu_m = mean_enu;
  placement.rotation = Eigen::Quaterniond(
      Eigen::Matrix3d(svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose()));
  placement.scale = svd.singularValues().dot(signs) / variance_map;
  return placement;
}

// Rows of the axes east, north, up.
std::array<Rows, 3> Linearise(const std::vector<PositionPair>& pairs, const MapPlacement& placement,
                              const PlacementPriors& priors) {
  const auto num_rows = static_cast<Eigen::Index>(pairs.size());
  std::array<Rows, 3> rows;
  for (Rows& axis : rows) axis = Rows::Zero(num_rows, kNumIncrements + 1);
  const std::vector<Vector3d> residuals = ResidualsOf(pairs, placement, priors.antenna_m);
  for (Eigen::Index i = 0; i < num_rows; ++i) {
    const auto k = static_cast<std::size_t>(i);
    const Vector3d arm =
        placement.rotation * (placement.scale * (pairs[k].p_map - placement.centre_map));
    const Vector3d velocity = placement.rotation * (placement.scale * pairs[k].velocity_map);
    const Eigen::Matrix3d by_rotation = -CrossMatrix(arm);
    for (Eigen::Index axis = 0; axis < 3; ++axis) {
      Rows& target = rows.at(static_cast<std::size_t>(axis));
      target(i, axis) = 1;
      target.block<1, 3>(i, 3) = by_rotation.row(axis);
      target(i, 6) = arm[axis];
      target(i, kClock) = velocity[axis];
      target(i, kNumIncrements) = residuals[k][axis];
    }
  }
  return rows;
}

// Normal equations of rows with unit variances.
struct NormalEquations {
  Information information = Information::Zero();
  Increment gradient = Increment::Zero();
  double sum_squares = 0;  // of the residuals

  void Add(const Eigen::MatrixXd& rows) {
    const auto jacobian = rows.leftCols<kNumIncrements>();
    information += jacobian.transpose() * jacobian;
    gradient += jacobian.transpose() * rows.col(kNumIncrements);
    sum_squares += rows.col(kNumIncrements).squaredNorm();
  }
  void AddScaled(const NormalEquations& other, double weight) {
    information += weight * other.information;
    gradient += weight * other.gradient;
    sum_squares += weight * other.sum_squares;
  }
};

// Of the residuals, after the increment.
double SumSquares(const NormalEquations& equations, const Increment& increment) {
  return std::max(0.0, equations.sum_squares - 2 * increment.dot(equations.gradient) +
                           increment.dot(equations.information * increment));
}

bool IsDetermined(const Information& information) {
  constexpr double kLargestCondition = 1e14;
  const Increment scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Information scaled = scale.asDiagonal() * information * scale.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Information> values(scaled, Eigen::EigenvaluesOnly);
  return values.eigenvalues().minCoeff() * kLargestCondition > values.eigenvalues().maxCoeff();
}

NormalEquations PriorEquations(const MapPlacement& placement, const PlacementPriors& priors) {
  NormalEquations prior;
  if (priors.up) {
    const Vector3d up = placement.rotation * priors.up->up_map;
    Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(2, kNumIncrements + 1);
    rows.block<2, 3>(0, 3) = -CrossMatrix(up).topRows<2>();
    rows.col(kNumIncrements) = -up.head<2>();
    prior.Add(rows / priors.up->sigma_rad);
  }
  // Held: to far less than an image takes.
  constexpr double kHeldSigma_s = 1e-6;
  const double clock_sigma_s =
      priors.clock_offset_sigma_s > 0 ? priors.clock_offset_sigma_s : kHeldSigma_s;
  Eigen::MatrixXd clock = Eigen::MatrixXd::Zero(1, kNumIncrements + 1);
  clock(0, kClock) = 1;
  clock(0, kNumIncrements) = priors.clock_offset_s - placement.clock_offset_s;
  prior.Add(clock / clock_sigma_s);
  if (!priors.has_vertical) {  // its height is what it is called
    Eigen::MatrixXd height = Eigen::MatrixXd::Zero(1, kNumIncrements + 1);
    height(0, 2) = 1;
    constexpr double kUnknownHeight_m = 1e3;
    prior.Add(height / kUnknownHeight_m);
  }
  return prior;
}

// The rows of one group of axes under one shape of the noise, with unit variance.
struct ShapedEquations {
  NoiseShape shape;
  NormalEquations equations;
  double num_rows = 0;
  double sum_log_sigma = 0;
};

std::vector<ShapedEquations> ShapeAxes(std::span<const Rows> axes, std::span<const double> times_s,
                                       const std::vector<bool>& is_used) {
  std::vector<ShapedEquations> shaped;
  for (const NoiseShape& shape : NoiseShapes()) {
    ShapedEquations equations{shape, {}, 0, 0};
    for (const Rows& axis : axes) {
      const WhitenedRows white = Whiten(axis, times_s, is_used, shape.unit);
      equations.equations.Add(white.rows);
      equations.num_rows += static_cast<double>(white.rows.rows());
      equations.sum_log_sigma += white.sum_log_sigma;
    }
    shaped.push_back(std::move(equations));
  }
  return shaped;
}

// Both groups under one pair of shapes: the variances by fixed-point iteration, with an inverse
// gamma prior, and how likely the pair is (restricted likelihood, Patterson and Thompson 1971).
struct Candidate {
  Increment increment = Increment::Zero();
  Information covariance = Information::Zero();
  double horizontal_m = 0, vertical_m = 0;
  double log_weight = 0;
};

class CandidateSolver {
 public:
  CandidateSolver(const NormalEquations& prior, const PlacementPriors& priors)
      : prior_(prior), priors_(priors) {}

  std::optional<Candidate> Solve(const ShapedEquations& horizontal,
                                 const ShapedEquations* vertical) const {
    Candidate candidate;
    double horizontal_variance = Squared(priors_.horizontal_m);
    double vertical_variance = Squared(priors_.vertical_m);
    constexpr int kRounds = 8;
    for (int round = 0; round < kRounds; ++round) {
      NormalEquations all = prior_;
      all.AddScaled(horizontal.equations, 1 / horizontal_variance);
      if (vertical != nullptr) all.AddScaled(vertical->equations, 1 / vertical_variance);
      const Eigen::LDLT<Information> solver(all.information);
      if (solver.info() != Eigen::Success || !IsDetermined(all.information)) return std::nullopt;
      candidate.increment = solver.solve(all.gradient);
      candidate.covariance = solver.solve(Information::Identity());
      candidate.log_weight =
          -solver.vectorD().array().abs().log().sum() / 2 +
          Evidence(horizontal, candidate, priors_.horizontal_m, horizontal_variance);
      if (vertical != nullptr) {
        candidate.log_weight +=
            Evidence(*vertical, candidate, priors_.vertical_m, vertical_variance);
      }
      candidate.log_weight -= PriorCost(candidate.increment);
    }
    candidate.horizontal_m = std::sqrt(horizontal_variance);
    candidate.vertical_m = std::sqrt(vertical_variance);
    return candidate;
  }

 private:
  static double Squared(double value) { return value * value; }

  double PriorCost(const Increment& increment) const { return SumSquares(prior_, increment) / 2; }

  // The logarithm of the likelihood, with the variance integrated out, as it is at `variance` (so
  // one factor of it less than of the density at its most likely value: or shapes of small variance
  // would be preferred), and the next variance.
  double Evidence(const ShapedEquations& shaped, const Candidate& candidate, double typical_m,
                  double& variance) const {
    const double residual = SumSquares(shaped.equations, candidate.increment);
    // Rows that the increments take up.
    const double num_taken =
        (candidate.covariance * shaped.equations.information).trace() / variance;
    const double num_free = std::max(0.0, shaped.num_rows - num_taken);
    const double used_variance = variance;
    variance = (residual + priors_.worth * Squared(typical_m)) / (num_free + priors_.worth);
    return shaped.shape.log_prior - shaped.sum_log_sigma -
           (shaped.num_rows + priors_.worth) / 2 * std::log(used_variance) -
           (residual + priors_.worth * Squared(typical_m)) / (2 * used_variance);
  }

  const NormalEquations& prior_;
  const PlacementPriors& priors_;
};

// The shapes that matter: by how likely they are beside the likeliest.
std::vector<std::size_t> LikelyOnes(const std::vector<double>& log_weights) {
  constexpr double kLeast = 1e-3;
  const double best = *std::ranges::max_element(log_weights);
  std::vector<std::size_t> likely;
  for (std::size_t i = 0; i < log_weights.size(); ++i) {
    if (log_weights[i] > best + std::log(kLeast)) likely.push_back(i);
  }
  return likely;
}

PositionNoise Scaled(const PositionNoise& unit, double sigma_m) {
  return {sigma_m * unit.wander_m, unit.correlation_s, sigma_m * unit.white_m};
}

// The direction in which the cameras spread most, in the axes of the placement.
Vector3d MainDirection(const std::vector<PositionPair>& pairs, const MapPlacement& placement) {
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const PositionPair& pair : pairs) {
    const Vector3d p = pair.p_map - placement.centre_map;
    spread += p * p.transpose();
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(spread);
  return placement.rotation * axes.eigenvectors().col(2);
}

// Turned about `axis` so that `up_map` points up as far as that goes.
MapPlacement TurnedUpright(MapPlacement placement, const Vector3d& axis, const Vector3d& up_map) {
  const Vector3d up = placement.rotation * up_map;
  const Vector3d up_across = up - up.dot(axis) * axis;
  const Vector3d z_across = Vector3d::UnitZ() - axis.z() * axis;
  const double angle = std::atan2(axis.dot(up_across.cross(z_across)), up_across.dot(z_across));
  placement.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(angle, axis)) * placement.rotation;
  return placement;
}

}  // namespace

void MapPlacement::Add(const Increment& increment) {
  p_enu_m += increment.head<3>();
  rotation = (RotationExp(increment.segment<3>(3)) * rotation).normalized();
  scale *= std::exp(increment[6]);
  clock_offset_s += increment[kClock];
}

Similarity MapPlacement::ToSimilarity() const {
  return {scale, Pose(rotation, p_enu_m - rotation * (scale * centre_map))};
}

std::vector<Vector3d> ResidualsOf(const std::vector<PositionPair>& pairs,
                                  const MapPlacement& placement, const Vector3d& antenna_m) {
  std::vector<Vector3d> residuals;
  for (const PositionPair& pair : pairs) {
    const Vector3d antenna = placement.rotation * (pair.R_map_cam * antenna_m);
    residuals.emplace_back(pair.p_enu_m - placement * pair.p_map - antenna);
  }
  return residuals;
}

MapPlacement FitRobustly(const std::vector<PositionPair>& pairs, double typical_m) {
  constexpr int kRounds = 15;
  std::vector<double> weights(pairs.size(), 1);
  MapPlacement placement = FitWeighted(pairs, weights);
  for (int round = 0; round < kRounds; ++round) {
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      const double distance = (pairs[i].p_enu_m - placement * pairs[i].p_map).norm();
      weights[i] = 1 / std::max(distance, typical_m);
    }
    placement = FitWeighted(pairs, weights);
  }
  return placement;
}

MapPlacement RolledUpright(const std::vector<PositionPair>& pairs, const MapPlacement& placement,
                           const Vector3d& up_map, double typical_m, bool has_vertical) {
  const MapPlacement turned = TurnedUpright(placement, MainDirection(pairs, placement), up_map);
  const double distance_m = MeanDistance(pairs, placement, has_vertical);
  const double turned_m = MeanDistance(pairs, turned, has_vertical);
  return turned_m < 1.5 * distance_m + typical_m ? turned : placement;
}

double MeanDistance(const std::vector<PositionPair>& pairs, const MapPlacement& placement,
                    bool has_vertical) {
  double sum = 0;
  for (const PositionPair& pair : pairs) {
    const Vector3d difference = pair.p_enu_m - placement * pair.p_map;
    sum += has_vertical ? difference.norm() : difference.head<2>().norm();
  }
  return pairs.empty() ? 0 : sum / static_cast<double>(pairs.size());
}

std::optional<PlacementFit> FitStep(const std::vector<PositionPair>& pairs,
                                    const std::vector<bool>& is_used, const MapPlacement& placement,
                                    const PlacementPriors& priors) {
  std::vector<double> times_s;
  for (const PositionPair& pair : pairs) times_s.push_back(pair.time_s);
  const std::array<Rows, 3> rows = Linearise(pairs, placement, priors);
  const std::vector<ShapedEquations> horizontal =
      ShapeAxes(std::span(rows).first(2), times_s, is_used);
  const std::vector<ShapedEquations> vertical =
      ShapeAxes(std::span(rows).last(1), times_s, is_used);
  const NormalEquations prior = PriorEquations(placement, priors);
  const CandidateSolver solver(prior, priors);
  const auto solve = [&](std::size_t h, std::size_t v) {
    return solver.Solve(horizontal[h], priors.has_vertical ? &vertical[v] : nullptr);
  };
  // One after the other first: all pairs would be many.
  const auto weights_of = [&](bool is_horizontal, std::size_t other) {
    std::vector<double> log_weights;
    for (std::size_t i = 0; i < horizontal.size(); ++i) {
      const std::optional<Candidate> candidate = is_horizontal ? solve(i, other) : solve(other, i);
      log_weights.push_back(candidate ? candidate->log_weight : -1e300);
    }
    return log_weights;
  };
  const auto best_of = [](const std::vector<double>& weights) {
    return static_cast<std::size_t>(std::ranges::max_element(weights) - weights.begin());
  };
  std::size_t best_vertical = 0;
  if (!solve(0, 0)) return std::nullopt;
  std::vector<double> horizontal_weights = weights_of(true, best_vertical);
  std::vector<double> vertical_weights = {0};
  if (priors.has_vertical) {
    vertical_weights = weights_of(false, best_of(horizontal_weights));
    best_vertical = best_of(vertical_weights);
    horizontal_weights = weights_of(true, best_vertical);
  }
  std::vector<Candidate> candidates;
  PlacementFit fit;
  double best_log_weight = -1e300;
  for (const std::size_t h : LikelyOnes(horizontal_weights)) {
    for (const std::size_t v : LikelyOnes(vertical_weights)) {
      const std::optional<Candidate> candidate = solve(h, v);
      if (!candidate) continue;
      candidates.push_back(*candidate);
      if (candidate->log_weight <= best_log_weight) continue;
      best_log_weight = candidate->log_weight;
      fit.horizontal = Scaled(horizontal[h].shape.unit, candidate->horizontal_m);
      fit.vertical = Scaled(vertical[v].shape.unit, candidate->vertical_m);
    }
  }
  double sum = 0;
  fit.increment.setZero();
  for (Candidate& candidate : candidates) {
    candidate.log_weight = std::exp(candidate.log_weight - best_log_weight);
    sum += candidate.log_weight;
    fit.increment += candidate.log_weight * candidate.increment;
  }
  fit.increment /= sum;
  fit.covariance.setZero();
  for (const Candidate& candidate : candidates) {
    const Increment difference = candidate.increment - fit.increment;
    fit.covariance +=
        candidate.log_weight / sum * (candidate.covariance + difference * difference.transpose());
  }
  return fit;
}

std::optional<double> ExcessOfFit(const std::vector<PositionPair>& pairs,
                                  const std::vector<bool>& is_used, const MapPlacement& placement,
                                  const PlacementPriors& priors, const PositionNoise& horizontal,
                                  const PositionNoise& vertical) {
  std::vector<double> times_s;
  for (const PositionPair& pair : pairs) times_s.push_back(pair.time_s);
  const std::array<Rows, 3> rows = Linearise(pairs, placement, priors);
  NormalEquations equations = PriorEquations(placement, priors);
  double num_rows = 0;
  for (std::size_t axis = 0; axis < (priors.has_vertical ? 3U : 2U); ++axis) {
    const WhitenedRows white =
        Whiten(rows.at(axis), times_s, is_used, axis < 2 ? horizontal : vertical);
    equations.Add(white.rows);
    num_rows += static_cast<double>(white.rows.rows());
  }
  const Eigen::LDLT<Information> solver(equations.information);
  if (solver.info() != Eigen::Success || !IsDetermined(equations.information)) return std::nullopt;
  const Increment increment = solver.solve(equations.gradient);
  return SumSquares(equations, increment) - num_rows;
}

}  // namespace mono3d
