// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/camera_equations.h"

#include <Eigen/Cholesky>
#include <cmath>

namespace mono3d::calibration {
namespace {

// Of the pair of images (a, b), b <= a, among all pairs.
std::size_t PositionOfPair(std::size_t a, std::size_t b) { return a * (a + 1) / 2 + b; }

}  // namespace

template <int kNumOfView>
CameraEquations<kNumOfView>::CameraEquations(const CameraProblem& problem, double weight)
    : problem_(problem),
      images_(problem.num_images()),
      cameras_(problem.num_cameras(), ParameterMatrix::Zero()) {
  const std::vector<CameraProblem::Observation>& observations = problem.observations();
  rows_.reserve(observations.size());
  view_by_point_.reserve(observations.size());
  points_.resize(problem.num_points());
  for (OfPoint& point : points_) {
    point.by_cameras.setZero(kNumParameters * static_cast<Eigen::Index>(cameras_.size()), 3);
  }
  for (std::size_t begin = 0; begin < observations.size();) {
    OfPoint& point = points_[observations[begin].point];
    point.begin = point.end = begin;
    while (point.end < observations.size() &&
           observations[point.end].point == observations[begin].point) {
      Add(observations[point.end], weight, point);
      ++point.end;
    }
    begin = point.end;
  }
}

template <int kNumOfView>
typename CameraEquations<kNumOfView>::ByView CameraEquations<kNumOfView>::ByViewOf(
    const CameraProblem::Linearised& row) {
  ByView by_view;
  by_view.template leftCols<kNumOfPose>() = row.by_pose;
  if constexpr (kNumOfView == kNumOfPoseAndVelocity) {
    by_view.template rightCols<kNumOfPose>() = row.by_velocity;
  }
  return by_view;
}

template <int kNumOfView>
void CameraEquations<kNumOfView>::Add(const CameraProblem::Observation& observation, double weight,
                                      OfPoint& point) {
  CameraProblem::Linearised& row = rows_.emplace_back(problem_.Linearise(observation));
  if (!observation.is_flow) row *= std::sqrt(weight);
  const ByView by_view = ByViewOf(row);
  OfImage& image = images_[observation.image];
  image.camera = problem_.camera_of(observation);
  // Eigen would call its product of large matrices for them.
  image.information += by_view.transpose().lazyProduct(by_view);
  image.camera_by_view += row.by_camera.transpose().lazyProduct(by_view);
  cameras_[image.camera] += row.by_camera.transpose().lazyProduct(row.by_camera);
  point.information.noalias() += row.by_point.transpose() * row.by_point;
  point.by_cameras.template middleRows<kNumParameters>(kNumParameters *
                                                       static_cast<Eigen::Index>(image.camera)) +=
      row.by_camera.transpose() * row.by_point;
  view_by_point_.emplace_back(by_view.transpose().lazyProduct(row.by_point));
}

template <int kNumOfView>
Eigen::VectorXd CameraEquations<kNumOfView>::Diagonal() const {
  Eigen::VectorXd diagonal(size());
  for (std::size_t i = 0; i < images_.size(); ++i) {
    diagonal.segment<kNumOfView>(RowOfImage(i)) = images_[i].information.diagonal();
  }
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    diagonal.segment<kNumParameters>(RowOfCamera(i)) = cameras_[i].diagonal();
  }
  return diagonal;
}

