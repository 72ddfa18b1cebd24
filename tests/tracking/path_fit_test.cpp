// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/positions/path_fit.h"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

#include "tracking/positions/drift_estimate.h"
#include "tracking/positions/drift_filter.h"
#include "tracking/positions/position_graph.h"

namespace mono3d::tracking {
namespace {

using Eigen::Vector3d;

constexpr double kStep_m = 4;
constexpr double kSpeed_m_per_s = 8;
constexpr double kUnit_m = 50;  // the map's unit of length

// A flight with slow turns: its keyframes look down, in lengths of the map.
std::vector<Similarity> TruePath(std::size_t num_keyframes) {
  std::vector<Similarity> path;
  Vector3d p_m(100, -50, 60);
  for (std::size_t i = 0; i < num_keyframes; ++i) {
    const double heading = 0.6 * std::sin(0.01 * static_cast<double>(i));
    const Eigen::Quaterniond down = RotationExp({std::numbers::pi, 0, 0});
    path.emplace_back(kUnit_m, Pose(RotationExp({0, 0, heading}) * down, p_m));
    p_m += kStep_m * Vector3d(std::cos(heading), std::sin(heading), 0.02);
  }
  return path;
}

class Random {
 public:
  explicit Random(unsigned seed) : engine_(seed) {}
  double Normal() { return normal_(engine_); }
  Vector3d Vector() {
    const double x = Normal();
    const double y = Normal();
    return {x, y, Normal()};
  }
  bool IsBelow(double share) { return uniform_(engine_) < share; }

