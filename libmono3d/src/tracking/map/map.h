// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cassert>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/geometry/rolling_shutter.h"
#include "mono3d/geometry/similarity.h"
#include "mono3d/image/frame.h"
#include "tracking/alignment/octaves.h"
#include "tracking/alignment/patch_alignment.h"
#include "tracking/features/feature_grid.h"
#include "tracking/features/image_motion.h"
#include "tracking/features/pyramid_scales.h"
#include "tracking/velocity_prior.h"

namespace mono3d::tracking {

// A point of a Map: a place in its list, which a new point takes once the one there is removed, so
// that a map grows with the ground seen and not with the time spent over it. The generation tells
// them apart: whoever holds the id of a point that may have been removed asks Map::IsAlive.
struct PointId {
  std::uint32_t index = 0;
  std::uint32_t generation = 0;

  friend bool operator==(const PointId&, const PointId&) = default;
};

// A position in the list of keyframes of a Map, which never changes: what is culled only ceases to
// be alive.
using KeyframeId = std::size_t;

// Keyframes that see a point which is well known: two give its position, the third confirms it.
inline constexpr std::size_t kMinConfirmedObservations = 3;

// One image as the tracker sees it.
struct View {
  Frame frame;
  std::vector<Feature> features;
  FeatureGrid grid;
  Octaves octaves;           // empty where they are no longer needed
  double log_sharpness = 0;  // LogSharpness
  // Standard deviation of where patches are found in the image by what is stated of them, 1 or
  // more, once it is known. See TrackPatches.
  std::optional<double> patch_noise;
  std::vector<std::optional<PointId>> points;  // of each feature
  Pose T_cam_world;                            // at the middle line of a rolling shutter
  ShutterMotion shutter;                       // in the unit of T_cam_world
  VelocityPrior velocity_prior;                // of the velocity in `shutter`
  ImageMotion image_motion;                    // before a map starts, while `shutter` is not known

  Eigen::Vector3d Centre() const { return T_cam_world.Inverse().translation(); }  // in the world
};

struct Observation {
  KeyframeId keyframe = 0;
  std::size_t feature = 0;
};

// A point of the sparse map.
struct MapPoint {
  bool alive = true;
  std::uint32_t generation = 0;  // how many points its place has had before; not saved with the map
  Eigen::Vector3d p_world = Eigen::Vector3d::Zero();
  // Of the inverse depth, as a share of it; 0: known. See depth_uncertainty.h.
  double depth_sigma = 0;
  std::vector<Observation> observations;  // by ascending keyframe
  KeyframeId created_at = 0;              // the newest keyframe at that time
  int num_predicted = 1;                  // times it should have been seen
  int num_found = 1;                      // times it was
  int num_due_keyframes = 0;              // newer ones that should show it; not saved with the map
  int num_showing_keyframes = 0;          // those of them that did
  std::optional<Patch> patch;             // how it looks
  KeyframeId patch_keyframe = 0;          // from where
  std::array<std::uint8_t, 3> colour{};   // red, green, blue, there
  // What follows from the observations:
  Descriptor descriptor{};                                    // the most typical one
  Eigen::Vector3d towards_cameras = Eigen::Vector3d::Zero();  // mean direction, unit length
  double min_distance = 0;  // su, at which it shows on the coarsest level
  double max_distance = 0;  // su, at which it shows on level 0
};

struct MapKeyframe {
  View view;
  std::int64_t id = 0;  // over all maps of a tracker, from when it joins one
  bool alive = true;
  int num_newer_adjusted = 0;  // newer keyframes that it shared a bundle adjustment with
  bool is_finalised = false;
  // The keyframe's own unit, the world's when it joined its map, in the world's unit now: by so
  // much corrections and joins have multiplied the lengths around it. What is to last is kept in
  // the own unit: S_world_kf of KeyframePoses has this scale.
  double scale = 1;
  // What positions have moved: from the world as the images alone have it around the keyframe to
  // the world as it is. Not saved with the map.
  Similarity S_world_visual;
  // Where a culled keyframe is to be found: fixed to another one.
  KeyframeId anchor = 0;
  Pose T_cam_anchor;
};

// What is known of two keyframes besides the points that they see: a KeyframeConstraint by the
// numbers of this map.
struct MapConstraint {
  KeyframeId keyframe = 0;
  KeyframeId anchor = 0;
  Pose T_cam_anchor;
  double scale = 1;
  Eigen::Matrix<double, 7, 7> information;
  bool is_new = true;  // not decided on yet
};

struct Covisible {
  KeyframeId keyframe = 0;
  int num_shared = 0;  // points
};

// Points and keyframes of one start, and who sees what.
class Map {
 public:
  Map(int id, const CameraModel& camera, const FeatureOptions& options)
      : id_(id), camera_(camera), scales_(options), patch_sigma_px_(options.patch_sigma_px) {}
  // Of a saved map; the lists must agree with each other.
  Map(int id, const CameraModel& camera, const FeatureOptions& options,
      std::vector<MapPoint> points, std::vector<MapKeyframe> keyframes)
      : id_(id),
        camera_(camera),
        scales_(options),
        patch_sigma_px_(options.patch_sigma_px),
        points_(std::move(points)),
        keyframes_(std::move(keyframes)) {
    ListFree(0);
    ListAnew();
  }

