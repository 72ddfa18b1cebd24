// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/camera_covariance.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "calibration/camera_equations.h"

namespace mono3d::calibration {
namespace {

// What the model leaves out (rolling shutter, a lens that is focused, patches that drift) is alike
// in neighbouring images: errors are taken for independent between so many stretches of them.
constexpr std::size_t kMaxErrorStretches = 12;
// Points at infinity leave one direction free.
constexpr double kPointDamping = 1e-9;

using CameraRows = Eigen::Matrix<double, kNumParameters, Eigen::Dynamic>;

// Of each camera the rows of the inverse that belong to it, with the gauge and the priors.
template <int kNumOfView>
std::vector<CameraRows> CameraRowsOfInverse(const CameraProblem& problem,
                                            const CameraEquations<kNumOfView>& equations,
                                            Eigen::MatrixXd matrix) {
  equations.AddPriors(matrix);
  equations.Hold(matrix);
  const Eigen::Index num_of_cameras = equations.size() - equations.RowOfCamera(0);
  Eigen::MatrixXd cameras = Eigen::MatrixXd::Zero(equations.size(), num_of_cameras);
  for (std::size_t camera = 0; camera < problem.num_cameras(); ++camera) {
    for (int i = 0; i < kNumParameters; ++i) {
      const Eigen::Index at = equations.RowOfCamera(camera) + i;
      if (!problem.is_fixed(camera)[i]) cameras(at, at - equations.RowOfCamera(0)) = 1;
    }
  }
  const Eigen::MatrixXd rows = matrix.ldlt().solve(cameras).transpose();
  std::vector<CameraRows> of_camera;
  for (std::size_t camera = 0; camera < problem.num_cameras(); ++camera) {
    of_camera.emplace_back(
        rows.middleRows<kNumParameters>(equations.RowOfCamera(camera) - equations.RowOfCamera(0)));
  }
  return of_camera;
}

// By how much the observations move the camera, in one stretch of the images.
struct ErrorStretch {
  ParameterVector moved = ParameterVector::Zero();
  // The variances that independent errors of one standard deviation would give this.
  ParameterVector expected = ParameterVector::Zero();
};

// Of the sum of what the stretches move. The camera that was fitted to them leaves their residuals
// too small, by (n - 1) / n twice (the jackknife of MacKinnon and White 1985).
ParameterMatrix CovarianceOfSum(const std::vector<ErrorStretch>& stretches) {
  const auto count = static_cast<double>(stretches.size());
  const double fitted = count / std::max(1., count - 1);
  ParameterMatrix covariance = ParameterMatrix::Zero();
  for (const ErrorStretch& of : stretches) covariance += of.moved * of.moved.transpose();
  return fitted * fitted * covariance;
}

// Over the standard deviation of a normal distribution, for which 95 % lie within 1.96 of them: by
// the quantile of Student's t (expansion of Cornish and Fisher, 3 % off with two degrees).
double StudentOverNormal(double degrees) {
  constexpr double kNormal = 1.959964;
  constexpr double kFirst = 2.372271;   // (z^3 + z) / 4
  constexpr double kSecond = 2.822499;  // (5 z^5 + 16 z^3 + 3 z) / 96
  constexpr double kThird = 2.555846;   // (3 z^7 + 19 z^5 + 17 z^3 - 15 z) / 384
  const double inverse = 1 / degrees;
  return 1 + inverse * (kFirst + inverse * (kSecond + inverse * kThird)) / kNormal;
}

// A variance estimated from few stretches is itself known badly, the more so where few of them
// tell most of a parameter, as a turn or the first seconds of a climb do: degrees of freedom by
// Satterthwaite (1946), of what independent errors would give each stretch.
ParameterVector StudentFactors(const std::vector<ErrorStretch>& stretches) {
  constexpr double kFewestDegrees = 2;
  const auto count = static_cast<double>(stretches.size());
  ParameterVector sum = ParameterVector::Zero();
  ParameterVector squares = ParameterVector::Zero();
  for (const ErrorStretch& of : stretches) {
    sum += of.expected;
    squares += of.expected.cwiseAbs2();
  }
  ParameterVector factors = ParameterVector::Ones();
  for (int i = 0; i < kNumParameters; ++i) {
    if (!(squares[i] > 0)) continue;
    const double degrees = sum[i] * sum[i] / squares[i] * (count - 1) / count;
    factors[i] = StudentOverNormal(std::max(kFewestDegrees, degrees));
  }
  return factors;
}

// Of one camera, whose rows of the inverse `rows` are.
template <int kNumOfView>
ParameterMatrix ClusteredCovariance(const CameraProblem& problem,
                                    const CameraEquations<kNumOfView>& equations,
                                    std::size_t camera, const CameraRows& rows) {
  const std::vector<CameraProblem::Observation>& observations = problem.observations();
  const Eigen::Index cameras_at = equations.RowOfCamera(0);
  // By how much the observations move the camera, summed over points and over stretches of images.
  ParameterMatrix by_point = ParameterMatrix::Zero();
  ParameterMatrix by_both = ParameterMatrix::Zero();
  ParameterMatrix by_flows = ParameterMatrix::Zero();
  const std::size_t num_images = problem.num_images();
  const std::size_t length =
      std::max<std::size_t>(1, (num_images + kMaxErrorStretches - 1) / kMaxErrorStretches);
  std::vector<ErrorStretch> stretches((num_images + length - 1) / length);
  const auto of_image = [&](std::size_t i) {
    return rows.middleCols<kNumOfView>(equations.RowOfImage(observations[i].image));
  };
  for (const auto& point : equations.points()) {
    Eigen::Matrix<double, kNumParameters, 3> through_point =
        rows.rightCols(rows.cols() - cameras_at) * point.by_cameras;
    for (std::size_t i = point.begin; i < point.end; ++i) {
      through_point += of_image(i) * equations.view_by_point(i);
    }
    through_point *= point.inverse;
    std::vector<ParameterVector> in_stretch(stretches.size(), ParameterVector::Zero());
    for (std::size_t i = point.begin; i < point.end; ++i) {
      const CameraProblem::Linearised& row = equations.row(i);
      const Eigen::Index camera_at = equations.RowOfCamera(problem.camera_of(observations[i]));
      const Eigen::Matrix<double, kNumParameters, 2> by_residual =
          of_image(i) * equations.by_view(i).transpose() +
          rows.middleCols<kNumParameters>(camera_at) * row.by_camera.transpose() -
          through_point * row.by_point.transpose();
      if (observations[i].is_flow) {
        by_flows += by_residual * by_residual.transpose();
        continue;
      }
      const std::size_t stretch = observations[i].image / length;
      in_stretch[stretch] += by_residual * row.residual;
      stretches[stretch].expected += by_residual.cwiseAbs2().rowwise().sum();
    }
    ParameterVector sum = ParameterVector::Zero();
    for (std::size_t i = 0; i < stretches.size(); ++i) {
      by_both += in_stretch[i] * in_stretch[i].transpose();
      stretches[i].moved += in_stretch[i];
      sum += in_stretch[i];
    }
    by_point += sum * sum.transpose();
  }
  const ParameterVector factors = StudentFactors(stretches);
  ParameterMatrix covariance = factors.asDiagonal() *
                               (by_point + CovarianceOfSum(stretches) - by_both) *
                               factors.asDiagonal();
  covariance += by_flows;
  for (std::size_t other = 0; other < problem.num_cameras(); ++other) {
    const ParameterMatrix by_other = rows.middleCols<kNumParameters>(equations.RowOfCamera(other));
    covariance += by_other * problem.prior_information(other).asDiagonal() * by_other.transpose();
  }
  for (std::size_t image = 0; image < problem.num_images(); ++image) {
    const Eigen::Matrix<double, kNumParameters, kNumOfPose> by_pose =
        rows.middleCols<kNumOfPose>(equations.RowOfImage(image));
    covariance += by_pose * problem.KnownPosition(image).information * by_pose.transpose();
  }
  // Never below what independent errors give.
  const ParameterMatrix inverse = rows.middleCols<kNumParameters>(equations.RowOfCamera(camera));
  for (int i = 0; i < kNumParameters; ++i) {
    const double least = inverse(i, i);
    if (covariance(i, i) >= least || least <= 0) continue;
    const double scale = std::sqrt(least / std::max(covariance(i, i), 1e-30));
    covariance.row(i) *= scale;
    covariance.col(i) *= scale;
  }
  return covariance;
}

// With so much less weight of the pixels. Those are all observations where no velocity is varied.
template <int kNumOfView>
std::vector<CameraRows> RowsOfLessWeight(const CameraProblem& problem,
                                         const CameraEquations<kNumOfView>& equations,
                                         const Eigen::MatrixXd& matrix, double weight) {
  if constexpr (kNumOfView == kNumOfPose) {
    return CameraRowsOfInverse(problem, equations, weight * matrix);
  } else {
    CameraEquations<kNumOfView> weighted(problem, weight);
    return CameraRowsOfInverse(problem, weighted, weighted.Eliminate(kPointDamping));
  }
}

template <int kNumOfView>
std::vector<CameraCovariance> CovariancesWith(const CameraProblem& problem) {
  CameraEquations<kNumOfView> equations(problem);
  const Eigen::MatrixXd matrix = equations.Eliminate(kPointDamping);
  const std::vector<CameraRows> rows = CameraRowsOfInverse(problem, equations, matrix);
  std::vector<CameraCovariance> covariances;
  for (std::size_t camera = 0; camera < rows.size(); ++camera) {
    const auto num_coordinates = static_cast<double>(2 * problem.NumObservationsOf(camera));
    const double weight = 1 / std::max(1., kLeftOutShare * kLeftOutShare * num_coordinates);
    const CameraRows hidden = RowsOfLessWeight(problem, equations, matrix, weight)[camera];
    covariances.push_back(
        {ClusteredCovariance(problem, equations, camera, rows[camera]),
         hidden.middleCols<kNumParameters>(equations.RowOfCamera(camera)).diagonal()});
  }
  return covariances;
}

}  // namespace

std::vector<CameraCovariance> CameraCovariances(const CameraProblem& problem) {
  return problem.HasVelocities() ? CovariancesWith<kNumOfPoseAndVelocity>(problem)
                                 : CovariancesWith<kNumOfPose>(problem);
}

}  // namespace mono3d::calibration
