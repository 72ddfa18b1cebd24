// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/photos/photo_scene.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <opencv2/calib3d.hpp>
#include <opencv2/core/eigen.hpp>
#include <utility>

#include "mono3d/core/statistics.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/geometry/triangulation.h"
#include "tracking/motion_model.h"
#include "tracking/optimisation/bundle_adjustment.h"
#include "tracking/optimisation/chi2.h"
#include "tracking/optimisation/pose_optimisation.h"
#include "tracking/photos/mirrored_pose.h"
#include "tracking/start/model_comparison.h"

namespace mono3d::tracking {
namespace {

// Of P3P, which has the errors of a camera that is not known exactly: 0.5 % of the width.
constexpr double kMaxP3pErrorShare = 0.005;
// Of the points that a photo should show, so many agree with its pose by chance.
constexpr double kMinP3pShare = 0.2;

cv::UsacParams P3pParams(double threshold_px, int seed) {
  cv::UsacParams params;
  params.confidence = 0.9999;
  params.isParallel = false;
  params.loIterations = 5;
  params.loMethod = cv::LOCAL_OPTIM_INNER_LO;
  params.loSampleSize = 14;
  params.maxIterations = 5000;
  params.randomGeneratorState = seed;
  params.sampler = cv::SAMPLING_UNIFORM;
  params.score = cv::SCORE_METHOD_MSAC;
  params.threshold = threshold_px;
  return params;
}

// Nothing where too few agree on one.
std::optional<Pose> SolveP3p(const CameraModel& camera,
                             const std::vector<PointMeasurement>& measurements, double max_error_px,
                             int seed) {
  std::vector<cv::Point3d> points;
  std::vector<cv::Point2d> pixels;
  for (const PointMeasurement& measurement : measurements) {
    points.emplace_back(measurement.p_world.x(), measurement.p_world.y(), measurement.p_world.z());
    pixels.emplace_back(measurement.pixel.x(), measurement.pixel.y());
  }
  cv::Mat K;
  cv::eigen2cv(camera.Matrix(), K);
  cv::Mat rotation;
  cv::Mat translation;
  cv::Mat inliers;
  const bool is_found = cv::solvePnPRansac(points, pixels, K, cv::noArray(), rotation, translation,
                                           inliers, P3pParams(max_error_px, seed));
  if (!is_found || rotation.total() != 3 || translation.total() != 3) return std::nullopt;
  Eigen::Vector3d omega;
  Eigen::Vector3d t;
  cv::cv2eigen(rotation.reshape(1, 3), omega);
  cv::cv2eigen(translation.reshape(1, 3), t);
  if (!omega.allFinite() || !t.allFinite()) return std::nullopt;
  return Pose(RotationExp(omega), t);
}

// Of each measurement, as far as it may be one of the pose.
std::vector<double> LossesOf(const CameraModel& camera, const Pose& T_cam_world,
                             const std::vector<PointMeasurement>& measurements) {
  std::vector<double> losses;
  for (const PointMeasurement& measurement : measurements) {
    const Eigen::Vector3d p_cam = T_cam_world * measurement.p_world;
    double loss = kChi2TwoDof;
    if (p_cam.z() > 0) {
      const MeasurementNoise noise = NoiseOf(camera, T_cam_world.rotation(), p_cam, measurement);
      loss = std::min(loss, noise.Chi2(camera.Project(p_cam) - measurement.pixel));
    }
    losses.push_back(loss);
  }
  return losses;
}

// Those that are where the pose has them.
std::vector<PointMeasurement> NearTo(const CameraModel& camera, const Pose& T_cam_world,
                                     const std::vector<PointMeasurement>& measurements,
                                     double max_error_px) {
  std::vector<PointMeasurement> near;
  for (const PointMeasurement& measurement : measurements) {
    const Eigen::Vector3d p_cam = T_cam_world * measurement.p_world;
    if (p_cam.z() <= 0) continue;
    const double error_px = (camera.Project(p_cam) - measurement.pixel).norm();
    if (error_px <= max_error_px) near.push_back(measurement);
  }
  return near;
}

// By those alone that agree with the start. Where a building repeats itself, a fifth of the points
// is off by a window or two, all alike, and together they would pull the pose away from the others.
PoseEstimate OptimiseNear(const CameraModel& camera, const Pose& start,
                          const std::vector<PointMeasurement>& measurements, double max_error_px) {
  return OptimisePose(camera, start, NearTo(camera, start, measurements, max_error_px));
}

double AngleBetween(const PoseEstimate& a, const PoseEstimate& b) {
  return a.T_cam_world.rotation().angularDistance(b.T_cam_world.rotation());
}

}  // namespace

PhotoScene::PhotoScene(const CameraModel& camera, const std::vector<PhotoFeatures>& photos,
                       std::span<const PhotoPair> pairs, double min_parallax_deg)
    : camera_(camera),
      photos_(photos),
      max_cosine_(std::cos(min_parallax_deg * std::numbers::pi / 180)),
      tracks_(JoinPhotoMatches(photos, pairs)),
      seen_(photos.size()),
      T_cam_world_(photos.size()),
      centre_(photos.size(), Eigen::Vector3d::Zero()),
      shutters_(photos.size()),
      moved_(photos.size()) {
  for (std::size_t track = 0; track < tracks_.size(); ++track) {
    const auto& observations = tracks_[track].observations;
    for (std::size_t i = 0; i < observations.size(); ++i) {
      seen_[observations[i].photo].push_back({track, i});
    }
  }
}

double PhotoScene::MaxPoseError_px() const { return kMaxP3pErrorShare * camera_.width; }

void PlacedScene::Transform(const Similarity& S_new_world) {
  for (Photo& photo : photos) {
    photo.T_cam_world = (S_new_world * photo.T_cam_world.Inverse()).Inverse();
    photo.shutter.Rescale(S_new_world.scale());
  }
  for (Point& point : points) point.p_world = S_new_world * point.p_world;
}

PlacedScene PhotoScene::Placed() const {
  PlacedScene placed;
  for (const std::size_t photo : posed_) {
    placed.photos.push_back({photo, *T_cam_world_[photo], shutters_[photo], moved_[photo]});
  }
  for (std::size_t track = 0; track < tracks_.size(); ++track) {
    if (tracks_[track].p_world) placed.points.push_back({track, *tracks_[track].p_world});
  }
  return placed;
}

void PhotoScene::Place(const PlacedScene& placed) {
  Clear();
  for (const PlacedScene::Photo& photo : placed.photos) {
    SetPose(photo.photo, photo.T_cam_world);
    shutters_[photo.photo] = photo.shutter;
    moved_[photo.photo] = photo.moved;
  }
  for (const PlacedScene::Point& point : placed.points) {
    tracks_[point.track].p_world = point.p_world;
    MarkFitting(tracks_[point.track]);
  }
}

void PhotoScene::Clear() {
  while (!posed_.empty()) RemovePose(posed_.back());
  for (PhotoTrack& track : tracks_) track.p_world.reset();
  ForgetShutters();
}

void PhotoScene::SetPose(std::size_t photo, const Pose& T_cam_world) {
  if (!T_cam_world_[photo]) posed_.push_back(photo);
  T_cam_world_[photo] = T_cam_world;
  centre_[photo] = T_cam_world.Inverse().translation();
}

void PhotoScene::RemovePose(std::size_t photo) {
  T_cam_world_[photo].reset();
  std::erase(posed_, photo);
  for (const Seen& seen : seen_[photo]) {
    tracks_[seen.track].observations[seen.observation].fits = false;
  }
}

void PhotoScene::ForgetShutters() {
  shutters_.assign(photos_.size(), ShutterMotion());
  for (std::vector<Eigen::Vector2d>& pixels : moved_) pixels.clear();
}

void PhotoScene::FollowShutters(std::span<const PhotoTime> times) {
  constexpr std::size_t kOnSide = MotionModel::kMaxOnSide;
  std::vector<std::size_t> in_time = posed_;
  std::ranges::stable_sort(in_time, {},
                           [&](std::size_t photo) { return times[photo].timestamp_s; });
  std::vector<ShutterMotion> found(photos_.size());
  for (std::size_t i = 0; i < in_time.size(); ++i) {
    const std::size_t photo = in_time[i];
    MotionModel motion;
    const std::size_t first = i - std::min(i, kOnSide);
    const std::size_t last = std::min(i + kOnSide, in_time.size() - 1);
    for (std::size_t k = first + 1; k <= last; ++k) {
      const std::size_t before = in_time[k - 1];
      const std::size_t after = in_time[k];
      motion.Add(*T_cam_world_[after] * T_cam_world_[before]->Inverse(),
                 times[after].timestamp_s - times[before].timestamp_s);
    }
    found[photo] = {times[photo].sensor, motion.Velocity(last - i).mean};
  }
  shutters_ = std::move(found);
  for (std::size_t photo = 0; photo < photos_.size(); ++photo) MoveToMiddleLine(photo);
}

double PhotoScene::MedianDepth(std::size_t photo) const {
  std::vector<double> depths;
  for (const Seen& seen : seen_[photo]) {
    const PhotoTrack& track = tracks_[seen.track];
    if (track.p_world && At(seen).fits) {
      depths.push_back((*T_cam_world_[photo] * *track.p_world).z());
    }
  }
  return depths.empty() ? 1 : UpperMedian(std::move(depths));
}

// What is no point yet is taken to be as far away as most of what is.
void PhotoScene::MoveToMiddleLine(std::size_t photo) {
  moved_[photo].clear();
  const ShutterMotion& shutter = shutters_[photo];
  if (shutter.IsStill()) return;
  const std::vector<Eigen::Vector2d>& pixels = photos_[photo].pixels;
  const double depth = MedianDepth(photo);
  for (const Eigen::Vector2d& pixel : pixels) {
    moved_[photo].push_back(shutter.AtMiddleLine(camera_, pixel, depth * camera_.Unproject(pixel)));
  }
  for (const Seen& seen : seen_[photo]) {
    const PhotoTrack& track = tracks_[seen.track];
    if (!track.p_world || !At(seen).fits) continue;
    const std::size_t feature = At(seen).feature;
    moved_[photo][feature] =
        shutter.AtMiddleLine(camera_, pixels[feature], *T_cam_world_[photo] * *track.p_world);
  }
}

int PhotoScene::NumPointsFor(std::size_t photo) const {
  return static_cast<int>(std::ranges::count_if(
      seen_[photo], [&](const Seen& seen) { return tracks_[seen.track].p_world.has_value(); }));
}

int PhotoScene::NumFitting(std::size_t photo) const {
  return static_cast<int>(std::ranges::count_if(seen_[photo], [&](const Seen& seen) {
    return tracks_[seen.track].p_world.has_value() && At(seen).fits;
  }));
}

std::vector<double> PhotoScene::Losses(const std::vector<char>& is_chosen) const {
  std::vector<double> losses;
  for (const PhotoTrack& track : tracks_) {
    for (const PhotoObservation& observation : track.observations) {
      if (is_chosen[observation.photo] == 0) continue;
      double loss = kChi2TwoDof;
      if (observation.fits && track.p_world) {
        const Eigen::Vector3d p_cam = *T_cam_world_[observation.photo] * *track.p_world;
        const double error_px = (camera_.Project(p_cam) - Pixel(observation)).norm();
        loss = std::min(loss, std::pow(error_px / Sigma_px(observation), 2));
      }
      losses.push_back(loss);
    }
  }
  return losses;
}

// Where the photos know it least, and by how much: along the sights, where they are close.
Eigen::Vector3d PhotoScene::DepthAxis(const PhotoTrack& track) const {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const PhotoObservation& seen : track.observations) {
    if (!seen.fits) continue;
    const Eigen::Vector3d p_cam = *T_cam_world_[seen.photo] * *track.p_world;
    const Eigen::Matrix<double, 2, 3> J = ProjectionJacobian(camera_, p_cam, p_cam).rightCols<3>() *
                                          T_cam_world_[seen.photo]->rotation().toRotationMatrix() /
                                          Sigma_px(seen);
    information += J.transpose() * J;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(information);
  return solver.eigenvectors().col(0) / std::sqrt(solver.eigenvalues()(0));
}

std::vector<Pose> PhotoScene::FindPoses(std::size_t photo, int min_inliers, int seed) const {
  std::vector<PointMeasurement> measurements;
  std::vector<const PhotoTrack*> tracks;
  for (const Seen& seen : seen_[photo]) {
    const PhotoTrack& track = tracks_[seen.track];
    if (!track.p_world) continue;
    measurements.push_back({*track.p_world, Pixel(At(seen)), Sigma_px(At(seen))});
    tracks.push_back(&track);
  }
  if (static_cast<int>(measurements.size()) < std::max(min_inliers, kMinPoseInliers)) {
    return {};
  }
  const std::optional<Pose> start = SolveP3p(camera_, measurements, MaxPoseError_px(), seed);
  if (!start) return {};
  PoseEstimate estimate = OptimiseNear(camera_, *start, measurements, MaxPoseError_px());
  const auto is_enough = [&](const PoseEstimate& of) {
    return of.num_inliers >= min_inliers &&
           of.num_inliers >= kMinP3pShare * static_cast<double>(measurements.size());
  };
  if (!is_enough(estimate)) return {};
  std::vector<Eigen::Vector3d> p_world;
  for (const PointMeasurement& near :
       NearTo(camera_, estimate.T_cam_world, measurements, MaxPoseError_px())) {
    p_world.push_back(near.p_world);
  }
  const Pose mirrored = MirroredPose(estimate.T_cam_world, p_world);
  const PoseEstimate other = OptimiseNear(camera_, mirrored, measurements, MaxPoseError_px());
  // Where what it shows is no plane, or is near, the other one comes back to the first.
  if (!is_enough(other) ||
      AngleBetween(other, estimate) <
          0.5 * mirrored.rotation().angularDistance(estimate.T_cam_world.rotation())) {
    return {estimate.T_cam_world};
  }
  for (std::size_t i = 0; i < measurements.size(); ++i) {
    measurements[i].depth_axis = DepthAxis(*tracks[i]);
  }
  const std::vector<double> losses = LossesOf(camera_, estimate.T_cam_world, measurements);
  const std::vector<double> losses_other = LossesOf(camera_, other.T_cam_world, measurements);
  if (IsClearlyBetterOfInliers(losses, losses_other, kChi2TwoDof)) return {estimate.T_cam_world};
  if (IsClearlyBetterOfInliers(losses_other, losses, kChi2TwoDof)) return {other.T_cam_world};
  return {estimate.T_cam_world, other.T_cam_world};
}

std::optional<Pose> PhotoScene::FindPose(std::size_t photo, int min_inliers, int seed) const {
  const std::vector<Pose> poses = FindPoses(photo, min_inliers, seed);
  if (poses.size() != 1) return std::nullopt;
  return poses.front();
}

bool PhotoScene::Fits(const PhotoObservation& observation, const Eigen::Vector3d& p_world) const {
  const std::optional<Pose>& T_cam_world = T_cam_world_[observation.photo];
  if (!T_cam_world) return false;
  const Eigen::Vector3d p_cam = *T_cam_world * p_world;
  if (!(p_cam.z() > 0)) return false;
  const double error = (camera_.Project(p_cam) - Pixel(observation)).norm();
  return error <= std::sqrt(kChi2TwoDof) * Sigma_px(observation);
}

bool PhotoScene::HasParallax(const PhotoTrack& track, const Eigen::Vector3d& p_world) const {
  const auto& all = track.observations;
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (!all[i].fits) continue;
    for (std::size_t k = i + 1; k < all.size(); ++k) {
      if (!all[k].fits) continue;
      if (CosParallax(p_world, centre_[all[i].photo], centre_[all[k].photo]) < max_cosine_) {
        return true;
      }
    }
  }
  return false;
}