  int id() const { return id_; }
  const CameraModel& camera() const { return camera_; }
  const PyramidScales& scales() const { return scales_; }
  double patch_sigma_px() const { return patch_sigma_px_; }  // of FeatureOptions
  const std::vector<MapPoint>& points() const { return points_; }
  const std::vector<MapKeyframe>& keyframes() const { return keyframes_; }
  bool IsAlive(PointId id) const {
    return points_[id.index].generation == id.generation && points_[id.index].alive;
  }
  // Of the point that the id was made for.
  MapPoint& point(PointId id) {
    assert(points_[id.index].generation == id.generation);
    return points_[id.index];
  }
  const MapPoint& point(PointId id) const {
    assert(points_[id.index].generation == id.generation);
    return points_[id.index];
  }
  // All that are alive, in the order of their places.
  std::vector<PointId> PointIds() const;
  MapKeyframe& keyframe(KeyframeId id) { return keyframes_[id]; }
  const MapKeyframe& keyframe(KeyframeId id) const { return keyframes_[id]; }

  // In the order in which they came; not saved with the map.
  std::vector<MapConstraint>& constraints() { return constraints_; }
  const std::vector<MapConstraint>& constraints() const { return constraints_; }

  // Takes the view over; its points gain an observation each.
  KeyframeId AddKeyframe(View view);
  PointId AddPoint(const Eigen::Vector3d& p_world);
  // The feature must not have a point yet, nor the keyframe see the point.
  void AddObservation(PointId point, const Observation& observation);
  // The same with a new feature of that keyframe.
  void AddObservation(PointId point, KeyframeId keyframe, const Feature& feature);
  // A point with fewer than two observations left goes.
  void RemoveObservation(PointId point, const Observation& observation);
  void RemovePoint(PointId point);
  // Observations of `from` become those of `to`, where `to` has none in that keyframe.
  void MergePoints(PointId from, PointId to);
  // Fixes the keyframe to `anchor` and takes its observations away.
  void RemoveKeyframe(KeyframeId keyframe, KeyframeId anchor);
  // Takes the newest keyframes back, from `first` on, as if they had never come: with the points
  // that only they see or whose patch is theirs. No older one may be fixed to them.
  void TakeBackKeyframes(KeyframeId first);

  // Renews what follows from the observations of a point.
  void UpdatePoint(PointId point);
  // The same where nothing but poses and the point's position have changed.
  void UpdateGeometry(PointId point);
  std::optional<std::size_t> FeatureOf(PointId point, KeyframeId keyframe) const;

