// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/geo/ground_control.h"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <utility>

#include "geo/position_fit.h"
#include "mono3d/core/error.h"
#include "mono3d/geometry/sight_lines.h"

namespace mono3d {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

// Translation and rotation in m and rad, logarithm of the scale: Georeference::covariance without
// the clock.
using Change = Eigen::Matrix<double, 7, 1>;
using ChangeInformation = Eigen::Matrix<double, 7, 7>;

constexpr std::size_t kFewestPoints = 3;
// In standard deviations: of 10,000 errors less than one is beyond (see kFarPosition).
constexpr double kFarMark = 5;
// A height that nobody has measured.
constexpr double kUnsurveyedHeight_m = 1e4;

// Below that the depth of a point is worse than ten times what it is off across.
constexpr double kLeastParallax_rad = 1.5 * std::numbers::pi / 180;

// A control point in the axes of the map.
struct SeenPoint {
  std::size_t point = 0;  // in GroundControl::points
  Vector3d p_enu_m;       // as surveyed; z 0 where it was not
  Vector3d p_map;
  Matrix3d covariance_map;
  Vector3d sigma_m;  // of the survey
};

bool HasHeight(const SeenPoint& point) { return point.sigma_m.z() < kUnsurveyedHeight_m; }

const FrameInMap* FrameOf(std::span<const FrameInMap> frames, std::int64_t index) {
  const auto found = std::ranges::lower_bound(frames, index, {}, &FrameInMap::frame_index);
  return found != frames.end() && found->frame_index == index ? &*found : nullptr;
}

const char* ToText(SightLineProblem problem) {
  switch (problem) {
    case SightLineProblem::kTooFew:
      return "fewer than two of its images have a pose";
    case SightLineProblem::kNoParallax:
      return "its images show it from one place";
    case SightLineProblem::kContradiction:
      return "its marks contradict each other";
    case SightLineProblem::kNone:
      break;
  }
  return "";
}

// Where the camera was when the line of a mark was read.
Pose T_map_line(const FrameInMap& frame, const ControlSight& sight) {
  if (sight.line_s == 0) return frame.T_map_cam;
  return frame.T_map_cam * frame.velocity.T_later_now(sight.line_s).Inverse();
}

// The mark's ray, moved by as much as the camera's motion moves the point from the mark's line to
// the middle one.
Vector3d RayAtMiddleLine(const FrameInMap& frame, const ControlSight& sight,
                         const Vector3d& p_map) {
  const Vector3d p_line = T_map_line(frame, sight).Inverse() * p_map;
  const Vector3d p_middle = frame.T_map_cam.Inverse() * p_map;
  if (!(p_line.z() > 0) || !(p_middle.z() > 0)) return sight.ray_cam;
  return sight.ray_cam + (p_middle / p_middle.z() - p_line / p_line.z());
}

// The sights of a point whose images have a pose.
struct SightsInMap {
  std::vector<SightLine> lines;
  std::vector<const ControlSight*> sights;  // of each
};

SightsInMap SightsOf(std::span<const FrameInMap> frames, const ControlPoint& point,
                     const GroundControlOptions& options) {
  SightsInMap sights;
  for (const ControlSight& sight : point.sights) {
    const FrameInMap* frame = FrameOf(frames, sight.frame_index);
    if (frame == nullptr) continue;
    sights.lines.push_back(
        {T_map_line(*frame, sight), sight.ray_cam, options.pixel_px / sight.focal_px});
    sights.sights.push_back(&sight);
  }
  return sights;
}

Matrix3d CrossOfArm(const Vector3d& v) {
  Matrix3d cross;
  cross << 0, -v.z(), v.y(), v.z(), 0, -v.x(), -v.y(), v.x(), 0;
  return cross;
}

// What one point says of the similarity, in its own standard deviations.
struct PointEquations {
  Eigen::Matrix<double, 3, 7> jacobian;
  Vector3d residual;
};

PointEquations EquationsOf(const SeenPoint& point, const MapPlacement& placement) {
  const Matrix3d rotation = placement.rotation.toRotationMatrix();
  const Vector3d arm =
      placement.rotation * (placement.scale * (point.p_map - placement.centre_map));
  Matrix3d covariance =
      placement.scale * placement.scale * rotation * point.covariance_map * rotation.transpose();
  covariance.diagonal() += point.sigma_m.cwiseAbs2();
  const Matrix3d root = covariance.llt().matrixL();
  PointEquations equations;
  equations.jacobian << Matrix3d::Identity(), -CrossOfArm(arm), arm;
  const auto lower = root.triangularView<Eigen::Lower>();
  equations.jacobian = lower.solve(equations.jacobian);
  equations.residual = lower.solve(point.p_enu_m - placement * point.p_map);
  return equations;
}

// Similarity by least squares over the points that are used.
class ControlFit {
 public:
  ControlFit(std::vector<SeenPoint> points, const std::optional<UpDirection>& up)
      : points_(std::move(points)), up_(up), is_used_(points_.size(), 1) {}

