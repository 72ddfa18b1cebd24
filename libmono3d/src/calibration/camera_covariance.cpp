// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/camera_covariance.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

namespace mono3d::calibration {
namespace {

// What the model leaves out (rolling shutter, a lens that is focused, patches that drift) is alike
// in neighbouring images: errors are taken for independent between so many stretches of them.
constexpr std::size_t kNumBlocks = 12;

using Observations = std::span<const CameraProblem::Observation>;

// The observations of one point, without the point.
struct PointTerm {
  std::vector<CameraProblem::Linearised> observations;
  std::vector<Eigen::Matrix<double, 6, 3>> pose_by_point;  // W of each image
  Eigen::Matrix<double, kNumParameters, 3> camera_by_point =
      Eigen::Matrix<double, kNumParameters, 3>::Zero();
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();  // of the point's own information
};

PointTerm MakeTerm(const CameraProblem& problem, Observations observations) {
  PointTerm term;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const CameraProblem::Observation& observation : observations) {
    const CameraProblem::Linearised& row =
        term.observations.emplace_back(problem.Linearise(observation));
    information += row.by_point.transpose() * row.by_point;
    term.pose_by_point.emplace_back(row.by_pose.transpose() * row.by_point);
    term.camera_by_point += row.by_camera.transpose() * row.by_point;
  }
  // Points at infinity leave one direction free.
  information.diagonal() *= 1 + 1e-9;
  term.inverse = information.ldlt().solve(Eigen::Matrix3d::Identity());
  if (!term.inverse.allFinite()) term.inverse.setZero();
  return term;
}

// The normal equations of all poses and the camera, the points eliminated. The camera comes last.
class ReducedSystem {
 public:
  explicit ReducedSystem(const CameraProblem& problem)
      : camera_at_(6 * static_cast<Eigen::Index>(problem.num_images())),
        S_(Eigen::MatrixXd::Zero(camera_at_ + kNumParameters, camera_at_ + kNumParameters)) {}

  void Add(Observations observations, const PointTerm& term) {
    for (std::size_t i = 0; i < observations.size(); ++i) {
      const CameraProblem::Linearised& row = term.observations[i];
      const Eigen::Index at = 6 * static_cast<Eigen::Index>(observations[i].image);
      S_.block<6, 6>(at, at) += row.by_pose.transpose() * row.by_pose;
      S_.block<6, kNumParameters>(at, camera_at_) += row.by_pose.transpose() * row.by_camera;
      S_.block<kNumParameters, kNumParameters>(camera_at_, camera_at_) +=
          row.by_camera.transpose() * row.by_camera;
      const Eigen::Matrix<double, 6, 3> Y = term.pose_by_point[i] * term.inverse;
      S_.block<6, kNumParameters>(at, camera_at_) -= Y * term.camera_by_point.transpose();
      for (std::size_t k = 0; k < observations.size(); ++k) {
        const Eigen::Index other = 6 * static_cast<Eigen::Index>(observations[k].image);
        S_.block<6, 6>(at, other) -= Y * term.pose_by_point[k].transpose();
      }
    }
    S_.block<kNumParameters, kNumParameters>(camera_at_, camera_at_) -=
        term.camera_by_point * term.inverse * term.camera_by_point.transpose();
  }

  // The rows of the inverse that belong to the camera, with the gauge and the prior of `problem`.
  Eigen::Matrix<double, kNumParameters, Eigen::Dynamic> CameraRowsOfInverse(
      const CameraProblem& problem) {
    S_.bottomLeftCorner(kNumParameters, camera_at_) =
        S_.topRightCorner(camera_at_, kNumParameters).transpose();
    for (int i = 0; i < kNumParameters; ++i) {
      const double sigma = problem.prior_sigmas()[i];
      if (!problem.is_fixed()[i]) S_(camera_at_ + i, camera_at_ + i) += 1 / (sigma * sigma);
    }
    for (const std::size_t image : problem.held_images()) {
      for (Eigen::Index i = 0; i < 6; ++i) Fix(6 * static_cast<Eigen::Index>(image) + i);
    }
    for (const CameraProblem::HeldCoordinate& held : problem.held_coordinates()) {
      Fix(6 * static_cast<Eigen::Index>(held.image) + held.coordinate);
    }
    for (int i = 0; i < kNumParameters; ++i) {
      if (problem.is_fixed()[i]) Fix(camera_at_ + i);
    }
    for (Eigen::Index i = 0; i < camera_at_; ++i) {
      if (S_(i, i) == 0) Fix(i);  // an image that sees no point
    }
    Eigen::MatrixXd camera = Eigen::MatrixXd::Zero(S_.rows(), kNumParameters);
    for (int i = 0; i < kNumParameters; ++i) {
      if (!problem.is_fixed()[i]) camera(camera_at_ + i, i) = 1;
    }
    return S_.ldlt().solve(camera).transpose();
  }

