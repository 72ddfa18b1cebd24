// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/photos/photo_joining.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <set>
#include <utility>

#include "mono3d/core/log.h"
#include "mono3d/geometry/similarity.h"
#include "tracking/held_scale.h"
#include "tracking/optimisation/chi2.h"
#include "tracking/photos/mirrored_pose.h"
#include "tracking/photos/photo_growth.h"
#include "tracking/start/model_comparison.h"

namespace mono3d::tracking {
namespace {

// Of the tracks in which one map shows points of the other, so many agree with a wrong similarity
// by chance: that of P3P.
constexpr double kMinJoinShare = 0.2;
// Photos of the larger map with a pose in the other that make hypotheses.
constexpr std::size_t kMaxCommonPhotos = 16;
constexpr int kNumPointSamples = 1000;
// Of the photos of either map that a join may lose: the joint adjustment may find one wrong.
constexpr double kMaxLostShare = 0.1;

// The world of one map, by tracks and photos.
struct MapLookUp {
  MapLookUp(const PlacedScene& map, const PhotoScene& scene)
      : T_cam_world(scene.num_photos()), p_world(scene.tracks().size()) {
    for (const PlacedScene::Photo& photo : map.photos) T_cam_world[photo.photo] = photo.T_cam_world;
    for (const PlacedScene::Point& point : map.points) p_world[point.track] = point.p_world;
  }
  std::vector<std::optional<Pose>> T_cam_world;
  std::vector<std::optional<Eigen::Vector3d>> p_world;
};

// Where a photo of one map shows a point of the other.
struct CrossSight {
  std::size_t photo;
  Eigen::Vector3d p_other;
  Eigen::Matrix3d covariance;  // of the point, in su squared of its own map
  const Pose* T_cam_world;
  Eigen::Vector2d pixel;
  double sigma_px;
  bool is_of_added;  // the point
};

// px per su, of a camera without distortion.
Eigen::Matrix<double, 2, 3> ProjectionJacobian(const CameraModel& camera,
                                               const Eigen::Vector3d& p_cam) {
  const double inverse_z = 1 / p_cam.z();
  Eigen::Matrix<double, 2, 3> jacobian;
  jacobian << camera.fx * inverse_z, 0, -camera.fx * p_cam.x() * inverse_z * inverse_z,  //
      0, camera.fy * inverse_z, -camera.fy * p_cam.y() * inverse_z * inverse_z;
  return jacobian;
}

// Of a point by the photos of its map that agree on it, poses as they are.
Eigen::Matrix3d CovarianceOf(const PhotoScene& scene, const PhotoTrack& track, const MapLookUp& map,
                             const Eigen::Vector3d& p_world) {
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const PhotoObservation& seen : track.observations) {
    const std::optional<Pose>& T_cam_world = map.T_cam_world[seen.photo];
    if (!T_cam_world) continue;
    const Eigen::Vector3d p_cam = *T_cam_world * p_world;
    if (!(p_cam.z() > 0)) continue;
    const double sigma_px = scene.Sigma_px(seen);
    const double error_px = (scene.camera().Project(p_cam) - scene.Pixel(seen)).norm();
    if (error_px > std::sqrt(kChi2TwoDof) * sigma_px) continue;
    const Eigen::Matrix<double, 2, 3> jacobian =
        ProjectionJacobian(scene.camera(), p_cam) * T_cam_world->rotation().toRotationMatrix();
    information += jacobian.transpose() * jacobian / (sigma_px * sigma_px);
  }
  return information.inverse();
}

// What two maps know of each other, in the order of the tracks.
class CommonGround {
 public:
  CommonGround(const PhotoScene& scene, const MapLookUp& map, const MapLookUp& added)
      : camera_(scene.camera()), max_error_px_(scene.MaxPoseError_px()) {
    for (std::size_t i = 0; i < scene.tracks().size(); ++i) {
      const std::optional<Eigen::Vector3d>& p_map = map.p_world[i];
      const std::optional<Eigen::Vector3d>& p_added = added.p_world[i];
      if (!p_map && !p_added) continue;
      std::vector<CrossSight> sights;
      for (const PhotoObservation& seen : scene.tracks()[i].observations) {
        const std::optional<Pose>& T_cam_map = map.T_cam_world[seen.photo];
        const std::optional<Pose>& T_cam_added = added.T_cam_world[seen.photo];
        if (T_cam_map && p_added) {
          sights.push_back({seen.photo, *p_added,
                            CovarianceOf(scene, scene.tracks()[i], added, *p_added), &*T_cam_map,
                            scene.Pixel(seen), scene.Sigma_px(seen), true});
        }
        if (T_cam_added && p_map) {
          sights.push_back({seen.photo, *p_map, CovarianceOf(scene, scene.tracks()[i], map, *p_map),
                            &*T_cam_added, scene.Pixel(seen), scene.Sigma_px(seen), false});
        }
      }
      if (sights.empty()) continue;
      tracks_.push_back(std::move(sights));
      if (p_map && p_added) pairs_.push_back({*p_map, *p_added, tracks_.size() - 1});
    }
  }

