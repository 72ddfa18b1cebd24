// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/optimisation/dense_schur_solver.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <array>
#include <cmath>
#include <optional>

#include "tracking/optimisation/chi2.h"
#include "tracking/optimisation/pose_constraint.h"

namespace mono3d::tracking {
namespace {

using Matrix63d = Eigen::Matrix<double, 6, 3>;

// An observation in use.
struct Term {
  Eigen::Vector2d pixel;
  double inverse_sigma = 1;
  std::size_t view = 0;
  std::optional<std::size_t> free_view;  // position among the free ones
};

struct Camera {
  Eigen::Matrix3d R;
  Eigen::Vector3d t;
};

// Of the weighted residual, less its sign: what the residual shrinks by.
struct Derivatives {
  Eigen::Vector2d error;
  std::array<Eigen::Vector3d, 2> by_point;  // gradient of x, of y
  std::array<Vector6d, 2> by_view;          // (omega, dt)
};

// hessian += J' J, column by column: the compiler makes straight code of it.
template <int kSize>
void AddSquare(const std::array<Eigen::Matrix<double, kSize, 1>, 2>& rows,
               Eigen::Matrix<double, kSize, kSize>& hessian) {
  for (int column = 0; column < kSize; ++column) {
    hessian.col(column) += rows[0][column] * rows[0] + rows[1][column] * rows[1];
  }
}

// Of the views' Hessian, below its diagonal.
struct ViewPair {
  std::size_t row = 0;  // positions among the free views
  std::size_t column = 0;
  Matrix6d hessian;
};

class DenseSchurSolver {
 public:
  DenseSchurSolver(BundleAdjustmentProblem& problem, const std::vector<char>& left_out,
                   bool robust);

  void MinimiseDensely(int num_steps, const BundleAdjustmentOptions& options);

 private:
  static std::vector<Camera> Cameras(const std::vector<Pose>& poses);
  double Cost(const std::vector<Camera>& cameras, const std::vector<Eigen::Vector3d>& points) const;
  Derivatives Derive(const Term& term, const Camera& camera, const Eigen::Vector3d& p_world) const;
  double ConstraintsCost(const std::vector<Pose>& T_cam_world) const;
  void LineariseObservations(const std::vector<Camera>& cameras);
  void LineariseConstraints();
  void EliminatePoints(double damping);
  bool Solve(double damping);
  double Weight(double chi2) const;

