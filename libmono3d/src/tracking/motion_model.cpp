// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/motion_model.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "geometry/geometry_state.h"
#include "image/state_archive.h"

namespace mono3d::tracking {
namespace {

// Of the change from one motion to the next: what polynomials without a later frame, with one, with
// two leave of a shake of 4 Hz at 30 frames a second.
constexpr std::array<double, 3> kSigmaShares = {1, 0.2, 0.02};

// On each side of a frame while it is tracked; what a polynomial through them misses is what more
// frames can miss at most, up to a shake of two fifths of the frame rate.
constexpr std::size_t kFewOnSide = 2;

double PerAxis(const Eigen::Vector3d& difference) { return difference.norm() / std::sqrt(3.); }

}  // namespace

Pose ScaleMotion(const Pose& motion, double factor) {
  return {RotationExp(factor * RotationLog(motion.rotation())), factor * motion.translation()};
}

void MotionModel::Add(const Pose& T_current_previous, double duration_s) {
  if (motions_.size() == kMaxMotions) motions_.erase(motions_.begin());
  motions_.push_back({T_current_previous, duration_s});
}

void MotionModel::Move(std::size_t num_before, const Pose& T_new_old) {
  if (num_before > motions_.size()) return;
  const std::size_t at = motions_.size() - num_before;  // the motion that leads away from it
  if (at < motions_.size()) {
    motions_[at].T_later_earlier = motions_[at].T_later_earlier * T_new_old.Inverse();
  }
  if (at > 0) motions_[at - 1].T_later_earlier = T_new_old * motions_[at - 1].T_later_earlier;
}

void MotionModel::Expect(const Pose& T_next_current, double duration_s) {
  motions_.clear();
  expected_ = {T_next_current, duration_s};
}

std::optional<MotionModel::Motion> MotionModel::Latest() const {
  return motions_.empty() ? expected_ : motions_.back();
}

std::optional<Pose> MotionModel::last() const {
  const std::optional<Motion> latest = Latest();
  if (!latest) return std::nullopt;
  return latest->T_later_earlier;
}

std::optional<Pose> MotionModel::Predict(double duration_s) const {
  const std::optional<Motion> latest = Latest();
  if (!latest) return std::nullopt;
  return ScaleMotion(latest->T_later_earlier,
                     latest->duration_s > 0 ? duration_s / latest->duration_s : 1);
}

// From the frame before the motion `at` to those around it. Where the next but one comes after a
// time of another order it is left out: a polynomial through it would swing in the longer one.
std::vector<LaterPose> MotionModel::Neighbours(std::size_t at, std::size_t on_side) const {
  constexpr double kMaxRatio = 4;  // of the times
  const auto are_alike = [&](std::size_t i, std::size_t j) {
    const double a_s = motions_[i].duration_s;
    const double b_s = motions_[j].duration_s;
    return std::max(a_s, b_s) <= kMaxRatio * std::min(a_s, b_s);
  };
  std::vector<LaterPose> neighbours;
  LaterPose way;
  for (std::size_t i = at; i < std::min(at + on_side, motions_.size()); ++i) {
    if (i > at && !are_alike(i - 1, i)) break;
    way = {motions_[i].T_later_earlier * way.T_later_now, way.time_s + motions_[i].duration_s};
    neighbours.push_back(way);
  }
  way = {};
  for (std::size_t i = at; i > at - std::min(at, on_side); --i) {
    if (i < at && !are_alike(i - 1, i)) break;
    way = {motions_[i - 1].T_later_earlier.Inverse() * way.T_later_now,
           way.time_s - motions_[i - 1].duration_s};
    neighbours.push_back(way);
  }
  return neighbours;
}

VelocityPrior MotionModel::Velocity(std::size_t num_before) const {
  if (motions_.empty() && num_before == 0 && expected_) {
    VelocityPrior prior;
    prior.mean = VelocityOf(expected_->T_later_earlier, expected_->duration_s);
    return prior;
  }
  if (num_before > motions_.size() || motions_.empty()) return {};
  const std::size_t at = motions_.size() - num_before;
  const double unit_s = motions_.back().duration_s;
  const std::optional<CameraVelocity> by_few = VelocityThrough(Neighbours(at, kFewOnSide), unit_s);
  if (!by_few) return {};
  // As many on each side as there are on both: a polynomial swings far away from its middle.
  const std::size_t on_side = std::min({at, num_before, kMaxOnSide});
  if (on_side > kFewOnSide) {
    if (const auto by_all = VelocityThrough(Neighbours(at, on_side), unit_s)) {
      return {*by_all, PerAxis(by_all->angular_rad_per_s - by_few->angular_rad_per_s),
              PerAxis(by_all->linear_su_per_s - by_few->linear_su_per_s)};
    }
  }
  VelocityPrior prior;
  prior.mean = *by_few;
  const CameraVelocity last = VelocityOf(motions_.back().T_later_earlier, unit_s);
  CameraVelocity before;
  if (motions_.size() > 1) {
    const Motion& motion = motions_[motions_.size() - 2];
    before = VelocityOf(motion.T_later_earlier, motion.duration_s);
  }
  const double share = kSigmaShares[std::min(num_before, kSigmaShares.size() - 1)];
  prior.angular_sigma_rad_per_s =
      share * PerAxis(last.angular_rad_per_s - before.angular_rad_per_s);
  prior.linear_sigma_su_per_s = share * PerAxis(last.linear_su_per_s - before.linear_su_per_s);
  return prior;
}

void MotionModel::Rescale(double ratio) {
  const auto rescale = [&](Motion& motion) {
    const Pose& T = motion.T_later_earlier;
    motion.T_later_earlier = Pose(T.rotation(), ratio * T.translation());
  };
  std::ranges::for_each(motions_, rescale);
  if (expected_) rescale(*expected_);
}

template <typename Archive>
void MotionModel::ExchangeState(Archive& archive) {
  const auto exchange = [&](Motion& motion) {
    mono3d::ExchangeState(archive, motion.T_later_earlier);
    ExchangeBounded(archive, motion.duration_s);
  };
  archive.Optional(expected_, exchange);
  archive.List(motions_, exchange);
  if constexpr (Archive::kReads) {
    if (motions_.size() > kMaxMotions) archive.Refuse("contradicts itself");
  }
}

template void MotionModel::ExchangeState(StateWriter&);
template void MotionModel::ExchangeState(StateReader&);

}  // namespace mono3d::tracking