  std::size_t num_tracks() const { return tracks_.size(); }

  // Points that both maps have.
  struct PointOfBoth {
    Eigen::Vector3d p_map;
    Eigen::Vector3d p_added;
    std::size_t track;
  };
  const std::vector<PointOfBoth>& points() const { return pairs_; }

  // Do most of the sights of the track agree?
  bool Agrees(std::size_t track, const Similarity& S_map_added,
              const Similarity& S_added_map) const {
    const auto num_near = std::ranges::count_if(tracks_[track], [&](const CrossSight& sight) {
      const auto error_px = Error_px(sight, S_map_added, S_added_map);
      return error_px && error_px->norm() <= max_error_px_;
    });
    return 2 * static_cast<std::size_t>(num_near) > tracks_[track].size();
  }

  int NumAgreeing(const Similarity& S_map_added) const {
    const Similarity S_added_map = S_map_added.Inverse();
    int count = 0;
    for (std::size_t i = 0; i < tracks_.size(); ++i) {
      count += Agrees(i, S_map_added, S_added_map) ? 1 : 0;
    }
    return count;
  }

  // Sights that agree.
  std::vector<CrossSight> Agreeing(const Similarity& S_map_added) const {
    const Similarity S_added_map = S_map_added.Inverse();
    std::vector<CrossSight> near;
    for (const std::vector<CrossSight>& track : tracks_) {
      for (const CrossSight& sight : track) {
        const auto error_px = Error_px(sight, S_map_added, S_added_map);
        if (error_px && error_px->norm() <= max_error_px_) near.push_back(sight);
      }
    }
    return near;
  }

  // Of each sight, as far as it may be one of its point.
  std::vector<double> Losses(const Similarity& S_map_added) const {
    const Similarity S_added_map = S_map_added.Inverse();
    std::vector<double> losses;
    for (const std::vector<CrossSight>& track : tracks_) {
      for (const CrossSight& sight : track) {
        const auto error_px = Error_px(sight, S_map_added, S_added_map);
        double loss = kChi2TwoDof;
        if (error_px) {
          const Eigen::Matrix2d weight = Weight(sight, S_map_added, S_added_map);
          loss = std::min(loss, error_px->dot(weight * *error_px));
        }
        losses.push_back(loss);
      }
    }
    return losses;
  }

  // Inverse covariance of Error_px: of the pixel and of the point.
  Eigen::Matrix2d Weight(const CrossSight& sight, const Similarity& S_map_added,
                         const Similarity& S_added_map) const {
    const Similarity& S = sight.is_of_added ? S_map_added : S_added_map;
    const Eigen::Matrix<double, 2, 3> projected =
        S.scale() * ProjectionJacobian(camera_, *sight.T_cam_world * (S * sight.p_other)) *
        (sight.T_cam_world->rotation() * S.pose().rotation()).toRotationMatrix();
    const Eigen::Matrix2d covariance =
        projected * sight.covariance * projected.transpose() +
        sight.sigma_px * sight.sigma_px * Eigen::Matrix2d::Identity();
    return covariance.inverse();
  }

  // Nothing where the point is behind the camera.
  std::optional<Eigen::Vector2d> Error_px(const CrossSight& sight, const Similarity& S_map_added,
                                          const Similarity& S_added_map) const {
    const Similarity& S = sight.is_of_added ? S_map_added : S_added_map;
    const Eigen::Vector3d p_cam = *sight.T_cam_world * (S * sight.p_other);
    if (!(p_cam.z() > 0)) return std::nullopt;
    return camera_.Project(p_cam) - sight.pixel;
  }