  // False, with a reason, where the points do not determine it.
  bool Find(std::string& reason) {
    if (!FindStart(reason)) return false;
    // Each time the worst one goes, as long as enough are left that contradict it.
    while (true) {
      if (!Solve(reason)) return false;
      const std::optional<std::size_t> worst = Contradicted();
      if (!worst) return true;
      is_used_[*worst] = 0;
    }
  }

  const std::vector<SeenPoint>& points() const { return points_; }
  bool is_used(std::size_t i) const { return is_used_[i] != 0; }
  const MapPlacement& placement() const { return placement_; }

  // With what the points' own scatter says of how well they are known, beside what was stated.
  ChangeInformation Covariance() const {
    const double chi2 = Chi2(Equations(), Change::Zero(), points_.size());
    return (chi2 + kWorth) / (std::max(0.0, NumFree()) + kWorth) * covariance_;
  }

 private:
  // What the stated standard deviations are worth, in independent errors.
  static constexpr double kWorth = 4;

  std::size_t NumUsed() const { return static_cast<std::size_t>(std::ranges::count(is_used_, 1)); }

  bool FindStart(std::string& reason) {
    // Heights that were not surveyed: as if in the middle of the others.
    double height_m = 0, num_heights = 0;
    for (const SeenPoint& point : points_) {
      if (!HasHeight(point)) continue;
      height_m += point.p_enu_m.z();
      ++num_heights;
    }
    std::vector<PositionPair> pairs;
    for (const SeenPoint& point : points_) {
      PositionPair pair;
      pair.p_enu_m = point.p_enu_m;
      if (!HasHeight(point)) pair.p_enu_m.z() = height_m / std::max(1.0, num_heights);
      pair.p_map = point.p_map;
      pairs.push_back(pair);
    }
    constexpr double kTypical_m = 0.1;  // below that all are equally good for a start
    placement_ = FitRobustly(pairs, kTypical_m);
    if (!std::isfinite(placement_.scale) || !(placement_.scale > 0)) {
      reason = "the control points are all in one place";
      return false;
    }
    if (up_) placement_ = RolledUpright(pairs, placement_, up_->up_map, kTypical_m, true);
    return true;
  }

  std::vector<PointEquations> Equations() const {
    std::vector<PointEquations> equations;
    for (const SeenPoint& point : points_) equations.push_back(EquationsOf(point, placement_));
    return equations;
  }

  // Of the points that are used, without one of them.
  double Chi2(const std::vector<PointEquations>& equations, const Change& change,
              std::size_t left_out) const {
    double sum = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (is_used_[i] == 0 || i == left_out) continue;
      sum += (equations[i].residual - equations[i].jacobian * change).squaredNorm();
    }
    return sum;
  }

