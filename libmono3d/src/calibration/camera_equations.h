// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <span>
#include <vector>

#include "calibration/camera_parameters.h"
#include "calibration/camera_problem.h"

namespace mono3d::calibration {

// Unknowns of an image: its pose, and where its lines are read one after the other its velocity.
inline constexpr int kNumOfPose = 6;
inline constexpr int kNumOfPoseAndVelocity = 12;

// The normal equations of a CameraProblem, linearised where it stands. Unknowns: first kNumOfView
// of each image, then kNumParameters of each camera; points are eliminated.
template <int kNumOfView>
class CameraEquations {
 public:
  using ByView = Eigen::Matrix<double, 2, kNumOfView>;
  using ViewByPoint = Eigen::Matrix<double, kNumOfView, 3>;

  // The part of one point, whose observations are [begin, end) of the problem's.
  struct OfPoint {
    std::size_t begin = 0;
    std::size_t end = 0;
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    Eigen::Matrix<double, Eigen::Dynamic, 3> by_cameras;  // of all, one below the other
    Eigen::Matrix3d inverse = Eigen::Matrix3d::Zero();    // of the information: see Eliminate
  };

  // Of the observations alone. `weight`: of the pixels, beside all else. `problem` must outlive it.
  explicit CameraEquations(const CameraProblem& problem, double weight = 1);

  static Eigen::Index RowOfImage(std::size_t image) {
    return kNumOfView * static_cast<Eigen::Index>(image);
  }
  Eigen::Index RowOfCamera(std::size_t camera) const {
    return RowOfImage(images_.size()) + kNumParameters * static_cast<Eigen::Index>(camera);
  }
  Eigen::Index size() const { return RowOfCamera(cameras_.size()); }

  // The matrix (its lower triangle) without the points, whose own informations' diagonals are taken
  // larger by `damping` of them.
  Eigen::MatrixXd Eliminate(double damping);
  // The matrix's diagonal with the points not eliminated.
  Eigen::VectorXd Diagonal() const;
  // What is known beside the observations: the cameras' priors and measured positions.
  void AddPriors(Eigen::MatrixXd& matrix) const;
  // What is not varied (gauge, fixed parameters) or not observed does not change.
  void Hold(Eigen::MatrixXd& matrix) const;

  // A change of all unknowns.
  struct Step {
    Eigen::VectorXd views_and_cameras;
    std::vector<Eigen::Vector3d> points;
  };
  // Of the cost by the unknowns, the points eliminated, and by the points.
  struct Gradient {
    Eigen::VectorXd reduced;
    std::vector<Eigen::Vector3d> points;
  };
  // Of half the sum of the squares of residuals, one of each observation, that change as the
  // problem's do; after Eliminate.
  Gradient GradientOf(std::span<const Eigen::Vector2d> residuals) const;
  void AddPriors(Eigen::VectorXd& gradient) const;
  void Hold(Eigen::VectorXd& gradient) const;
  // With the points' part of a step of the others, after Eliminate.
  Step WithPoints(const Eigen::VectorXd& views_and_cameras,
                  const std::vector<Eigen::Vector3d>& point_gradients) const;
  // By how much a step changes the residual of observation `i`.
  Eigen::Vector2d Change(std::size_t i, const Step& step) const;

  const std::vector<OfPoint>& points() const { return points_; }
  // Of the problem's observation `i`.
  const CameraProblem::Linearised& row(std::size_t i) const { return rows_[i]; }
  ByView by_view(std::size_t i) const { return ByViewOf(rows_[i]); }
  const ViewByPoint& view_by_point(std::size_t i) const { return view_by_point_[i]; }

 private:
  using ViewInformation = Eigen::Matrix<double, kNumOfView, kNumOfView>;

  struct OfImage {
    ViewInformation information = ViewInformation::Zero();
    Eigen::Matrix<double, kNumParameters, kNumOfView> camera_by_view =
        Eigen::Matrix<double, kNumParameters, kNumOfView>::Zero();
    std::size_t camera = 0;
  };

  static ByView ByViewOf(const CameraProblem::Linearised& row);
  void Add(const CameraProblem::Observation& observation, double weight, OfPoint& point);
  void EliminatePoint(const OfPoint& point, std::vector<ViewInformation>& pairs,
                      Eigen::MatrixXd& matrix) const;
  // The unknowns that are not varied.
  std::vector<Eigen::Index> Held() const;

  const CameraProblem& problem_;
  std::vector<CameraProblem::Linearised> rows_;
  std::vector<ViewByPoint> view_by_point_;
  std::vector<OfPoint> points_;
  std::vector<OfImage> images_;
  std::vector<ParameterMatrix> cameras_;  // information
};

extern template class CameraEquations<kNumOfPose>;
extern template class CameraEquations<kNumOfPoseAndVelocity>;

}  // namespace mono3d::calibration