template <int kNumOfView>
void CameraEquations<kNumOfView>::EliminatePoint(const OfPoint& point,
                                                 std::vector<ViewInformation>& pairs,
                                                 Eigen::MatrixXd& matrix) const {
  const std::vector<CameraProblem::Observation>& observations = problem_.observations();
  const Eigen::Index cameras_at = RowOfCamera(0);
  const Eigen::Index num_of_cameras = size() - cameras_at;
  for (std::size_t i = point.begin; i < point.end; ++i) {
    const std::size_t image = observations[i].image;
    const ViewByPoint weighted = view_by_point_[i].lazyProduct(point.inverse);
    // The images of a point ascend. One that shows its pixel and its flow is both of a pair.
    for (std::size_t k = point.begin; k <= i; ++k) {
      ViewInformation& pair = pairs[PositionOfPair(image, observations[k].image)];
      const ViewInformation shared = weighted.lazyProduct(view_by_point_[k].transpose());
      pair -= shared;
      if (k < i && observations[k].image == image) pair -= shared.transpose();
    }
    matrix.block(cameras_at, RowOfImage(image), num_of_cameras, kNumOfView) -=
        point.by_cameras.lazyProduct(weighted.transpose());
  }
  const Eigen::Matrix<double, Eigen::Dynamic, 3> weighted = point.by_cameras * point.inverse;
  matrix.bottomRightCorner(num_of_cameras, num_of_cameras) -=
      weighted.lazyProduct(point.by_cameras.transpose());
}

template <int kNumOfView>
Eigen::MatrixXd CameraEquations<kNumOfView>::Eliminate(double damping) {
  Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(size(), size());
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    matrix.block<kNumParameters, kNumParameters>(RowOfCamera(i), RowOfCamera(i)) = cameras_[i];
  }
  std::vector<ViewInformation> pairs(PositionOfPair(images_.size(), 0), ViewInformation::Zero());
  for (std::size_t i = 0; i < images_.size(); ++i) {
    pairs[PositionOfPair(i, i)] = images_[i].information;
    matrix.block<kNumParameters, kNumOfView>(RowOfCamera(images_[i].camera), RowOfImage(i)) =
        images_[i].camera_by_view;
  }
  for (OfPoint& point : points_) {
    Eigen::Matrix3d information = point.information;
    information.diagonal() *= 1 + damping;
    point.inverse = information.ldlt().solve(Eigen::Matrix3d::Identity());
    if (!point.inverse.allFinite()) point.inverse.setZero();
    EliminatePoint(point, pairs, matrix);
  }
  for (std::size_t a = 0; a < images_.size(); ++a) {
    for (std::size_t b = 0; b <= a; ++b) {
      matrix.block<kNumOfView, kNumOfView>(RowOfImage(a), RowOfImage(b)) =
          pairs[PositionOfPair(a, b)];
    }
  }
  return matrix;
}

template <int kNumOfView>
void CameraEquations<kNumOfView>::AddPriors(Eigen::MatrixXd& matrix) const {
  for (std::size_t i = 0; i < images_.size(); ++i) {
    const Eigen::Index at = RowOfImage(i);
    matrix.block<kNumOfPose, kNumOfPose>(at, at) += problem_.KnownPosition(i).information;
  }
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    matrix.diagonal().segment<kNumParameters>(RowOfCamera(i)) += problem_.prior_information(i);
  }
}

template <int kNumOfView>
void CameraEquations<kNumOfView>::AddPriors(Eigen::VectorXd& gradient) const {
  for (std::size_t i = 0; i < images_.size(); ++i) {
    const Eigen::Index at = RowOfImage(i);
    gradient.segment<kNumOfPose>(at) += problem_.KnownPosition(i).gradient;
  }
  for (std::size_t i = 0; i < cameras_.size(); ++i) {
    gradient.segment<kNumParameters>(RowOfCamera(i)) +=
        problem_.prior_information(i).cwiseProduct(problem_.parameters(i) - problem_.prior(i));
  }
}

template <int kNumOfView>
std::vector<Eigen::Index> CameraEquations<kNumOfView>::Held() const {
  std::vector<Eigen::Index> held;
  for (const std::size_t image : problem_.held_images()) {
    for (Eigen::Index i = 0; i < kNumOfPose; ++i) held.push_back(RowOfImage(image) + i);
  }
  for (const CameraProblem::HeldCoordinate& of : problem_.held_coordinates()) {
    held.push_back(RowOfImage(of.image) + of.coordinate);
  }
  for (std::size_t camera = 0; camera < cameras_.size(); ++camera) {
    for (int i = 0; i < kNumParameters; ++i) {
      if (problem_.is_fixed(camera)[i]) held.push_back(RowOfCamera(camera) + i);
    }
  }
  return held;
}

