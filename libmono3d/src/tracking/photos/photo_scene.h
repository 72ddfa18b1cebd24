// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/geometry/rolling_shutter.h"
#include "mono3d/geometry/similarity.h"
#include "tracking/photos/photo_tracks.h"

namespace mono3d::tracking {

// When a photo was taken, and by which camera: of use where the camera has a rolling shutter.
struct PhotoTime {
  double timestamp_s = 0;
  CameraModel sensor;  // as Frame has it
};

// Poses and points that a scene has found, to be taken up again.
struct PlacedScene {
  struct Photo {
    std::size_t photo = 0;
    Pose T_cam_world;
    ShutterMotion shutter;
    std::vector<Eigen::Vector2d> moved;  // see PhotoScene::moved_
  };
  struct Point {
    std::size_t track = 0;
    Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  };
  std::vector<Photo> photos;  // in the order in which they got their poses
  std::vector<Point> points;

  // The same after a change of the world's frame and unit: S_new_world.
  void Transform(const Similarity& S_new_world);
};

// Photos, what they show of each other, and what is known so far of where both are. All pixels are
// those of one camera without distortion; photos of another one are brought to it by their rays.
class PhotoScene {
 public:
  PhotoScene(const CameraModel& camera, const std::vector<PhotoFeatures>& photos,
             std::span<const PhotoPair> pairs, double min_parallax_deg);

  const CameraModel& camera() const { return camera_; }
  const PhotoFeatures& features(std::size_t photo) const { return photos_[photo]; }
  std::size_t num_photos() const { return photos_.size(); }
  const std::vector<PhotoTrack>& tracks() const { return tracks_; }
  const std::optional<Pose>& T_cam_world(std::size_t photo) const { return T_cam_world_[photo]; }
  // With a pose, in the order in which they got it.
  const std::vector<std::size_t>& posed() const { return posed_; }

  // Where the feature is, as if all lines had been read with the middle one.
  const Eigen::Vector2d& Pixel(const PhotoObservation& observation) const {
    const std::vector<Eigen::Vector2d>& moved = moved_[observation.photo];
    return (moved.empty() ? photos_[observation.photo].pixels : moved)[observation.feature];
  }

  // Standard deviation of a feature, in x and in y.
  double Sigma_px(const PhotoObservation& observation) const {
    return tolerance_ * photos_[observation.photo].sigma_px[observation.feature];
  }

  // Forgets all poses and points.
  void Clear();
  PlacedScene Placed() const;
  // In place of what there is.
  void Place(const PlacedScene& placed);
  // Multiplies the standard deviations of all features: poses and a camera that are not right yet
  // make larger errors than the features.
  void SetTolerance(double tolerance) { tolerance_ = tolerance; }
  double tolerance() const { return tolerance_; }
  // Errors of a pose that was found by P3P, px: those of a camera that is not known exactly.
  double MaxPoseError_px() const;
  void SetPose(std::size_t photo, const Pose& T_cam_world);
  // Takes how each photo with a pose moved from the photos with a pose that were taken before and
  // after it, and where it shows its points from the middle line of its shutter. `times`: of each
  // photo.
  void FollowShutters(std::span<const PhotoTime> times);
  // All lines of each photo as read at once.
  void ForgetShutters();
  // How the photo moved, also where its shutter is a global one; zero where it is not known.
  const ShutterMotion& shutter(std::size_t photo) const { return shutters_[photo]; }
  void RemovePose(std::size_t photo);

  // Points found so far that the photo should show.
  int NumPointsFor(std::size_t photo) const;
  // Points that it does show, by its pose.
  int NumFitting(std::size_t photo) const;
  // Of each observation of the photos chosen, in units of its variance, as far as it may be one of
  // a point: so much where there is no pose or no point.
  std::vector<double> Losses(const std::vector<char>& is_chosen) const;
  // The pose that most of the points it should show agree on, by P3P within RANSAC; two where the
  // points, on a plane, leave another one open; none with fewer than `min_inliers`.
  std::vector<Pose> FindPoses(std::size_t photo, int min_inliers, int seed) const;
  // The only one.
  std::optional<Pose> FindPose(std::size_t photo, int min_inliers, int seed) const;

  // Finds points where the photos with a pose agree on one; those found stay.
  void Triangulate();
  // Bundle adjustment of all photos with a pose but the first of them, and of all points; then
  // marks what fits, and gives up points that two photos do not confirm.
  void Adjust(double min_gain);
  // Moves and scales all so that `photo` is at the origin and the median depth of its points is 1.
  void Normalise(std::size_t photo);

 private:
  struct Seen {
    std::size_t track = 0;
    std::size_t observation = 0;
  };

  const PhotoObservation& At(const Seen& seen) const {
    return tracks_[seen.track].observations[seen.observation];
  }
  bool Fits(const PhotoObservation& observation, const Eigen::Vector3d& p_world) const;
  // Marks the observations; false, and no point, where they are too few or see it from one place.
  bool MarkFitting(PhotoTrack& track) const;
  void TriangulateTrack(PhotoTrack& track) const;
  Eigen::Vector3d DepthAxis(const PhotoTrack& track) const;
  bool HasParallax(const PhotoTrack& track, const Eigen::Vector3d& p_world) const;
  // Of the points that the photo shows; 1 where there are none.
  double MedianDepth(std::size_t photo) const;
  void MoveToMiddleLine(std::size_t photo);

  CameraModel camera_;
  const std::vector<PhotoFeatures>& photos_;
  double max_cosine_ = 1;
  std::vector<PhotoTrack> tracks_;
  std::vector<std::vector<Seen>> seen_;  // by each photo
  std::vector<std::optional<Pose>> T_cam_world_;
  std::vector<Eigen::Vector3d> centre_;  // of those with a pose, in the world
  std::vector<std::size_t> posed_;
  std::vector<ShutterMotion> shutters_;
  // Pixels of the features of each photo at the middle line; empty: as the photo shows them.
  std::vector<std::vector<Eigen::Vector2d>> moved_;
  double tolerance_ = 1;
};

}  // namespace mono3d::tracking