 private:
  CameraModel camera_;
  double max_error_px_;
  std::vector<std::vector<CrossSight>> tracks_;
  std::vector<PointOfBoth> pairs_;
};

// Of the points of both maps; nothing where they lie in one place.
std::optional<Similarity> SimilarityOfPoints(const std::vector<CommonGround::PointOfBoth>& points) {
  std::vector<Eigen::Vector3d> p_added;
  std::vector<Eigen::Vector3d> p_map;
  for (const CommonGround::PointOfBoth& point : points) {
    p_added.push_back(point.p_added);
    p_map.push_back(point.p_map);
  }
  const auto is_one_line = [](const std::vector<Eigen::Vector3d>& p) {
    const Eigen::Vector3d a = p[1] - p[0];
    return std::ranges::all_of(p, [&](const Eigen::Vector3d& other) {
      return a.cross(other - p[0]).norm() <= 1e-3 * a.norm() * (other - p[0]).norm();
    });
  };
  if (p_map.size() < 3 || is_one_line(p_map) || is_one_line(p_added)) return std::nullopt;
  const Similarity S = FitSimilarity(p_added, p_map);
  if (!std::isfinite(S.scale()) || S.scale() <= 0) return std::nullopt;
  return S;
}

struct BestSimilarity {
  Similarity S_map_added;
  int num_agreeing = 0;

  void Take(const CommonGround& common, const Similarity& S) {
    const int count = common.NumAgreeing(S);
    if (count <= num_agreeing) return;
    S_map_added = S;
    num_agreeing = count;
  }
};

// By the points of both maps: triples, then all that agree with the best.
void TryPoints(const CommonGround& common, int seed, BestSimilarity& best) {
  const auto& points = common.points();
  if (points.size() < 3) return;
  std::mt19937 random(static_cast<unsigned>(seed));
  for (int sample = 0; sample < kNumPointSamples; ++sample) {
    std::vector<CommonGround::PointOfBoth> three;
    for (int i = 0; i < 3; ++i) three.push_back(points[random() % points.size()]);
    if (const auto S = SimilarityOfPoints(three)) best.Take(common, *S);
  }
  constexpr int kRefits = 3;
  for (int round = 0; round < kRefits && best.num_agreeing > 0; ++round) {
    const Similarity S_added_map = best.S_map_added.Inverse();
    std::vector<CommonGround::PointOfBoth> agreeing;
    for (const CommonGround::PointOfBoth& point : points) {
      if (common.Agrees(point.track, best.S_map_added, S_added_map)) agreeing.push_back(point);
    }
    if (const auto S = SimilarityOfPoints(agreeing)) best.Take(common, *S);
  }
}

// A similarity fitted to the sights that agree with it.
struct FittedSimilarity {
  Similarity S_map_added;
  double scale_sigma = 0;  // relative standard deviation; infinite where nothing tells the scale
};

// Gauss-Newton over rotation, translation and scale, by what the pixels say and how well each map
// knows its points; the shape of each map is taken as it is. Changes are about the middle of the
// points, so that they depend little on each other.
class SimilarityFit {
 public:
  SimilarityFit(const CommonGround& common, const Similarity& start)
      : common_(common), sights_(common.Agreeing(start)), S_map_added_(start) {}

  FittedSimilarity Solve() {
    constexpr int kNumSteps = 5;
    for (int step = 0; step < kNumSteps; ++step) {
      if (!Linearise()) return {S_map_added_, std::numeric_limits<double>::infinity()};
      const Step change = information_.ldlt().solve(-gradient_);
      if (!change.allFinite()) return {S_map_added_, std::numeric_limits<double>::infinity()};
      S_map_added_ = Changed(change);
    }
    if (!Linearise()) return {S_map_added_, std::numeric_limits<double>::infinity()};
    const Eigen::SelfAdjointEigenSolver<Information> solver(information_);
    // Of a direction that no sight tells, rounding is left.
    if (solver.eigenvalues()(0) <= 1e-9 * solver.eigenvalues()(6)) {
      return {S_map_added_, std::numeric_limits<double>::infinity()};
    }
    const double variance = information_.inverse()(6, 6);
    const double misfit = chi2_ / std::max(1.0, 2. * static_cast<double>(sights_.size()) - 7);
    return {S_map_added_, std::sqrt(variance * std::max(1.0, misfit))};
  }

 private:
  using Step = Eigen::Matrix<double, 7, 1>;  // rotation, translation, logarithm of the scale
  using Information = Eigen::Matrix<double, 7, 7>;