 private:
  void Fix(Eigen::Index i) {
    S_.row(i).setZero();
    S_.col(i).setZero();
    S_(i, i) = 1;
  }

  Eigen::Index camera_at_;
  Eigen::MatrixXd S_;
};

template <typename Call>
void ForEachPoint(const CameraProblem& problem, const Call& call) {
  const Observations all = problem.observations();
  for (std::size_t begin = 0; begin < all.size();) {
    std::size_t end = begin;
    while (end < all.size() && all[end].point == all[begin].point) ++end;
    call(all.subspan(begin, end - begin));
    begin = end;
  }
}

// Of the sum of what the stretches move. The camera that was fitted to them leaves their residuals
// too small, by (n - 1) / n twice (the jackknife of MacKinnon and White 1985).
ParameterMatrix CovarianceOfSum(const std::array<ParameterVector, kNumBlocks>& of_block) {
  constexpr double kFitted = static_cast<double>(kNumBlocks) / (kNumBlocks - 1);
  ParameterMatrix covariance = ParameterMatrix::Zero();
  for (const ParameterVector& moved : of_block) covariance += moved * moved.transpose();
  return kFitted * kFitted * covariance;
}

}  // namespace

ParameterMatrix CameraCovariance(const CameraProblem& problem) {
  std::vector<PointTerm> terms;
  ReducedSystem system(problem);
  ForEachPoint(problem, [&](Observations observations) {
    terms.push_back(MakeTerm(problem, observations));
    system.Add(observations, terms.back());
  });
  const Eigen::Matrix<double, kNumParameters, Eigen::Dynamic> rows =
      system.CameraRowsOfInverse(problem);
  const Eigen::Index camera_at = rows.cols() - kNumParameters;

  // By how much the observations move the camera, summed over points and over stretches of images.
  ParameterMatrix by_point = ParameterMatrix::Zero();
  ParameterMatrix by_both = ParameterMatrix::Zero();
  const std::size_t block = (problem.num_images() + kNumBlocks - 1) / kNumBlocks;
  std::array<ParameterVector, kNumBlocks> of_block;
  of_block.fill(ParameterVector::Zero());
  std::size_t point = 0;
  ForEachPoint(problem, [&](Observations observations) {
    const PointTerm& term = terms[point++];
    Eigen::Matrix<double, kNumParameters, 3> through_point =
        rows.rightCols<kNumParameters>() * term.camera_by_point;
    for (std::size_t i = 0; i < observations.size(); ++i) {
      through_point += rows.middleCols<6>(6 * static_cast<Eigen::Index>(observations[i].image)) *
                       term.pose_by_point[i];
    }
    through_point *= term.inverse;
    std::array<ParameterVector, kNumBlocks> in_block;
    in_block.fill(ParameterVector::Zero());
    for (std::size_t i = 0; i < observations.size(); ++i) {
      const CameraProblem::Linearised& row = term.observations[i];
      in_block[observations[i].image / block] +=
          (rows.middleCols<6>(6 * static_cast<Eigen::Index>(observations[i].image)) *
               row.by_pose.transpose() +
           rows.middleCols<kNumParameters>(camera_at) * row.by_camera.transpose() -
           through_point * row.by_point.transpose()) *
          row.residual;
    }
    ParameterVector sum = ParameterVector::Zero();
    for (std::size_t i = 0; i < kNumBlocks; ++i) {
      by_both += in_block[i] * in_block[i].transpose();
      of_block[i] += in_block[i];
      sum += in_block[i];
    }
    by_point += sum * sum.transpose();
  });
  const ParameterMatrix by_block = CovarianceOfSum(of_block);

  ParameterMatrix covariance = by_point + by_block - by_both;
  const ParameterMatrix inverse = rows.rightCols<kNumParameters>();
  ParameterVector prior_information = ParameterVector::Zero();
  for (int i = 0; i < kNumParameters; ++i) {
    const double sigma = problem.prior_sigmas()[i];
    if (!problem.is_fixed()[i]) prior_information[i] = 1 / (sigma * sigma);
  }
  covariance += inverse * prior_information.asDiagonal() * inverse;
  // Never below what independent errors give.
  for (int i = 0; i < kNumParameters; ++i) {
    const double least = inverse(i, i);
    if (covariance(i, i) >= least || least <= 0) continue;
    const double scale = std::sqrt(least / std::max(covariance(i, i), 1e-30));
    covariance.row(i) *= scale;
    covariance.col(i) *= scale;
  }
  return covariance;
}

}  // namespace mono3d::calibration
