// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/tracking/place_recognition.h"

#include <utility>

#include "mono3d/core/error.h"
#include "tracking/features/feature_extraction.h"
#include "tracking/features/feature_grid.h"
#include "tracking/map/map_bytes.h"
#include "tracking/optimisation/view_pose.h"
#include "tracking/places/map_joining.h"
#include "tracking/places/place_index.h"
#include "tracking/places/relocaliser.h"

namespace mono3d {

using namespace tracking;  // NOLINT(google-build-using-namespace): the module's own

struct SavedPlaces::Content {
  TrackerOptions options;
  std::unique_ptr<Map> map;
  PlaceIndex places;

  void RequireCamera(const Frame& frame) const {
    Validate(frame);
    const auto size = [](const CameraModel& camera) {
      return std::to_string(camera.width) + "x" + std::to_string(camera.height) + ", fx " +
             std::to_string(camera.fx);
    };
    if (frame.camera == map->camera()) return;
    throw Error(ErrorParts{.what = "camera differs from the saved map's",
                           .where = frame.name,
                           .expected = size(map->camera()),
                           .found = size(frame.camera)});
  }

  std::optional<KeyframeId> Find(std::int64_t frame_index) const {
    for (KeyframeId id = 0; id < map->keyframes().size(); ++id) {
      const MapKeyframe& keyframe = map->keyframe(id);
      if (keyframe.alive && keyframe.view.frame.index == frame_index) return id;
    }
    return std::nullopt;
  }

  void List(const std::vector<PlaceMatch>& matches, PlaceRecognition& recognition) const {
    for (const PlaceMatch& match : matches) {
      recognition.candidates.push_back(
          {map->keyframe(match.keyframe).view.frame.index, match.num_votes});
    }
  }
};

SavedPlaces::SavedPlaces(std::string_view map_bytes, const std::string& where,
                         const TrackerOptions& options)
    : content_(std::make_unique<Content>()) {
  options.Validate();
  content_->options = options;
  SavedMap saved = FromBytes(map_bytes, where);
  // New images must have their features on the same levels.
  content_->options.features.num_levels = saved.features.num_levels;
  content_->options.features.scale_factor = saved.features.scale_factor;
  content_->map = std::move(saved.map);
  const Map& map = *content_->map;
  for (KeyframeId id = 0; id < map.keyframes().size(); ++id) {
    if (!map.keyframe(id).alive) continue;
    content_->places.Add(id, FeaturesWithPoints(map.keyframe(id).view));
  }
}

SavedPlaces::~SavedPlaces() = default;
SavedPlaces::SavedPlaces(SavedPlaces&&) noexcept = default;
SavedPlaces& SavedPlaces::operator=(SavedPlaces&&) noexcept = default;

std::vector<TrajectoryEntry> SavedPlaces::Keyframes() const {
  const Map& map = *content_->map;
  std::vector<TrajectoryEntry> entries;
  for (const KeyframeId id : map.InOrderOfFlight()) {
    if (!map.keyframe(id).alive) continue;
    const Frame& frame = map.keyframe(id).view.frame;
    entries.push_back({frame.index, frame.timestamp_s, map.id(), map.T_cam_world(id).Inverse()});
  }
  return entries;
}

PlaceRecognition SavedPlaces::Relocalise(const Frame& frame) {
  content_->RequireCamera(frame);
  const TrackerOptions& options = content_->options;
  View view;
  view.frame = frame;
  view.octaves = BuildOctaves(ToGrey(frame.bgr));
  view.features = ExtractFeatures(view.octaves[0], options.features, options.features.num_features);
  view.grid = FeatureGrid(view.features, frame.camera.width, frame.camera.height);
  view.points.resize(view.features.size());
  PlaceRecognition recognition;
  content_->List(LikelyPlaces(*content_->map, content_->places, view), recognition);
  const PoseResult pose = Relocaliser(options.min_inliers, options.seed)
                              .Relocalise(*content_->map, content_->places, view);
  if (pose.num_inliers < options.min_inliers) return recognition;
  recognition.T_world_cam = view.T_cam_world.Inverse();
  recognition.num_inliers = pose.num_inliers;
  return recognition;
}

PlaceRecognition SavedPlaces::Recognise(const SavedPlaces& other, const Frame& frame) {
  content_->RequireCamera(frame);
  Map& other_map = *other.content_->map;
  const std::optional<KeyframeId> keyframe = other.content_->Find(frame.index);
  if (!keyframe) {
    throw Error(ErrorParts{.what = "the other map has no keyframe of this image",
                           .where = frame.name,
                           .expected = "an index of its keyframes",
                           .found = std::to_string(frame.index)});
  }
  PlaceRecognition recognition;
  content_->List(LikelyPlaces(other_map, *keyframe, *content_->map, content_->places), recognition);
  Octaves& octaves = other_map.keyframe(*keyframe).view.octaves;  // not in a saved map
  octaves = BuildOctaves(ToGrey(frame.bgr));
  const std::optional<PlaceFound> place = FindInOtherMap(other_map, *keyframe, *content_->map,
                                                         content_->places, content_->options.seed);
  octaves = {};
  if (!place) return recognition;
  recognition.T_world_cam = place->T_cam_world.Inverse();
  recognition.num_inliers = place->num_inliers;
  recognition.scale = place->scale;
  return recognition;
}

}  // namespace mono3d
