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

// Pose and velocity of an image.
constexpr int kNumOfView = 12;
using ByImage = Eigen::Matrix<double, 2, kNumOfView>;

ByImage ByImageOf(const CameraProblem::Linearised& row) {
  ByImage by_image;
  by_image << row.by_pose, row.by_velocity;
  return by_image;
}

Eigen::Index RowOfImage(std::size_t image) { return kNumOfView * static_cast<Eigen::Index>(image); }

using CameraRows = Eigen::Matrix<double, kNumParameters, Eigen::Dynamic>;

// The observations of one point, without the point.
struct PointTerm {
  std::vector<CameraProblem::Linearised> observations;
  std::vector<std::size_t> camera;                                   // of each
  std::vector<Eigen::Matrix<double, kNumOfView, 3>> image_by_point;  // W of each image
  // Of all cameras, one below the other.
  Eigen::Matrix<double, Eigen::Dynamic, 3> camera_by_point;
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();  // of the point's own information
};

Eigen::Index RowOfCamera(std::size_t camera) {
  return kNumParameters * static_cast<Eigen::Index>(camera);
}

PointTerm MakeTerm(const CameraProblem& problem, Observations observations) {
  PointTerm term;
  term.camera_by_point.setZero(RowOfCamera(problem.num_cameras()), 3);
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const CameraProblem::Observation& observation : observations) {
    const CameraProblem::Linearised& row =
        term.observations.emplace_back(problem.Linearise(observation));
    term.camera.push_back(problem.camera_of(observation));
    information += row.by_point.transpose() * row.by_point;
    term.image_by_point.emplace_back(ByImageOf(row).transpose() * row.by_point);
    term.camera_by_point.middleRows<kNumParameters>(RowOfCamera(term.camera.back())) +=
        row.by_camera.transpose() * row.by_point;
  }
  // Points at infinity leave one direction free.
  information.diagonal() *= 1 + 1e-9;
  term.inverse = information.ldlt().solve(Eigen::Matrix3d::Identity());
  if (!term.inverse.allFinite()) term.inverse.setZero();
  return term;
}

// The normal equations of all poses and the cameras, the points eliminated. The cameras come last.
class ReducedSystem {
 public:
  explicit ReducedSystem(const CameraProblem& problem)
      : cameras_at_(RowOfImage(problem.num_images())),
        num_of_cameras_(RowOfCamera(problem.num_cameras())),
        S_(Eigen::MatrixXd::Zero(cameras_at_ + num_of_cameras_, cameras_at_ + num_of_cameras_)) {}

  void Add(Observations observations, const PointTerm& term) {
    for (std::size_t i = 0; i < observations.size(); ++i) {
      const CameraProblem::Linearised& row = term.observations[i];
      const ByImage by_image = ByImageOf(row);
      const Eigen::Index at = RowOfImage(observations[i].image);
      const Eigen::Index camera_at = cameras_at_ + RowOfCamera(term.camera[i]);
      S_.block<kNumOfView, kNumOfView>(at, at) += by_image.transpose() * by_image;
      S_.block<kNumOfView, kNumParameters>(at, camera_at) += by_image.transpose() * row.by_camera;
      S_.block<kNumParameters, kNumParameters>(camera_at, camera_at) +=
          row.by_camera.transpose() * row.by_camera;
      const Eigen::Matrix<double, kNumOfView, 3> Y = term.image_by_point[i] * term.inverse;
      S_.block(at, cameras_at_, kNumOfView, num_of_cameras_) -=
          Y * term.camera_by_point.transpose();
      for (std::size_t k = 0; k < observations.size(); ++k) {
        const Eigen::Index other = RowOfImage(observations[k].image);
        S_.block<kNumOfView, kNumOfView>(at, other) -= Y * term.image_by_point[k].transpose();
      }
    }
    S_.bottomRightCorner(num_of_cameras_, num_of_cameras_) -=
        term.camera_by_point * term.inverse * term.camera_by_point.transpose();
  }

  // Of each camera the rows of the inverse that belong to it, with the gauge and the priors of
  // `problem`. `weight`: of the observations, beside priors and positions.
  std::vector<CameraRows> CameraRowsOfInverse(const CameraProblem& problem, double weight) const {
    ReducedSystem system = *this;
    system.S_ *= weight;
    return system.WithPriorsInverted(problem);
  }

 private:
  std::vector<CameraRows> WithPriorsInverted(const CameraProblem& problem) {
    S_.bottomLeftCorner(num_of_cameras_, cameras_at_) =
        S_.topRightCorner(cameras_at_, num_of_cameras_).transpose();
    for (std::size_t image = 0; image < problem.num_images(); ++image) {
      const Eigen::Index at = RowOfImage(image) + 6;
      S_.block<6, 6>(at, at) += problem.velocity_information(image);
      S_.block<6, 6>(at - 6, at - 6) += problem.position_information(image);
    }
    for (const std::size_t image : problem.held_images()) {
      for (Eigen::Index i = 0; i < 6; ++i) Fix(RowOfImage(image) + i);
    }
    for (const CameraProblem::HeldCoordinate& held : problem.held_coordinates()) {
      Fix(RowOfImage(held.image) + held.coordinate);
    }
    Eigen::MatrixXd cameras = Eigen::MatrixXd::Zero(S_.rows(), num_of_cameras_);
    for (std::size_t camera = 0; camera < problem.num_cameras(); ++camera) {
      for (int i = 0; i < kNumParameters; ++i) {
        const Eigen::Index of_camera = RowOfCamera(camera) + i;
        const Eigen::Index at = cameras_at_ + of_camera;
        if (problem.is_fixed(camera)[i]) {
          Fix(at);
          continue;
        }
        const double sigma = problem.prior_sigmas(camera)[i];
        S_(at, at) += 1 / (sigma * sigma);
        cameras(at, of_camera) = 1;
      }
    }
    for (Eigen::Index i = 0; i < cameras_at_; ++i) {
      if (S_(i, i) == 0) Fix(i);  // an image that sees no point
    }
    const Eigen::MatrixXd rows = S_.ldlt().solve(cameras).transpose();
    std::vector<CameraRows> of_camera;
    for (std::size_t camera = 0; camera < problem.num_cameras(); ++camera) {
      of_camera.emplace_back(rows.middleRows<kNumParameters>(RowOfCamera(camera)));
    }
    return of_camera;
  }