  BundleAdjustmentProblem& problem_;
  bool robust_;
  std::vector<Term> terms_;              // by point
  std::vector<std::size_t> first_term_;  // of each point; one more than there are points
  std::vector<std::size_t> free_views_;
  std::vector<std::optional<std::size_t>> free_of_;  // of each view
  // Of the linearised problem:
  std::vector<Matrix6d> view_hessians_;
  Eigen::VectorXd view_gradient_;
  std::vector<Eigen::Matrix3d> point_hessians_;
  std::vector<Eigen::Vector3d> point_gradients_;
  std::vector<Matrix63d> mixed_;  // of each term of a free view
  std::vector<ViewPair> pairs_;   // of the constraints between two free views
  // Of the solution:
  std::vector<Eigen::Matrix3d> point_inverses_;
  Eigen::MatrixXd reduced_;
  Eigen::VectorXd reduced_gradient_;
  Eigen::VectorXd view_step_;
  std::vector<Eigen::Vector3d> point_step_;
};

DenseSchurSolver::DenseSchurSolver(BundleAdjustmentProblem& problem,
                                   const std::vector<char>& left_out, bool robust)
    : problem_(problem), robust_(robust) {
  free_of_.resize(problem.T_cam_world.size());
  for (std::size_t view = 0; view < free_of_.size(); ++view) {
    if (problem.is_fixed[view] != 0) continue;
    free_of_[view] = free_views_.size();
    free_views_.push_back(view);
  }
  first_term_.assign(problem.p_world.size() + 1, 0);
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    if (left_out[i] == 0) ++first_term_[problem.observations[i].point + 1];
  }
  for (std::size_t i = 1; i < first_term_.size(); ++i) first_term_[i] += first_term_[i - 1];
  terms_.resize(first_term_.back());
  std::vector<std::size_t> next(first_term_.begin(), first_term_.end() - 1);
  for (std::size_t i = 0; i < problem.observations.size(); ++i) {
    if (left_out[i] != 0) continue;
    const BundleAdjustmentObservation& o = problem.observations[i];
    terms_[next[o.point]++] = {o.pixel, 1 / o.sigma_px, o.view, free_of_[o.view]};
  }
}

std::vector<Camera> DenseSchurSolver::Cameras(const std::vector<Pose>& poses) {
  std::vector<Camera> cameras;
  for (const Pose& T : poses) cameras.push_back({T.rotation().toRotationMatrix(), T.translation()});
  return cameras;
}

double DenseSchurSolver::Weight(double chi2) const {
  return robust_ && chi2 > kChi2TwoDof ? std::sqrt(kChi2TwoDof / chi2) : 1;
}

// Infinite when a point is behind a camera.
double DenseSchurSolver::Cost(const std::vector<Camera>& cameras,
                              const std::vector<Eigen::Vector3d>& points) const {
  double cost = 0;
  for (const DepthPrior& prior : problem_.depth_priors) {
    const double error = prior.WhitenedError(points[prior.point]);
    cost += error * error;
  }
  for (std::size_t point = 0; point < points.size(); ++point) {
    for (std::size_t k = first_term_[point]; k < first_term_[point + 1]; ++k) {
      const Term& term = terms_[k];
      const Camera& camera = cameras[term.view];
      const Eigen::Vector3d p_cam = camera.R * points[point] + camera.t;
      if (p_cam.z() <= 0) return HUGE_VAL;
      const double chi2 = (problem_.camera.Project(p_cam) - term.pixel).squaredNorm() *
                          term.inverse_sigma * term.inverse_sigma;
      cost +=
          !robust_ || chi2 <= kChi2TwoDof ? chi2 : 2 * std::sqrt(kChi2TwoDof * chi2) - kChi2TwoDof;
    }
  }
  return cost;
}

double DenseSchurSolver::ConstraintsCost(const std::vector<Pose>& T_cam_world) const {
  double cost = 0;
  for (const PoseConstraint& constraint : problem_.constraints) {
    cost += ConstraintCost(
        WhitenedError(constraint, T_cam_world[constraint.view], T_cam_world[constraint.anchor])
            .squaredNorm());
  }
  return cost;
}

Derivatives DenseSchurSolver::Derive(const Term& term, const Camera& camera,
                                     const Eigen::Vector3d& p_world) const {
  const CameraModel& model = problem_.camera;
  const Eigen::Vector3d r = camera.R * p_world;
  const Eigen::Vector3d p_cam = r + camera.t;
  const double inverse_z = 1 / p_cam.z();
  const double x = p_cam.x() * inverse_z;
  const double y = p_cam.y() * inverse_z;
  Derivatives at;
  at.error.x() = term.inverse_sigma * (term.pixel.x() - (model.fx * x + model.cx));
  at.error.y() = term.inverse_sigma * (term.pixel.y() - (model.fy * y + model.cy));
  const double weight = Weight(at.error.squaredNorm());
  const double root_weight = weight == 1 ? 1 : std::sqrt(weight);
  at.error *= root_weight;
  // By p_cam: (a, 0, c) and (0, b, d).
  const double a = root_weight * term.inverse_sigma * inverse_z * model.fx;
  const double b = root_weight * term.inverse_sigma * inverse_z * model.fy;
  const double c = -a * x;
  const double d = -b * y;
  for (int i = 0; i < 3; ++i) {
    at.by_point[0][i] = a * camera.R(0, i) + c * camera.R(2, i);
    at.by_point[1][i] = b * camera.R(1, i) + d * camera.R(2, i);
  }
  // By omega, of Exp(omega) r: r x (a, 0, c) and r x (0, b, d).
  at.by_view[0] << c * r.y(), a * r.z() - c * r.x(), -a * r.y(), a, 0, c;
  at.by_view[1] << d * r.y() - b * r.z(), -d * r.x(), b * r.x(), 0, b, d;
  return at;
}

void DenseSchurSolver::LineariseObservations(const std::vector<Camera>& cameras) {
  view_hessians_.assign(free_views_.size(), Matrix6d::Zero());
  view_gradient_.setZero(static_cast<Eigen::Index>(6 * free_views_.size()));
  point_hessians_.assign(problem_.p_world.size(), Eigen::Matrix3d::Zero());
  point_gradients_.assign(problem_.p_world.size(), Eigen::Vector3d::Zero());
  mixed_.resize(terms_.size());
  for (const DepthPrior& prior : problem_.depth_priors) {
    const Eigen::Vector3d& p_world = problem_.p_world[prior.point];
    const Eigen::Vector3d by_point = prior.ErrorByPoint(p_world);
    point_hessians_[prior.point] += by_point * by_point.transpose();
    point_gradients_[prior.point] -= prior.WhitenedError(p_world) * by_point;
  }
  for (std::size_t point = 0; point < problem_.p_world.size(); ++point) {
    const Eigen::Vector3d& p_world = problem_.p_world[point];
    for (std::size_t k = first_term_[point]; k < first_term_[point + 1]; ++k) {
      const Term& term = terms_[k];
      const Derivatives at = Derive(term, cameras[term.view], p_world);
      AddSquare(at.by_point, point_hessians_[point]);
      point_gradients_[point] += at.error.x() * at.by_point[0] + at.error.y() * at.by_point[1];
      if (!term.free_view) continue;
      AddSquare(at.by_view, view_hessians_[*term.free_view]);
      view_gradient_.segment<6>(static_cast<Eigen::Index>(6 * *term.free_view)) +=
          at.error.x() * at.by_view[0] + at.error.y() * at.by_view[1];
      for (int column = 0; column < 3; ++column) {
        mixed_[k].col(column) =
            at.by_point[0][column] * at.by_view[0] + at.by_point[1][column] * at.by_view[1];
      }
    }
  }
}

void DenseSchurSolver::LineariseConstraints() {
  pairs_.clear();
  for (const PoseConstraint& constraint : problem_.constraints) {
    const ConstraintDerivatives at = tracking::Derive(
        constraint, problem_.T_cam_world[constraint.view], problem_.T_cam_world[constraint.anchor]);
    const double weight = ConstraintWeight(at.error.squaredNorm());
    const auto add = [&](std::size_t view, const Matrix6d& by_pose) {
      if (!free_of_[view]) return;
      view_hessians_[*free_of_[view]] += weight * by_pose.transpose() * by_pose;
      view_gradient_.segment<6>(static_cast<Eigen::Index>(6 * *free_of_[view])) -=
          weight * by_pose.transpose() * at.error;
    };
    add(constraint.view, at.by_view);
    add(constraint.anchor, at.by_anchor);
    if (!free_of_[constraint.view] || !free_of_[constraint.anchor]) continue;
    const Matrix6d mixed = weight * at.by_view.transpose() * at.by_anchor;
    const std::size_t row = *free_of_[constraint.view];
    const std::size_t column = *free_of_[constraint.anchor];
    if (row > column) {
      pairs_.push_back({row, column, mixed});
    } else {
      pairs_.push_back({column, row, mixed.transpose()});
    }
  }
}

void DenseSchurSolver::EliminatePoints(double damping) {
  const auto size = static_cast<Eigen::Index>(6 * free_views_.size());
  reduced_.setZero(size, size);
  reduced_gradient_ = view_gradient_;
  point_inverses_.resize(point_hessians_.size());
  for (std::size_t i = 0; i < free_views_.size(); ++i) {
    const auto at = static_cast<Eigen::Index>(6 * i);
    reduced_.block<6, 6>(at, at) = view_hessians_[i];
    reduced_.block<6, 6>(at, at).diagonal() *= 1 + damping;
    // A view without observations stays where it is.
    if (view_hessians_[i].isZero(0)) reduced_.block<6, 6>(at, at).setIdentity();
  }
  for (const ViewPair& pair : pairs_) {
    reduced_.block<6, 6>(static_cast<Eigen::Index>(6 * pair.row),
                         static_cast<Eigen::Index>(6 * pair.column)) += pair.hessian;
  }
  for (std::size_t point = 0; point < point_hessians_.size(); ++point) {
    Eigen::Matrix3d hessian = point_hessians_[point];
    hessian.diagonal() *= 1 + damping;
    // Without parallax a point is free along its ray: a little damping holds it.
    hessian.diagonal().array() += 1e-12 * hessian.trace() + 1e-30;
    point_inverses_[point] = hessian.inverse();
    for (std::size_t a = first_term_[point]; a < first_term_[point + 1]; ++a) {
      if (!terms_[a].free_view) continue;
      const auto row = static_cast<Eigen::Index>(6 * *terms_[a].free_view);
      const Matrix63d weighted = mixed_[a] * point_inverses_[point];
      reduced_gradient_.segment<6>(row).noalias() -= weighted * point_gradients_[point];
      for (std::size_t b = first_term_[point]; b < first_term_[point + 1]; ++b) {
        if (!terms_[b].free_view || *terms_[b].free_view > *terms_[a].free_view) continue;
        const auto column = static_cast<Eigen::Index>(6 * *terms_[b].free_view);
        reduced_.block<6, 6>(row, column).noalias() -= weighted * mixed_[b].transpose();
      }
    }
  }
}

bool DenseSchurSolver::Solve(double damping) {
  EliminatePoints(damping);
  // In place of the lower half.
  const Eigen::LLT<Eigen::Ref<Eigen::MatrixXd>> factors(reduced_);
  if (factors.info() != Eigen::Success) return false;
  view_step_ = factors.solve(reduced_gradient_);
  if (!view_step_.allFinite()) return false;
  point_step_.resize(point_hessians_.size());
  for (std::size_t point = 0; point < point_hessians_.size(); ++point) {
    Eigen::Vector3d gradient = point_gradients_[point];
    for (std::size_t k = first_term_[point]; k < first_term_[point + 1]; ++k) {
      if (!terms_[k].free_view) continue;
      const auto row = static_cast<Eigen::Index>(6 * *terms_[k].free_view);
      gradient.noalias() -= mixed_[k].transpose() * view_step_.segment<6>(row);
    }
    point_step_[point].noalias() = point_inverses_[point] * gradient;
  }
  return true;
}

void DenseSchurSolver::MinimiseDensely(int num_steps, const BundleAdjustmentOptions& options) {
  std::vector<Camera> cameras = Cameras(problem_.T_cam_world);
  double cost = Cost(cameras, problem_.p_world) + ConstraintsCost(problem_.T_cam_world);
  double damping = 1e-5;
  bool is_linearised = false;
  for (int i = 0; i < num_steps; ++i) {
    if (!is_linearised) {
      LineariseObservations(cameras);
      LineariseConstraints();
    }
    is_linearised = true;
    if (!Solve(damping)) {
      damping = damping * 100 + 1e-4;
      continue;
    }
    std::vector<Pose> poses = problem_.T_cam_world;
    for (std::size_t k = 0; k < free_views_.size(); ++k) {
      const Vector6d step = view_step_.segment<6>(static_cast<Eigen::Index>(6 * k));
      Pose& T = poses[free_views_[k]];
      T = Pose(RotationExp(step.head<3>()) * T.rotation(), T.translation() + step.tail<3>());
    }
    std::vector<Eigen::Vector3d> points = problem_.p_world;
    for (std::size_t k = 0; k < points.size(); ++k) points[k] += point_step_[k];
    std::vector<Camera> moved = Cameras(poses);
    const double new_cost = Cost(moved, points) + ConstraintsCost(poses);
    if (!(new_cost < cost)) {
      damping = damping * 100 + 1e-4;
      continue;
    }
    const bool converged = cost - new_cost < options.min_gain * cost;
    problem_.T_cam_world = std::move(poses);
    problem_.p_world = std::move(points);
    cameras = std::move(moved);
    cost = new_cost;
    damping *= 0.1;
    is_linearised = false;
    if (converged || options.IsStopped()) return;
  }
}

}  // namespace

void MinimiseDensely(BundleAdjustmentProblem& problem, const std::vector<char>& left_out,
                     bool robust, int num_steps, const BundleAdjustmentOptions& options) {
  DenseSchurSolver(problem, left_out, robust).MinimiseDensely(num_steps, options);
}

}  // namespace mono3d::tracking