  double NumFree() const {
    double num_rows = up_ ? 2 : 0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (is_used_[i] != 0) num_rows += HasHeight(points_[i]) ? 3 : 2;
    }
    return num_rows - 7;
  }

  void AddUp(ChangeInformation& information, Change& gradient) const {
    if (!up_) return;
    const Vector3d up = placement_.rotation * up_->up_map;
    const Eigen::Matrix<double, 2, 3> rows = -CrossOfArm(up).topRows<2>() / up_->sigma_rad;
    information.block<3, 3>(3, 3) += rows.transpose() * rows;
    gradient.segment<3>(3) += rows.transpose() * (-up.head<2>() / up_->sigma_rad);
  }

  bool Solve(std::string& reason) {
    constexpr int kRounds = 20;
    for (int round = 0; round < kRounds; ++round) {
      information_.setZero();
      gradient_.setZero();
      AddUp(information_, gradient_);
      const std::vector<PointEquations> equations = Equations();
      for (std::size_t i = 0; i < points_.size(); ++i) {
        if (is_used_[i] == 0) continue;
        information_ += equations[i].jacobian.transpose() * equations[i].jacobian;
        gradient_ += equations[i].jacobian.transpose() * equations[i].residual;
      }
      if (!IsDetermined(information_)) {
        reason = "the control points lie on a line, and nothing tells which way is up";
        return false;
      }
      const Eigen::LDLT<ChangeInformation> solver(information_);
      covariance_ = solver.solve(ChangeInformation::Identity());
      const Change change = solver.solve(gradient_);
      MapPlacement::Increment increment = MapPlacement::Increment::Zero();
      increment.head<7>() = change;
      placement_.Add(increment);
      constexpr double kOfSigma = 1e-3;
      const Change sigma = covariance_.diagonal().cwiseSqrt();
      if ((change.array().abs() <= kOfSigma * sigma.array()).all()) return true;
    }
    return true;
  }

  static bool IsDetermined(const ChangeInformation& information) {
    constexpr double kLargestCondition = 1e12;
    const Change scale = information.diagonal().cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    const ChangeInformation scaled = scale.asDiagonal() * information * scale.asDiagonal();
    const Eigen::SelfAdjointEigenSolver<ChangeInformation> values(scaled, Eigen::EigenvaluesOnly);
    return values.eigenvalues().minCoeff() * kLargestCondition > values.eigenvalues().maxCoeff();
  }

  // The point that is farthest from where the fit of all others has it, in the standard deviations
  // of both and of the others' own scatter; nothing where that may be chance.
  std::optional<std::size_t> Contradicted() const {
    if (NumUsed() <= kFewestPoints) return std::nullopt;
    const std::vector<PointEquations> equations = Equations();
    std::optional<std::size_t> worst;
    double most = kFarMark * kFarMark;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (is_used_[i] == 0) continue;
      const auto& [jacobian, residual] = equations[i];
      const ChangeInformation others = information_ - jacobian.transpose() * jacobian;
      if (!IsDetermined(others)) continue;
      const Eigen::LDLT<ChangeInformation> solver(others);
      // The gradient vanishes at the fit of all.
      const Change change = solver.solve(Change(-jacobian.transpose() * residual));
      const double free = std::max(0.0, NumFree() - 3);
      const double scatter = (Chi2(equations, change, i) + kWorth) / (free + kWorth);
      const Vector3d off = residual - jacobian * change;
      Matrix3d expected = jacobian * solver.solve(jacobian.transpose()) + Matrix3d::Identity();
      expected *= std::max(1.0, scatter);
      const double squared = off.dot(expected.ldlt().solve(off)) / 3;
      if (!(squared > most)) continue;
      most = squared;
      worst = i;
    }
    return worst;
  }

  std::vector<SeenPoint> points_;
  std::optional<UpDirection> up_;
  std::vector<char> is_used_;
  MapPlacement placement_;
  ChangeInformation information_ = ChangeInformation::Zero();
  ChangeInformation covariance_ = ChangeInformation::Zero();
  Change gradient_ = Change::Zero();
};