  void Fix(Eigen::Index i) {
    S_.row(i).setZero();
    S_.col(i).setZero();
    S_(i, i) = 1;
  }

  Eigen::Index cameras_at_;
  Eigen::Index num_of_cameras_;
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

// Of one camera, whose rows of the inverse `rows` are.
ParameterMatrix ClusteredCovariance(const CameraProblem& problem,
                                    const std::vector<PointTerm>& terms, std::size_t camera,
                                    const CameraRows& rows) {
  const Eigen::Index cameras_at = RowOfImage(problem.num_images());
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
        rows.rightCols(rows.cols() - cameras_at) * term.camera_by_point;
    for (std::size_t i = 0; i < observations.size(); ++i) {
      through_point +=
          rows.middleCols<kNumOfView>(RowOfImage(observations[i].image)) * term.image_by_point[i];
    }
    through_point *= term.inverse;
    std::array<ParameterVector, kNumBlocks> in_block;
    in_block.fill(ParameterVector::Zero());
    for (std::size_t i = 0; i < observations.size(); ++i) {
      const CameraProblem::Linearised& row = term.observations[i];
      const Eigen::Index camera_at = cameras_at + RowOfCamera(term.camera[i]);
      in_block[observations[i].image / block] +=
          (rows.middleCols<kNumOfView>(RowOfImage(observations[i].image)) *
               ByImageOf(row).transpose() +
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
  ParameterMatrix covariance = by_point + CovarianceOfSum(of_block) - by_both;
  for (std::size_t other = 0; other < problem.num_cameras(); ++other) {
    const ParameterMatrix by_other =
        rows.middleCols<kNumParameters>(cameras_at + RowOfCamera(other));
    ParameterVector prior_information = ParameterVector::Zero();
    for (int i = 0; i < kNumParameters; ++i) {
      const double sigma = problem.prior_sigmas(other)[i];
      if (!problem.is_fixed(other)[i]) prior_information[i] = 1 / (sigma * sigma);
    }
    covariance += by_other * prior_information.asDiagonal() * by_other.transpose();
  }
  for (std::size_t image = 0; image < problem.num_images(); ++image) {
    const Eigen::Matrix<double, kNumParameters, 6> by_velocity =
        rows.middleCols<6>(RowOfImage(image) + 6);
    covariance += by_velocity * problem.velocity_information(image) * by_velocity.transpose();
    const Eigen::Matrix<double, kNumParameters, 6> by_pose = rows.middleCols<6>(RowOfImage(image));
    covariance += by_pose * problem.position_information(image) * by_pose.transpose();
  }
  // Never below what independent errors give.
  const ParameterMatrix inverse = rows.middleCols<kNumParameters>(cameras_at + RowOfCamera(camera));
  for (int i = 0; i < kNumParameters; ++i) {
    const double least = inverse(i, i);
    if (covariance(i, i) >= least || least <= 0) continue;
    const double scale = std::sqrt(least / std::max(covariance(i, i), 1e-30));
    covariance.row(i) *= scale;
    covariance.col(i) *= scale;
  }
  return covariance;
}

ParameterVector HiddenVariances(const CameraProblem& problem, const ReducedSystem& system,
                                std::size_t camera) {
  const auto num_coordinates = static_cast<double>(2 * problem.NumObservationsOf(camera));
  const double weight = 1 / std::max(1., kLeftOutShare * kLeftOutShare * num_coordinates);
  const CameraRows rows = system.CameraRowsOfInverse(problem, weight)[camera];
  const Eigen::Index at = RowOfImage(problem.num_images()) + RowOfCamera(camera);
  return rows.middleCols<kNumParameters>(at).diagonal();
}

}  // namespace

std::vector<CameraCovariance> CameraCovariances(const CameraProblem& problem) {
  std::vector<PointTerm> terms;
  ReducedSystem system(problem);
  ForEachPoint(problem, [&](Observations observations) {
    terms.push_back(MakeTerm(problem, observations));
    system.Add(observations, terms.back());
  });
  const std::vector<CameraRows> rows = system.CameraRowsOfInverse(problem, /*weight=*/1);
  std::vector<CameraCovariance> covariances;
  for (std::size_t camera = 0; camera < rows.size(); ++camera) {
    covariances.push_back({ClusteredCovariance(problem, terms, camera, rows[camera]),
                           HiddenVariances(problem, system, camera)});
  }
  return covariances;
}

}  // namespace mono3d::calibration