  Similarity Changed(const Step& change) const {
    const Similarity to_middle(1, Pose(Eigen::Quaterniond::Identity(), -middle_));
    const Similarity back(1, Pose(Eigen::Quaterniond::Identity(), middle_ + change.segment<3>(3)));
    const Similarity turned(std::exp(change(6)),
                            Pose(RotationExp(change.head<3>()), Eigen::Vector3d::Zero()));
    return back * turned * to_middle * S_map_added_;
  }

  // False where a point is behind a camera.
  bool Linearise() {
    if (sights_.empty()) return false;
    middle_.setZero();
    for (const CrossSight& sight : sights_) {
      middle_ += sight.is_of_added ? S_map_added_ * sight.p_other : sight.p_other;
    }
    middle_ /= static_cast<double>(sights_.size());
    constexpr double kDifference = 1e-6;  // rad, su and of the scale: depths are about 1 su
    std::vector<Similarity> changed{S_map_added_};
    for (int i = 0; i < 7; ++i) {
      for (const double sign : {1.0, -1.0}) {
        Step change = Step::Zero();
        change(i) = sign * kDifference;
        changed.push_back(Changed(change));
      }
    }
    std::vector<Similarity> inverse;
    for (const Similarity& S : changed) inverse.push_back(S.Inverse());
    information_.setZero();
    gradient_.setZero();
    chi2_ = 0;
    for (const CrossSight& sight : sights_) {
      const auto error = [&](std::size_t i) {
        return common_.Error_px(sight, changed[i], inverse[i]);
      };
      const auto residual = error(0);
      if (!residual) return false;
      Eigen::Matrix<double, 2, 7> jacobian;
      for (int i = 0; i < 7; ++i) {
        const auto plus = error(static_cast<std::size_t>(1 + 2 * i));
        const auto minus = error(static_cast<std::size_t>(2 + 2 * i));
        if (!plus || !minus) return false;
        jacobian.col(i) = (*plus - *minus) / (2 * kDifference);
      }
      const Eigen::Matrix2d weight = common_.Weight(sight, changed[0], inverse[0]);
      information_ += jacobian.transpose() * weight * jacobian;
      gradient_ += jacobian.transpose() * weight * *residual;
      chi2_ += residual->dot(weight * *residual);
    }
    return true;
  }