bool PhotoScene::MarkFitting(PhotoTrack& track) const {
  if (!track.p_world) return false;
  int num_fitting = 0;
  for (PhotoObservation& observation : track.observations) {
    observation.fits = Fits(observation, *track.p_world);
    num_fitting += observation.fits ? 1 : 0;
  }
  if (num_fitting >= 2 && HasParallax(track, *track.p_world)) return true;
  track.p_world.reset();
  for (PhotoObservation& observation : track.observations) observation.fits = false;
  return false;
}

// By the pairs of its photos: the point that most of them agree with.
void PhotoScene::TriangulateTrack(PhotoTrack& track) const {
  constexpr std::size_t kMaxPairs = 30;
  std::vector<std::size_t> posed;
  for (std::size_t i = 0; i < track.observations.size(); ++i) {
    if (T_cam_world_[track.observations[i].photo]) posed.push_back(i);
  }
  if (posed.size() < 2) return;
  std::optional<Eigen::Vector3d> best;
  int best_count = 1;
  double best_cosine = max_cosine_;
  std::size_t num_pairs = 0;
  // Pairs far apart in the list first, so that long tracks are not judged by a few photos alone.
  for (std::size_t step = posed.size() - 1; step >= 1 && num_pairs < kMaxPairs; --step) {
    for (std::size_t i = 0; i + step < posed.size() && num_pairs < kMaxPairs; ++i, ++num_pairs) {
      const PhotoObservation& a = track.observations[posed[i]];
      const PhotoObservation& b = track.observations[posed[i + step]];
      const Pose T_world_a = T_cam_world_[a.photo]->Inverse();
      const auto p_a = mono3d::Triangulate(camera_.Unproject(Pixel(a)), camera_.Unproject(Pixel(b)),
                                           *T_cam_world_[b.photo] * T_world_a);
      if (!p_a) continue;
      const Eigen::Vector3d p_world = T_world_a * *p_a;
      const double cosine = CosParallax(p_world, centre_[a.photo], centre_[b.photo]);
      if (cosine > max_cosine_) continue;
      const int count = static_cast<int>(std::ranges::count_if(
          track.observations, [&](const PhotoObservation& seen) { return Fits(seen, p_world); }));
      if (count < best_count || (count == best_count && cosine >= best_cosine)) continue;
      best = p_world;
      best_count = count;
      best_cosine = cosine;
    }
  }
  if (best_count < 2) return;
  track.p_world = best;
  MarkFitting(track);
}