Vector3d SurveyedAt(const ControlPoint& point, const Geodetic& origin) {
  Vector3d p_enu_m = ToEnu(point.place, origin);
  if (!point.has_height) p_enu_m.z() = 0;
  return p_enu_m;
}

// Where the images of a map show a control point, and what became of it.
struct LookedAt {
  SightsInMap sights;
  SightLineResult met;
};

LookedAt LookAt(std::span<const FrameInMap> frames, const ControlPoint& point,
                const GroundControlOptions& options) {
  LookedAt looked{SightsOf(frames, point, options), {}};
  looked.met = MeetSightLines(looked.sights.lines, kLeastParallax_rad, kFarMark);
  return looked;
}

ControlResidual ResidualOf(const ControlPoint& point, const LookedAt& looked,
                           const Georeference& georeference) {
  ControlResidual residual;
  residual.name = point.name;
  residual.is_check = point.is_check;
  residual.has_height = point.has_height;
  residual.num_marks = point.sights.size();
  if (!looked.met.meeting) {
    residual.why_unused = ToText(looked.met.problem);
    return residual;
  }
  const SightLineMeeting& meeting = *looked.met.meeting;
  residual.is_seen = true;
  const Vector3d p_enu_m = SurveyedAt(point, georeference.origin);
  const Vector3d seen_m = georeference.S_enu_map * meeting.p_world;
  residual.enu_m = seen_m - p_enu_m;
  if (!point.has_height) residual.enu_m.z() = 0;
  // In the images: where the map shows the surveyed place, at the height that it has itself where
  // none was surveyed.
  Vector3d shown_m = p_enu_m;
  if (!point.has_height) shown_m.z() = seen_m.z();
  const Vector3d p_map = georeference.S_enu_map.Inverse() * shown_m;
  double sum_px2 = 0;
  for (std::size_t i = 0; i < looked.sights.lines.size(); ++i) {
    const ControlSight& sight = *looked.sights.sights[i];
    if (meeting.is_outlier[i] != 0) {
      residual.contradicting_images.push_back(sight.image);
      continue;
    }
    ++residual.num_marks_used;
    const auto error = SightLineError(looked.sights.lines[i], p_map);
    sum_px2 += error ? (sight.focal_px * *error).squaredNorm() : 0;
  }
  residual.rms_px =
      std::sqrt(sum_px2 / static_cast<double>(std::max<std::size_t>(1, residual.num_marks_used)));
  return residual;
}

}  // namespace

void GroundControlOptions::Visit(OptionVisitor& visit) {
  visit("horizontal_m", horizontal_m,
        "standard deviation of ground control points, east and north each, metres");
  visit("vertical_m", vertical_m, "the same, up");
  visit("pixel_px", pixel_px, "standard deviation of their marks in the images, pixels");
}

void GroundControlOptions::Validate() const {
  const auto require = [](double value, const char* name) {
    RequireOption(std::isfinite(value) && value > 0, name, "more than 0", value);
  };
  require(horizontal_m, "control.horizontal_m");
  require(vertical_m, "control.vertical_m");
  require(pixel_px, "control.pixel_px");
}

std::optional<Geodetic> OriginOf(const GroundControl& control) {
  if (control.points.empty()) return std::nullopt;
  return control.points.front().place;
}