  const CommonGround& common_;
  std::vector<CrossSight> sights_;
  Similarity S_map_added_;
  Eigen::Vector3d middle_ = Eigen::Vector3d::Zero();
  Information information_ = Information::Zero();
  Step gradient_ = Step::Zero();
  double chi2_ = 0;
};

// What a photo of one map shows of the other, most of it first.
std::vector<std::vector<CrossSight>> ByPhoto(const std::vector<CrossSight>& sights) {
  std::map<std::size_t, std::vector<CrossSight>> of_photo;
  for (const CrossSight& sight : sights) of_photo[sight.photo].push_back(sight);
  std::vector<std::vector<CrossSight>> by_photo;
  for (auto& [photo, seen] : of_photo) by_photo.push_back(std::move(seen));
  std::ranges::stable_sort(by_photo, std::greater(), &std::vector<CrossSight>::size);
  return by_photo;
}

// The other similarity with which the photo shows nearly the same, if that is a plane: a start.
Similarity MirroredSimilarity(const std::vector<CrossSight>& of_photo,
                              const Similarity& S_map_added) {
  const bool is_of_added = of_photo.front().is_of_added;
  const Similarity S_world_other = is_of_added ? S_map_added : S_map_added.Inverse();
  std::vector<Eigen::Vector3d> p_world;
  for (const CrossSight& sight : of_photo) p_world.push_back(S_world_other * sight.p_other);
  const Pose& T_cam_world = *of_photo.front().T_cam_world;
  const Pose turn = T_cam_world.Inverse() * MirroredPose(T_cam_world, p_world);
  const Similarity mirrored = Similarity(1, turn) * S_world_other;
  return is_of_added ? mirrored : mirrored.Inverse();
}

// Whether no other similarity explains what the maps show of each other nearly as well. Where that
// is a plane, there may be one.
bool IsOnlySimilarity(const CommonGround& common, const Similarity& S_map_added) {
  constexpr std::size_t kMinSights = 4;  // three lie on a plane always
  const std::vector<double> losses = common.Losses(S_map_added);
  const std::vector<std::vector<CrossSight>> by_photo = ByPhoto(common.Agreeing(S_map_added));
  for (const bool is_of_added : {false, true}) {
    const auto most = std::ranges::find_if(
        by_photo, [&](const auto& seen) { return seen.front().is_of_added == is_of_added; });
    if (most == by_photo.end() || most->size() < kMinSights) continue;
    const Similarity start = MirroredSimilarity(*most, S_map_added);
    const Similarity other = SimilarityFit(common, start).Solve().S_map_added;
    const auto angle = [&](const Similarity& S) {
      return S.pose().rotation().angularDistance(S_map_added.pose().rotation());
    };
    if (angle(other) < 0.5 * angle(start)) continue;  // back at the first
    if (!IsClearlyBetterOfInliers(losses, common.Losses(other), kChi2TwoDof)) return false;
  }
  return true;
}

struct PoseInBoth {
  Pose T_cam_map;
  Pose T_cam_added;
};

// Photos of the map that see enough of the added one for a pose in it, or for two, most points
// first.
std::vector<PoseInBoth> PosesInAdded(PhotoScene& scene, const PlacedScene& map,
                                     const PlacedScene& added, const PhotoMapperOptions& options) {
  scene.Place(added);
  std::vector<std::pair<int, const PlacedScene::Photo*>> seeing;
  for (const PlacedScene::Photo& photo : map.photos) {
    const int num_points = scene.NumPointsFor(photo.photo);
    if (num_points >= options.min_inliers) seeing.emplace_back(num_points, &photo);
  }
  std::ranges::stable_sort(seeing, [](const auto& l, const auto& r) { return l.first > r.first; });
  std::vector<PoseInBoth> poses;
  for (const auto& [num_points, photo] : seeing) {
    if (poses.size() >= kMaxCommonPhotos) break;
    for (const Pose& T_cam_added :
         scene.FindPoses(photo->photo, options.min_inliers, options.seed)) {
      poses.push_back({photo->T_cam_world, T_cam_added});
    }
  }
  return poses;
}

// By photos with a pose in both: the way between two of them, or from one to a point of both, has a
// length in each map.
void TryPhotos(const CommonGround& common, const std::vector<PoseInBoth>& poses,
               BestSimilarity& best) {
  const auto take = [&](const PoseInBoth& pose, double length_in_map, double length_in_added) {
    if (!(length_in_map > 0) || !(length_in_added > 0)) return;
    best.Take(common, Similarity(1, pose.T_cam_map.Inverse()) *
                          Similarity(length_in_map / length_in_added, Pose()) *
                          Similarity(1, pose.T_cam_added));
  };
  const auto centre = [](const Pose& T_cam_world) { return T_cam_world.Inverse().translation(); };
  for (const PoseInBoth& pose : poses) {
    const Eigen::Vector3d in_map = centre(pose.T_cam_map);
    const Eigen::Vector3d in_added = centre(pose.T_cam_added);
    for (const PoseInBoth& other : poses) {
      take(pose, (centre(other.T_cam_map) - in_map).norm(),
           (centre(other.T_cam_added) - in_added).norm());
    }
    for (const CommonGround::PointOfBoth& point : common.points()) {
      take(pose, (point.p_map - in_map).norm(), (point.p_added - in_added).norm());
    }
  }
}

// Points that photos of both maps show.
int NumJointPoints(const PhotoScene& scene, const MapLookUp& map, const MapLookUp& added) {
  return static_cast<int>(std::ranges::count_if(scene.tracks(), [&](const PhotoTrack& track) {
    const auto is_seen_in = [&](const MapLookUp& of) {
      return std::ranges::any_of(track.observations, [&](const PhotoObservation& seen) {
        return seen.fits && of.T_cam_world[seen.photo].has_value();
      });
    };
    return track.p_world && is_seen_in(map) && is_seen_in(added);
  }));
}

std::size_t NumPosed(const PhotoScene& scene, const PlacedScene& map) {
  return static_cast<std::size_t>(std::ranges::count_if(
      map.photos, [&](const auto& photo) { return scene.T_cam_world(photo.photo).has_value(); }));
}

// Both in the world of `map`; a point that both have is where `map` has it.
PlacedScene Together(const PlacedScene& map, PlacedScene added, const Similarity& S_map_added,
                     const MapLookUp& in_map) {
  added.Transform(S_map_added);
  PlacedScene both = map;
  both.photos.insert(both.photos.end(), added.photos.begin(), added.photos.end());
  for (const PlacedScene::Point& point : added.points) {
    if (!in_map.p_world[point.track]) both.points.push_back(point);
  }
  return both;
}

// First with the errors that a similarity of a few points or poses leaves, which are those of P3P.
void AdjustRoughly(PhotoScene& scene) {
  const double tolerance = scene.tolerance();
  constexpr double kFinest_px = 0.5;  // standard deviation of the finest features
  scene.SetTolerance(
      std::max(tolerance, scene.MaxPoseError_px() / (std::sqrt(kChi2TwoDof) * kFinest_px)));
  scene.Triangulate();
  scene.Adjust(kGrowingMinGain);
  scene.SetTolerance(tolerance);
}

// Nothing where the two show no place alike.
std::optional<PlacedScene> Joined(PhotoScene& scene, const PlacedScene& map,
                                  const PlacedScene& added, std::vector<char> is_free,
                                  std::span<const PhotoTime> times,
                                  const PhotoMapperOptions& options) {
  const MapLookUp in_map(map, scene);
  const MapLookUp in_added(added, scene);
  scene.Place(Together(map, added, Similarity(), in_map));  // all pixels as their maps have them
  const CommonGround common(scene, in_map, in_added);
  if (common.num_tracks() < static_cast<std::size_t>(options.min_inliers)) return std::nullopt;
  BestSimilarity best;
  TryPoints(common, options.seed, best);
  TryPhotos(common, PosesInAdded(scene, map, added, options), best);
  if (best.num_agreeing < options.min_inliers ||
      best.num_agreeing < kMinJoinShare * static_cast<double>(common.num_tracks())) {
    return std::nullopt;
  }
  const FittedSimilarity fitted = SimilarityFit(common, best.S_map_added).Solve();
  if (!(fitted.scale_sigma <= kMaxScaleSigma)) return std::nullopt;
  best.Take(common, fitted.S_map_added);
  if (!IsOnlySimilarity(common, best.S_map_added)) return std::nullopt;
  for (const PlacedScene* part : {&map, &added}) {
    for (const PlacedScene::Photo& photo : part->photos) is_free[photo.photo] = 1;
  }
  scene.Place(Together(map, added, best.S_map_added, in_map));
  AdjustRoughly(scene);
  CompletePhotoMap(scene, is_free, times, options);
  const int num_joint = NumJointPoints(scene, in_map, in_added);
  const auto is_whole = [&](const PlacedScene& part) {
    return static_cast<double>(NumPosed(scene, part)) >=
           (1 - kMaxLostShare) * static_cast<double>(part.photos.size());
  };
  if (num_joint < options.min_inliers || !is_whole(map) || !is_whole(added) ||
      scene.posed().size() <= map.photos.size()) {
    return std::nullopt;
  }
  Log(LogLevel::kInfo,
      "maps of " + std::to_string(map.photos.size()) + " and " +
          std::to_string(added.photos.size()) + " photographs show the same place: joined by " +
          std::to_string(num_joint) + " points, scale +- " + PercentText(fitted.scale_sigma));
  return scene.Placed();
}

}  // namespace

