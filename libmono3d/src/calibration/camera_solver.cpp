// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "calibration/camera_solver.h"

#include <Eigen/Cholesky>
#include <cmath>
#include <cstddef>
#include <optional>
#include <vector>

#include "calibration/camera_equations.h"

namespace mono3d::calibration {
namespace {

constexpr int kMaxLinearisations = 50;
// Of the diagonal of the normal equations. Little at first: damping makes a step gain less, and one
// that gains too little is the last.
constexpr double kFirstDamping = 1e-7;
constexpr double kMaxDamping = 1e12;
constexpr double kDampingAfterSuccess = 0.2;
constexpr double kDampingAfterFailure = 4;
// Of a step, for the second derivative along it.
constexpr double kProbe = 0.1;
// Of the second-order part of a step over the first-order part: beyond, the two terms do not
// describe the path.
constexpr double kMaxSecondOrder = 0.75;

// The method of Levenberg and Marquardt, whose steps have a second-order part (the geodesic
// acceleration of Transtrum and Sethna 2012): where unknowns are hardly told apart, the way to the
// least cost is a narrow bent valley, in which straight steps have to be short.
template <int kNumOfView>
class CameraSolver {
 public:
  explicit CameraSolver(CameraProblem& problem) : problem_(problem) {}

  void Minimise(double min_gain);

 private:
  using Equations = CameraEquations<kNumOfView>;
  using Step = typename Equations::Step;
  using Gradient = typename Equations::Gradient;

  std::optional<CameraProblem::Unknowns> NextUnknowns(const CameraProblem::Unknowns& unknowns,
                                                      double damping);
  std::optional<Step> SecondOrderPart(const CameraProblem::Unknowns& unknowns,
                                      const Step& straight);
  // By a share of a step.
  CameraProblem::Unknowns Moved(CameraProblem::Unknowns unknowns, const Step& step,
                                double share) const;
  Step SolveFor(const Gradient& gradient) const;

  CameraProblem& problem_;
  std::optional<Equations> equations_;  // linearised
  Eigen::LLT<Eigen::MatrixXd> factors_;
};

template <int kNumOfView>
CameraProblem::Unknowns CameraSolver<kNumOfView>::Moved(CameraProblem::Unknowns unknowns,
                                                        const Step& step, double share) const {
  for (std::size_t i = 0; i < unknowns.poses.size(); ++i) {
    const auto of_view =
        step.views_and_cameras.template segment<kNumOfView>(equations_->RowOfImage(i));
    for (Eigen::Index k = 0; k < kNumOfPose; ++k) {
      unknowns.poses[i][static_cast<std::size_t>(k)] += share * of_view[k];
      if constexpr (kNumOfView == kNumOfPoseAndVelocity) {
        unknowns.velocity_changes[i][static_cast<std::size_t>(k)] +=
            share * of_view[kNumOfPose + k];
      }
    }
  }
  for (std::size_t i = 0; i < unknowns.cameras.size(); ++i) {
    unknowns.cameras[i] +=
        share * step.views_and_cameras.template segment<kNumParameters>(equations_->RowOfCamera(i));
  }
  for (std::size_t i = 0; i < unknowns.points.size(); ++i) {
    Eigen::Map<Eigen::Vector3d>(unknowns.points[i].data()) += share * step.points[i];
  }
  return unknowns;
}

template <int kNumOfView>
typename CameraSolver<kNumOfView>::Step CameraSolver<kNumOfView>::SolveFor(
    const Gradient& gradient) const {
  return equations_->WithPoints(-factors_.solve(gradient.reduced), gradient.points);
}

// What bends a straight step along the curvature of the residuals. Nothing where a point gets
// behind its image.
template <int kNumOfView>
std::optional<typename CameraSolver<kNumOfView>::Step> CameraSolver<kNumOfView>::SecondOrderPart(
    const CameraProblem::Unknowns& unknowns, const Step& straight) {
  const std::vector<CameraProblem::Observation>& observations = problem_.observations();
  problem_.set_unknowns(Moved(unknowns, straight, kProbe));
  std::vector<Eigen::Vector2d> curvature;
  curvature.reserve(observations.size());
  for (std::size_t i = 0; i < observations.size(); ++i) {
    const CameraProblem::Linearised& row = equations_->row(i);
    if (row.weight == 0) {
      curvature.emplace_back(0, 0);
      continue;
    }
    const std::optional<Eigen::Vector2d> probe = problem_.Residual(observations[i]);
    if (!probe) return std::nullopt;
    curvature.emplace_back(
        ((row.weight * *probe - row.residual) / kProbe - equations_->Change(i, straight)) / kProbe);
  }
  Gradient gradient = equations_->GradientOf(curvature);
  equations_->Hold(gradient.reduced);
  return SolveFor(gradient);
}

// Nothing where the damping is too small.
template <int kNumOfView>
std::optional<CameraProblem::Unknowns> CameraSolver<kNumOfView>::NextUnknowns(
    const CameraProblem::Unknowns& unknowns, double damping) {
  Eigen::MatrixXd matrix = equations_->Eliminate(damping);
  const Eigen::VectorXd eliminated = matrix.diagonal();
  equations_->AddPriors(matrix);
  const Eigen::VectorXd scale = equations_->Diagonal() + matrix.diagonal() - eliminated;
  matrix.diagonal() += damping * scale;
  equations_->Hold(matrix);
  factors_.compute(matrix);
  if (factors_.info() != Eigen::Success) return std::nullopt;
  std::vector<Eigen::Vector2d> residuals;
  for (std::size_t i = 0; i < problem_.observations().size(); ++i) {
    residuals.push_back(equations_->row(i).residual);
  }
  Gradient gradient = equations_->GradientOf(residuals);
  equations_->AddPriors(gradient.reduced);
  equations_->Hold(gradient.reduced);
  const Step straight = SolveFor(gradient);
  const std::optional<Step> second = SecondOrderPart(unknowns, straight);
  if (!second) return std::nullopt;
  const auto length = [&](const Step& step) {
    return std::sqrt(step.views_and_cameras.cwiseAbs2().dot(scale));
  };
  if (!(length(*second) <= kMaxSecondOrder * length(straight))) return std::nullopt;
  return Moved(Moved(unknowns, straight, 1), *second, 1);
}

template <int kNumOfView>
void CameraSolver<kNumOfView>::Minimise(double min_gain) {
  CameraProblem::CostSum cost = problem_.Cost();
  double damping = kFirstDamping;
  for (int i = 0; i < kMaxLinearisations && damping < kMaxDamping;) {
    if (!equations_) {
      equations_.emplace(problem_);
      ++i;
    }
    const CameraProblem::Unknowns before = problem_.unknowns();
    const std::optional<CameraProblem::Unknowns> next = NextUnknowns(before, damping);
    problem_.set_unknowns(next.value_or(before));
    const CameraProblem::CostSum now = problem_.Cost();
    if (!next || now.num_behind > cost.num_behind || !(now.sum < cost.sum)) {
      problem_.set_unknowns(before);
      damping *= kDampingAfterFailure;
      continue;
    }
    equations_.reset();
    damping *= kDampingAfterSuccess;
    const bool is_last = cost.sum - now.sum <= min_gain * cost.sum;
    cost = now;
    if (is_last) break;
  }
}

}  // namespace

void Solve(CameraProblem& problem, double min_gain) {
  problem.Weigh();
  if (problem.HasVelocities()) {
    CameraSolver<kNumOfPoseAndVelocity>(problem).Minimise(min_gain);
  } else {
    CameraSolver<kNumOfPose>(problem).Minimise(min_gain);
  }
}

}  // namespace mono3d::calibration