 private:
  std::mt19937 engine_;
  std::normal_distribution<double> normal_;
  std::uniform_real_distribution<double> uniform_;
};

struct ErrorsOfFlight {
  PathNoise noise;
  double period_s = 1;  // of the positions
  double outlier_share = 0;
  // That every edge has, as with a calibration that is wrong.
  Vector3d bias_rad = Vector3d::Zero();
  double bias_log_scale = 0;
};

struct DriftingFlight {
  std::vector<Similarity> truth;
  PositionedPath path;
  std::vector<char> is_outlier;
};

// The path as a tracker that drifts has it, begun at the truth, and its positions.
DriftingFlight FlyWithDrift(std::size_t num_keyframes, const ErrorsOfFlight& errors,
                            unsigned seed) {
  Random random(seed);
  DriftingFlight flight;
  flight.truth = TruePath(num_keyframes);
  flight.path.typical_horizontal_m = 1.5;
  flight.path.typical_vertical_m = 1.5;
  constexpr double kDepth = 60 / kUnit_m;
  flight.path.drift = {3e-4, 3e-4};
  flight.path.shift = 3e-4 * kDepth;
  flight.path.S_metric_kf = {flight.truth.front()};
  const PathDrift& drift = errors.noise.drift;
  for (std::size_t i = 1; i < num_keyframes; ++i) {
    const Vector3d turn = errors.bias_rad + drift.rotation_rad * random.Vector();
    const Vector3d shift = drift.rotation_rad * kDepth * random.Vector();
    const Similarity error(std::exp(errors.bias_log_scale + drift.log_scale * random.Normal()),
                           Pose(RotationExp(turn), shift));
    const Similarity S_b_a = error * (flight.truth[i].Inverse() * flight.truth[i - 1]);
    flight.path.edges.push_back({i - 1, i, S_b_a});
    flight.path.S_metric_kf.push_back(flight.path.S_metric_kf.back() * S_b_a.Inverse());
  }
  Vector3d wander = errors.noise.horizontal.wander_m * random.Vector();
  const double kept = std::exp(-errors.period_s / errors.noise.horizontal.correlation_s);
  double along_m = 0;
  for (double time_s = 0;; time_s += errors.period_s) {
    along_m = kSpeed_m_per_s * time_s;
    const auto node = static_cast<std::size_t>(std::lround(along_m / kStep_m));
    if (node >= num_keyframes) break;
    wander = kept * wander +
             std::sqrt(1 - kept * kept) * errors.noise.horizontal.wander_m * random.Vector();
    const bool is_outlier = random.IsBelow(errors.outlier_share);
    const Vector3d p_kf(0.01, -0.02, 0.03);
    Vector3d p_m =
        flight.truth[node] * p_kf + wander + errors.noise.horizontal.white_m * random.Vector();
    if (is_outlier) p_m += Vector3d(25, -30, 20);
    flight.path.positions.push_back({time_s, node, p_kf, p_m});
    flight.is_outlier.push_back(is_outlier ? 1 : 0);
  }
  return flight;
}

double RmsError(const std::vector<Similarity>& path, const std::vector<Similarity>& truth) {
  double sum = 0;
  for (std::size_t i = 0; i < path.size(); ++i) {
    sum += (path[i].pose().translation() - truth[i].pose().translation()).squaredNorm();
  }
  return std::sqrt(sum / static_cast<double>(path.size()));
}

// Root of the mean square over stretches of 100 m, each brought onto the truth by a similarity.
double RmsLocalError(const std::vector<Similarity>& path, const std::vector<Similarity>& truth) {
  constexpr auto kNum = static_cast<std::size_t>(100 / kStep_m);
  double sum = 0;
  double count = 0;
  for (std::size_t first = 0; first + kNum <= path.size(); first += kNum) {
    std::vector<Vector3d> p;
    std::vector<Vector3d> p_true;
    for (std::size_t i = first; i < first + kNum; ++i) {
      p.push_back(path[i].pose().translation());
      p_true.push_back(truth[i].pose().translation());
    }
    const Similarity onto = FitSimilarity(p, p_true);
    for (std::size_t i = 0; i < kNum; ++i) sum += (onto * p[i] - p_true[i]).squaredNorm();
    count += kNum;
  }
  return std::sqrt(sum / count);
}

const PathNoise kWandering = {{3e-4, 6e-4}, {3, 60, 0.1}, {3, 60, 0.1}};
const PathNoise kWhite = {{3e-4, 6e-4}, {0, 1, 1}, {0, 1, 1}};

// The same Gaussian model written out: all unknowns of a small path in one dense system.
class DenseModel {
 public:
  DenseModel(const PositionedPath& path, const PathNoise& noise) : path_(path) {
    const auto num = static_cast<Eigen::Index>(3 * path.positions.size());
    Vector3d middle_m = Vector3d::Zero();
    for (const Similarity& S : path.S_metric_kf) middle_m += S.pose().translation();
    middle_m /= static_cast<double>(path.S_metric_kf.size());
    residual = Eigen::VectorXd::Zero(num);
    covariance = Eigen::MatrixXd::Zero(num, num);
    Eigen::MatrixXd start = Eigen::MatrixXd::Zero(num, 7);  // by the first keyframe's similarity
    for (std::size_t i = 0; i < path.positions.size(); ++i) {
      const auto row = static_cast<Eigen::Index>(3 * i);
      residual.segment<3>(row) = path.positions[i].p_m - PointOf(i);
      start.block<3, 7>(row, 0) = ByShift(PointOf(i) - middle_m);
    }
    Eigen::Matrix<double, 7, 1> sigma;
    sigma << 300, 300, 300, 0.35, 0.35, 0.35, 0.3;
    covariance += start * sigma.cwiseAbs2().asDiagonal() * start.transpose();
    for (std::size_t node = 1; node < path.S_metric_kf.size(); ++node) AddEdge(node, noise.drift);
    for (Eigen::Index i = 0; i < num; ++i) {
      for (Eigen::Index k = i % 3; k < num; k += 3) {
        const PositionNoise& of_axis = i % 3 < 2 ? noise.horizontal : noise.vertical;
        const double apart_s = std::abs(path.positions[static_cast<std::size_t>(i / 3)].time_s -
                                        path.positions[static_cast<std::size_t>(k / 3)].time_s);
        covariance(i, k) +=
            of_axis.wander_m * of_axis.wander_m * std::exp(-apart_s / of_axis.correlation_s);
        if (i == k) covariance(i, k) += of_axis.white_m * of_axis.white_m;
      }
    }
  }