  // Keyframes that share points with `keyframe`, most shared points first.
  std::vector<Covisible> CovisibleKeyframes(KeyframeId keyframe) const;
  // At most so many of them.
  std::vector<Covisible> CovisibleKeyframes(KeyframeId keyframe, std::size_t max_count) const;
  // The same for any list of points, without the one excluded.
  std::vector<Covisible> KeyframesSeeing(const std::vector<std::optional<PointId>>& points,
                                         std::optional<KeyframeId> excluded = std::nullopt) const;

  // The keyframes, also the culled ones, by time: those from before a start came later.
  const std::vector<KeyframeId>& InOrderOfFlight() const { return in_flight_; }
  // The end of it, from the first one on that is not final: as long at the end of a long flight as
  // at its beginning. Until keyframes come.
  std::span<const KeyframeId> FromFirstNotFinal();

  // Has the point be looked at by whoever takes the watched ones next. New points are watched.
  void Watch(PointId point) { watched_.push_back(point); }
  // Those that are alive, in the order of their places; none is watched then.
  std::vector<PointId> TakeWatched();
  // The keyframes that were culled since the last call, in any order.
  std::vector<KeyframeId> TakeCulled() { return std::exchange(culled_, {}); }

  // Where a view with a rolling shutter would show what it shows at `pixel`, a point, if all its
  // lines were read with the middle one, at T_cam_world.
  Eigen::Vector2d AtMiddleLine(const View& view, const Eigen::Vector2d& pixel,
                               const Eigen::Vector3d& p_world) const {
    if (view.shutter.IsStill()) return pixel;
    return view.shutter.AtMiddleLine(camera_, pixel, view.T_cam_world * p_world);
  }

  // z-depths of the points in view of an image, in su.
  std::vector<float> Depths(const View& view) const;
  // Camera pose of a keyframe, also of a culled one.
  Pose T_cam_world(KeyframeId keyframe) const;
  // The same with the keyframe's own unit.
  Similarity S_world_kf(KeyframeId keyframe) const {
    return {keyframes_[keyframe].scale, T_cam_world(keyframe).Inverse()};
  }
  // Gives keyframes new poses with a scale; the culled ones and the points follow the keyframe they
  // are fixed to. One similarity for each keyframe alive, `keyframes` in ascending order.
  void Correct(const std::vector<KeyframeId>& keyframes,
               const std::vector<Similarity>& S_cam_world);
  // The images alone have adjusted all of the map: where it was before does not matter any more.
  void ForgetPositions();
  // Notes that the lengths around each keyframe have been multiplied, one ratio for each; the
  // culled ones follow theirs.
  void ScaleAround(std::vector<double> ratios);
  // Takes over another map, which is empty afterwards: its points and keyframes get the numbers
  // after those of this one, and move by the similarity.
  void Append(Map&& other, const Similarity& S_world_other);
  // Multiplies all lengths.
  void Rescale(double factor);

  // All but what the constructor is given, for the archives of image/state_archive.h. Refuses what
  // cannot be a map.
  template <typename Archive>
  void ExchangeState(Archive& archive);

 private:
  void ListFree(std::size_t first);
  void ListAnew();

  int id_;
  CameraModel camera_;
  PyramidScales scales_;
  double patch_sigma_px_;
  std::vector<MapPoint> points_;
  std::vector<MapKeyframe> keyframes_;
  std::vector<MapConstraint> constraints_;
  std::vector<std::uint32_t> free_;  // places of points that are not alive

  // What follows from these, so that nothing has to look at all of them with each keyframe.
  std::vector<KeyframeId> in_flight_;  // all keyframes, by time
  std::size_t num_final_ = 0;          // so many at its beginning are final
  std::vector<PointId> watched_;       // with repetitions
  std::vector<KeyframeId> culled_;
};

}  // namespace mono3d::tracking