GeoreferenceResult EstimateGeoreference(std::span<const FrameInMap> frames,
                                        const GroundControl& control, const Geodetic& origin,
                                        const std::optional<UpDirection>& up) {
  control.options.Validate();
  std::vector<LookedAt> looked;
  std::vector<SeenPoint> seen;
  for (std::size_t i = 0; i < control.points.size(); ++i) {
    const ControlPoint& point = control.points[i];
    looked.push_back(LookAt(frames, point, control.options));
    const std::optional<SightLineMeeting>& meeting = looked.back().met.meeting;
    if (!meeting || point.is_check) continue;
    const double vertical_m = point.has_height ? control.options.vertical_m : kUnsurveyedHeight_m;
    seen.push_back({i,
                    SurveyedAt(point, origin),
                    meeting->p_world,
                    meeting->covariance,
                    {control.options.horizontal_m, control.options.horizontal_m, vertical_m}});
  }
  if (seen.size() < kFewestPoints) {
    return {std::nullopt, std::to_string(seen.size()) + " usable control point" +
                              (seen.size() == 1 ? "" : "s") + " in this map, three needed"};
  }
  ControlFit fit(std::move(seen), up);
  std::string reason;
  if (!fit.Find(reason)) return {std::nullopt, reason};
  Georeference result;
  result.origin = origin;
  result.S_enu_map = fit.placement().ToSimilarity();
  result.has_altitude = control.has_altitude;
  result.is_by_control = true;
  result.covariance.topLeftCorner<7, 7>() = fit.Covariance();
  const Eigen::Matrix<double, 8, 1> sigma = result.covariance.diagonal().cwiseSqrt();
  result.position_sigma_m = sigma.head<3>();
  result.tilt_sigma_rad = sigma.segment<2>(3).maxCoeff();
  result.heading_sigma_rad = sigma[5];
  result.scale_sigma = sigma[6];
  // Beyond, errors are no longer small against what they are errors of.
  constexpr double kLargestScaleSigma = 0.2;
  constexpr double kLargestAngleSigma = 0.35;  // rad
  if (!(result.scale_sigma < kLargestScaleSigma) ||
      !(sigma.segment<3>(3).maxCoeff() < kLargestAngleSigma)) {
    return {std::nullopt, "the control points are too near to each other for their errors"};
  }
  for (std::size_t i = 0; i < control.points.size(); ++i) {
    result.control.push_back(ResidualOf(control.points[i], looked[i], result));
  }
  for (std::size_t i = 0; i < fit.points().size(); ++i) {
    ControlResidual& residual = result.control[fit.points()[i].point];
    residual.is_used = fit.is_used(i);
    if (!residual.is_used) residual.why_unused = "it contradicts the other control points";
  }
  return {std::move(result), {}};
}

std::vector<ControlResidual> ControlResidualsOf(std::span<const FrameInMap> frames,
                                                const GroundControl& control,
                                                const Georeference& georeference) {
  std::vector<ControlResidual> residuals;
  for (const ControlPoint& point : control.points) {
    residuals.push_back(ResidualOf(point, LookAt(frames, point, control.options), georeference));
  }
  return residuals;
}

std::vector<KnownPoint> KnownPointsOf(std::span<const FrameInMap> frames,
                                      const GroundControl& control,
                                      const Georeference& georeference) {
  std::vector<KnownPoint> known;
  for (std::size_t i = 0; i < georeference.control.size(); ++i) {
    const ControlResidual& residual = georeference.control[i];
    if (!residual.is_used) continue;
    const ControlPoint& point = control.points[i];
    const double vertical_m = point.has_height ? control.options.vertical_m : 0;
    KnownPoint& target = known.emplace_back();
    target.p_m = SurveyedAt(point, georeference.origin);
    target.sigma_m = {control.options.horizontal_m, control.options.horizontal_m, vertical_m};
    const std::optional<SightLineMeeting> meeting =
        LookAt(frames, point, control.options).met.meeting;
    for (const ControlSight& sight : point.sights) {
      if (std::ranges::count(residual.contradicting_images, sight.image) > 0) continue;
      const FrameInMap* frame = FrameOf(frames, sight.frame_index);
      const bool is_moved = frame != nullptr && meeting && sight.line_s != 0;
      target.sights.push_back(
          {sight.frame_index,
           is_moved ? RayAtMiddleLine(*frame, sight, meeting->p_world) : sight.ray_cam,
           control.options.pixel_px / sight.focal_px});
    }
  }
  return known;
}

}  // namespace mono3d