  double LogLikelihood() const {
    const Eigen::LLT<Eigen::MatrixXd> root(covariance);
    const Eigen::MatrixXd lower = root.matrixL();
    return -residual.dot(root.solve(residual)) / 2 - lower.diagonal().array().log().sum() -
           static_cast<double>(residual.size()) * std::log(2 * std::numbers::pi) / 2;
  }

  Eigen::VectorXd residual;
  Eigen::MatrixXd covariance;

 private:
  Vector3d PointOf(std::size_t i) const {
    return path_.S_metric_kf[path_.positions[i].node] * path_.positions[i].p_kf;
  }
  // By a small translation, rotation and log scale about the origin that `arm` is from.
  static Eigen::Matrix<double, 3, 7> ByShift(const Vector3d& arm) {
    Eigen::Matrix<double, 3, 7> by = Eigen::Matrix<double, 3, 7>::Zero();
    by.leftCols<3>().setIdentity();
    by.block<3, 3>(0, 3) << 0, arm.z(), -arm.y(), -arm.z(), 0, arm.x(), arm.y(), -arm.x(), 0;
    by.col(6) = arm;
    return by;
  }
  // What an edge is off by moves all that comes after it, about its keyframe.
  void AddEdge(std::size_t node, const PathDrift& drift) {
    Eigen::MatrixXd by = Eigen::MatrixXd::Zero(covariance.rows(), 7);
    const Vector3d& centre = path_.S_metric_kf[node].pose().translation();
    for (std::size_t i = 0; i < path_.positions.size(); ++i) {
      if (path_.positions[i].node < node) continue;
      by.block<3, 7>(static_cast<Eigen::Index>(3 * i), 0) = ByShift(PointOf(i) - centre);
    }
    Eigen::Matrix<double, 7, 1> sigma;
    const double shift_m = path_.shift * path_.S_metric_kf[node].scale();
    sigma << shift_m, shift_m, shift_m, drift.rotation_rad, drift.rotation_rad, drift.rotation_rad,
        drift.log_scale;
    covariance += by * sigma.cwiseAbs2().asDiagonal() * by.transpose();
  }