template <int kNumOfView>
void CameraEquations<kNumOfView>::Hold(Eigen::MatrixXd& matrix) const {
  std::vector<Eigen::Index> held = Held();
  for (Eigen::Index i = 0; i < RowOfCamera(0); ++i) {
    if (matrix(i, i) == 0) held.push_back(i);  // an image that sees no point
  }
  for (const Eigen::Index i : held) {
    matrix.row(i).setZero();
    matrix.col(i).setZero();
    matrix(i, i) = 1;
  }
}

template <int kNumOfView>
void CameraEquations<kNumOfView>::Hold(Eigen::VectorXd& gradient) const {
  for (const Eigen::Index i : Held()) gradient[i] = 0;
}

template <int kNumOfView>
typename CameraEquations<kNumOfView>::Gradient CameraEquations<kNumOfView>::GradientOf(
    std::span<const Eigen::Vector2d> residuals) const {
  const std::vector<CameraProblem::Observation>& observations = problem_.observations();
  Gradient gradient{Eigen::VectorXd::Zero(size()), {}};
  gradient.points.reserve(points_.size());
  for (const OfPoint& point : points_) {
    Eigen::Vector3d& of_point = gradient.points.emplace_back(Eigen::Vector3d::Zero());
    for (std::size_t i = point.begin; i < point.end; ++i) {
      of_point += rows_[i].by_point.transpose() * residuals[i];
    }
    const Eigen::Vector3d eliminated = point.inverse * of_point;
    for (std::size_t i = point.begin; i < point.end; ++i) {
      const std::size_t image = observations[i].image;
      gradient.reduced.template segment<kNumOfView>(RowOfImage(image)) +=
          by_view(i).transpose() * residuals[i] - view_by_point_[i] * eliminated;
      gradient.reduced.template segment<kNumParameters>(RowOfCamera(images_[image].camera)) +=
          rows_[i].by_camera.transpose() * residuals[i];
    }
    gradient.reduced.tail(size() - RowOfCamera(0)) -= point.by_cameras * eliminated;
  }
  return gradient;
}

template <int kNumOfView>
typename CameraEquations<kNumOfView>::Step CameraEquations<kNumOfView>::WithPoints(
    const Eigen::VectorXd& views_and_cameras,
    const std::vector<Eigen::Vector3d>& point_gradients) const {
  Step step{views_and_cameras, {}};
  step.points.reserve(points_.size());
  for (std::size_t k = 0; k < points_.size(); ++k) {
    const OfPoint& point = points_[k];
    Eigen::Vector3d gradient =
        point_gradients[k] +
        point.by_cameras.transpose() * views_and_cameras.tail(size() - RowOfCamera(0));
    for (std::size_t i = point.begin; i < point.end; ++i) {
      gradient += view_by_point_[i].transpose() * views_and_cameras.template segment<kNumOfView>(
                                                      RowOfImage(problem_.observations()[i].image));
    }
    step.points.emplace_back(-point.inverse * gradient);
  }
  return step;
}

template <int kNumOfView>
Eigen::Vector2d CameraEquations<kNumOfView>::Change(std::size_t i, const Step& step) const {
  const CameraProblem::Observation& observation = problem_.observations()[i];
  return by_view(i) *
             step.views_and_cameras.template segment<kNumOfView>(RowOfImage(observation.image)) +
         rows_[i].by_camera * step.views_and_cameras.template segment<kNumParameters>(
                                  RowOfCamera(images_[observation.image].camera)) +
         rows_[i].by_point * step.points[observation.point];
}

template class CameraEquations<kNumOfPose>;
template class CameraEquations<kNumOfPoseAndVelocity>;

}  // namespace mono3d::calibration