void JoinPhotoMaps(PhotoScene& scene, std::vector<PlacedScene>& maps, std::vector<char>& is_free,
                   std::span<const PhotoTime> times, const PhotoMapperOptions& options) {
  std::vector<int> id(maps.size());
  for (std::size_t i = 0; i < maps.size(); ++i) id[i] = static_cast<int>(i);
  auto next_id = static_cast<int>(maps.size());
  std::set<std::pair<int, int>> refused;
  const auto join_two = [&]() {
    for (std::size_t i = 0; i < maps.size(); ++i) {
      for (std::size_t k = i + 1; k < maps.size(); ++k) {
        if (!refused.emplace(std::min(id[i], id[k]), std::max(id[i], id[k])).second) continue;
        const bool is_larger = maps[i].photos.size() >= maps[k].photos.size();
        auto joined = Joined(scene, maps[is_larger ? i : k], maps[is_larger ? k : i], is_free,
                             times, options);
        if (!joined) continue;
        for (const PlacedScene* part : {&maps[i], &maps[k]}) {
          for (const PlacedScene::Photo& photo : part->photos) is_free[photo.photo] = 1;
        }
        for (const PlacedScene::Photo& photo : joined->photos) is_free[photo.photo] = 0;
        maps[i] = *std::move(joined);
        id[i] = next_id++;
        maps.erase(maps.begin() + static_cast<std::ptrdiff_t>(k));
        id.erase(id.begin() + static_cast<std::ptrdiff_t>(k));
        return true;
      }
    }
    return false;
  };
  while (join_two()) {
  }
}

}  // namespace mono3d::tracking