void PhotoScene::Triangulate() {
  for (PhotoTrack& track : tracks_) {
    if (!MarkFitting(track)) TriangulateTrack(track);
  }
}

void PhotoScene::Adjust(double min_gain) {
  BundleAdjustmentProblem problem;
  problem.camera = camera_;
  std::vector<std::size_t> view_of(photos_.size(), 0);
  for (const std::size_t photo : posed_) {
    view_of[photo] = problem.T_cam_world.size();
    problem.is_fixed.push_back(problem.T_cam_world.empty() ? 1 : 0);
    problem.T_cam_world.push_back(*T_cam_world_[photo]);
  }
  std::vector<std::size_t> adjusted;
  for (std::size_t i = 0; i < tracks_.size(); ++i) {
    const PhotoTrack& track = tracks_[i];
    if (!track.p_world) continue;
    for (const PhotoObservation& observation : track.observations) {
      if (!observation.fits) continue;
      problem.observations.push_back(
          {view_of[observation.photo], adjusted.size(), Pixel(observation), Sigma_px(observation)});
    }
    problem.p_world.push_back(*track.p_world);
    adjusted.push_back(i);
  }
  BundleAdjustmentOptions options;
  options.num_steps = 20;
  options.min_gain = min_gain;
  (void)SolveBundleAdjustment(problem, options);
  for (const std::size_t photo : posed_) SetPose(photo, problem.T_cam_world[view_of[photo]]);
  for (std::size_t i = 0; i < adjusted.size(); ++i) {
    PhotoTrack& track = tracks_[adjusted[i]];
    track.p_world = problem.p_world[i];
    MarkFitting(track);
  }
}

void PhotoScene::Normalise(std::size_t photo) {
  const double scale = 1 / MedianDepth(photo);
  const Similarity S_cam_world = Similarity(scale, Pose()) * Similarity(1, *T_cam_world_[photo]);
  for (PhotoTrack& track : tracks_) {
    if (track.p_world) track.p_world = S_cam_world * *track.p_world;
  }
  for (const std::size_t posed : posed_) {
    SetPose(posed, (S_cam_world * T_cam_world_[posed]->Inverse()).Inverse());
    shutters_[posed].Rescale(scale);
  }
}

}  // namespace mono3d::tracking