  const PositionedPath& path_;
};

TEST(DriftFilter, HasTheLikelihoodOfTheModelWrittenOut) {
  const DriftingFlight flight = FlyWithDrift(30, {kWandering, 1, 0}, 1);
  PathNoise noise = kWandering;
  noise.vertical = {2, 20, 0.4};
  const DriftLikelihood found = DriftFilter(flight.path).Run(noise);
  // But for the scale of the keyframes, which drifts by 0.5 %: the filter has one for all.
  EXPECT_NEAR(found.log_likelihood, DenseModel(flight.path, noise).LogLikelihood(), 1e-3);
  for (const char is_outlier : found.is_outlier) EXPECT_EQ(is_outlier, 0);
}

TEST(OptimisePath, LeavesAPathThatAgreesAlone) {
  DriftingFlight flight = FlyWithDrift(60, {{{0, 0}, {0, 1, 0}, {0, 1, 0}}, 1, 0}, 1);
  ASSERT_TRUE(OptimisePath(kWandering, flight.is_outlier, flight.path));
  for (std::size_t i = 0; i < flight.truth.size(); ++i) {
    EXPECT_LT(
        (flight.path.S_metric_kf[i].pose().translation() - flight.truth[i].pose().translation())
            .norm(),
        1e-4);
    EXPECT_NEAR(flight.path.S_metric_kf[i].scale() / kUnit_m, 1, 1e-6);
  }
}

// Of the Gaussian model the mean, given the positions: conditioned upon them in the dense system.
TEST(OptimisePath, FindsThePosteriorMean) {
  PathNoise small = kWandering;  // so that the model is linear
  small.drift = {2e-5, 5e-5};
  small.horizontal = small.vertical = {0.2, 10, 0.05};
  DriftingFlight flight = FlyWithDrift(40, {small, 1, 0}, 3);
  flight.path.shift /= 10;
  PositionedPath linear = flight.path;
  DenseModel model(linear, small);
  // Where the mean has the points of the positions: less their errors' part of the covariance.
  PositionedPath rigid = linear;
  rigid.shift = 0;
  DenseModel errors(rigid, {{1e-12, 1e-12}, small.horizontal, small.vertical});
  DenseModel start(rigid, {{1e-12, 1e-12}, {0, 1, 0}, {0, 1, 0}});
  const Eigen::MatrixXd of_errors = errors.covariance - start.covariance;
  const Eigen::VectorXd mean =
      model.residual - of_errors * model.covariance.llt().solve(model.residual);
  const std::vector<Similarity> before = flight.path.S_metric_kf;
  const std::vector<char> none(flight.path.positions.size(), 0);
  ASSERT_TRUE(OptimisePath(small, none, flight.path));
  double largest = 0;
  for (std::size_t i = 0; i < flight.path.positions.size(); ++i) {
    const PathPosition& position = flight.path.positions[i];
    const Vector3d moved = flight.path.S_metric_kf[position.node] * position.p_kf -
                           before[position.node] * position.p_kf;
    largest = std::max(largest, moved.norm());
    // Cauchy's loss counts errors of one sigma for a little less.
    EXPECT_LT((moved - mean.segment<3>(static_cast<Eigen::Index>(3 * i))).norm(), 0.01);
  }
  EXPECT_GT(largest, 0.05);  // what there was to find
}

TEST(EstimateDrift, FindsTheSizesOfDriftAndErrors) {
  const DriftingFlight flight = FlyWithDrift(500, {kWhite, 0.5, 0.02}, 5);
  const DriftEstimate estimate = EstimateDrift(flight.path);
  EXPECT_EQ(estimate.is_outlier, flight.is_outlier);
  EXPECT_NEAR(std::hypot(estimate.noise.horizontal.white_m, estimate.noise.horizontal.wander_m), 1,
              0.15);
  EXPECT_GT(estimate.noise.drift.rotation_rad, kWhite.drift.rotation_rad / 3);
  EXPECT_LT(estimate.noise.drift.rotation_rad, kWhite.drift.rotation_rad * 3);
  EXPECT_GT(estimate.noise.drift.log_scale, kWhite.drift.log_scale / 3);
  EXPECT_LT(estimate.noise.drift.log_scale, kWhite.drift.log_scale * 3);
}

// Such a state of a run is refused; the search must end all the same.
TEST(EstimateDrift, EndsWhereNothingIsLikelierThanAnything) {
  DriftingFlight flight = FlyWithDrift(50, {kWhite, 0.5, 0.02}, 5);
  flight.path.worth = -1;
  EXPECT_FALSE(EstimateDrift(flight.path).is_outlier.empty());
}

// 2 km, which drift by tens of metres: long waves from the positions, the local shape as it was.
TEST(FitPath, TakesTheDriftAwayAndBendsNothing) {
  for (const PathNoise& noise : {kWandering, kWhite}) {
    const double period_s = noise.horizontal.wander_m > 0 ? 1 : 0.4;
    for (unsigned seed = 1; seed <= 3; ++seed) {
      DriftingFlight flight = FlyWithDrift(500, {noise, period_s, 0.02}, seed);
      const double before_m = RmsError(flight.path.S_metric_kf, flight.truth);
      const double local_before_m = RmsLocalError(flight.path.S_metric_kf, flight.truth);
      const PathFit fit = FitPath(flight.path);
      ASSERT_TRUE(fit.is_found);
      const double after_m = RmsError(flight.path.S_metric_kf, flight.truth);
      const double local_after_m = RmsLocalError(flight.path.S_metric_kf, flight.truth);
      EXPECT_GT(before_m, 5);
      // Errors that wander over a minute do not average out within four of them.
      EXPECT_LT(after_m, noise.horizontal.wander_m > 0 ? 5 : 0.6);
      // By chance what positions wander by may look like a drift: of the three once, by a quarter.
      EXPECT_LT(local_after_m, 1.3 * local_before_m);
    }
  }
}

// Curved by 0.03 degrees and growing by 0.04 % from each keyframe to the next: 30 m over 2 km, of
// which the points that keyframes share know nothing.
TEST(FitPath, FollowsADriftThatNoTrackerHas) {
  DriftingFlight flight = FlyWithDrift(500, {kWandering, 1, 0.02, {5e-4, 0, 0}, 4e-4}, 4);
  EXPECT_GT(RmsError(flight.path.S_metric_kf, flight.truth), 30);
  const PathFit fit = FitPath(flight.path);
  ASSERT_TRUE(fit.is_found);
  EXPECT_EQ(fit.is_outlier, flight.is_outlier);
  EXPECT_LT(RmsError(flight.path.S_metric_kf, flight.truth), 6);
}

TEST(FitPath, SaysNothingOfHeightsThatAreNotMeasured) {
  DriftingFlight flight = FlyWithDrift(100, {kWhite, 0.5, 0}, 2);
  flight.path.has_vertical = false;
  PositionedPath moved = flight.path;
  for (PathPosition& position : moved.positions) position.p_m.z() += 1000;
  ASSERT_TRUE(FitPath(flight.path).is_found);
  ASSERT_TRUE(FitPath(moved).is_found);
  for (std::size_t i = 0; i < moved.S_metric_kf.size(); ++i) {
    EXPECT_LT((moved.S_metric_kf[i].pose().translation() -
               flight.path.S_metric_kf[i].pose().translation())
                  .norm(),
              1e-6);
  }
}

// A flight that begins from standstill, speeds up over 20 s and goes on straight, and positions of
// it whose clock is off.
DriftingFlight StartFromRest(double clock_offset_s) {
  constexpr double kRamp_s = 20;
  const auto along_m = [](double time_s) {
    return time_s < kRamp_s ? kSpeed_m_per_s * time_s * time_s / (2 * kRamp_s)
                            : kSpeed_m_per_s * (time_s - kRamp_s / 2);
  };
  const auto speed = [](double time_s) {
    return kSpeed_m_per_s * std::clamp(time_s / kRamp_s, 0.0, 1.0);
  };
  ErrorsOfFlight errors;
  errors.noise = {{2e-4, 2e-4}, {0, 60, 1}, {0, 60, 1}};
  DriftingFlight flight = FlyWithDrift(200, errors, 3);
  flight.path.positions.clear();
  Random random(4);
  for (double time_s = 0; time_s < 100; time_s += 0.2) {
    const auto node = static_cast<std::size_t>(std::lround(along_m(time_s) / kStep_m));
    const auto place_of = [&](double at_s) {
      const Vector3d ahead(along_m(at_s) - kStep_m * static_cast<double>(node), 0, 0);
      return Vector3d(flight.truth[node] * Vector3d::Zero() +
                      flight.truth[node].pose().rotation() * ahead);
    };
    const Vector3d p_kf((along_m(time_s) - kStep_m * static_cast<double>(node)) / kUnit_m, 0, 0);
    flight.path.positions.push_back({time_s, node, p_kf,
                                     place_of(time_s + clock_offset_s) + random.Vector(),
                                     Vector3d(speed(time_s) / kUnit_m, 0, 0)});
  }
  return flight;
}

// Taken for errors of the path, an offset would stretch where the flight speeds up, by a seventh in
// the first 30 m here.
TEST(FitPath, DoesNotBendThePathForTheClock) {
  DriftingFlight still = StartFromRest(0);
  ASSERT_TRUE(FitPath(still.path).is_found);
  const double local_m = RmsLocalError(still.path.S_metric_kf, still.truth);
  DriftingFlight flight = StartFromRest(0.5);
  flight.path.clock_offset_sigma_s = 2;
  DriftingFlight unknowing = flight;
  unknowing.path.clock_offset_sigma_s = 0;
  ASSERT_TRUE(FitPath(flight.path).is_found);
  ASSERT_TRUE(FitPath(unknowing.path).is_found);
  EXPECT_LT(RmsLocalError(flight.path.S_metric_kf, flight.truth), 1.2 * local_m);
  EXPECT_GT(RmsLocalError(unknowing.path.S_metric_kf, unknowing.truth), 1.5 * local_m);
}

// Points on the ground, to the left and to the right of the path by turns.
void AddKnownPoints(DriftingFlight& flight, std::size_t every, double sigma_m, unsigned seed) {
  Random random(seed);
  for (std::size_t node = 0; node < flight.truth.size(); node += every) {
    const Vector3d p_kf((node / every) % 2 == 0 ? 0.2 : -0.2, 0.1, 60 / kUnit_m);
    const Vector3d p_m = flight.truth[node] * p_kf + sigma_m * random.Vector();
    flight.path.positions.push_back({kStep_m / kSpeed_m_per_s * static_cast<double>(node), node,
                                     p_kf, p_m, Vector3d::Zero(),
                                     Eigen::Matrix3d::Identity() * sigma_m * sigma_m});
  }
  std::ranges::stable_sort(flight.path.positions, {}, [](const PathPosition& position) {
    return std::pair(position.node, position.time_s);
  });
}

// As with a wrong calibration: 500 keyframes, 2 km, off by tens of metres.
DriftingFlight BentFlight(unsigned seed) {
  ErrorsOfFlight errors;
  errors.noise = {{1e-5, 1e-5}, {0, 60, 0.1}, {0, 60, 0.1}};
  errors.bias_rad = {0, 3e-4, 1e-4};
  errors.bias_log_scale = 1e-4;
  return FlyWithDrift(500, errors, seed);
}

TEST(FitPath, KnownPointsAloneStraightenABentPath) {
  DriftingFlight flight = BentFlight(1);
  flight.path.positions.clear();
  AddKnownPoints(flight, 60, 0.05, 2);  // every 240 m
  const double before_m = RmsError(flight.path.S_metric_kf, flight.truth);
  const double local_before_m = RmsLocalError(flight.path.S_metric_kf, flight.truth);
  EXPECT_GT(before_m, 20);
  const PathFit fit = FitPath(flight.path);
  ASSERT_TRUE(fit.is_found);
  EXPECT_EQ(std::ranges::count(fit.is_outlier, 1), 0);
  // An even bend of 3e-4 rad every 4 m, held at points 240 m apart, sags by .5 m between two of
  // them and is off by 9 mrad at each: .5 m for a camera 60 m above the point. Behind the last one,
  // 80 m before the end, both are twice that, and so it is where the scale bends as well.
  constexpr double kLeft_m = 2;
  EXPECT_LT(RmsError(flight.path.S_metric_kf, flight.truth), kLeft_m);
  EXPECT_LT(RmsLocalError(flight.path.S_metric_kf, flight.truth), 1.5 * local_before_m);
}

// Positions of metres beside points of centimetres: the path is as good as with the points alone.
TEST(FitPath, KnownPointsAreWorthMoreThanPositions) {
  ErrorsOfFlight errors;
  errors.noise = kWandering;
  DriftingFlight flight = FlyWithDrift(400, errors, 5);
  AddKnownPoints(flight, 50, 0.05, 6);
  const PathFit fit = FitPath(flight.path);
  ASSERT_TRUE(fit.is_found);
  // Half-way between points 200 m apart a drift of 3e-4 rad an edge is some decimetres; positions
  // that wander by 3 m alone leave metres.
  EXPECT_LT(RmsError(flight.path.S_metric_kf, flight.truth), 0.6);
}

}  // namespace
}  // namespace mono3d::tracking
