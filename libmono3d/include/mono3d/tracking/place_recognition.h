// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/geometry/pose.h"
#include "mono3d/image/frame.h"
#include "mono3d/tracking/tracker.h"

namespace MONO3D_EXPORT mono3d {

// A keyframe of a map that looks like an image.
struct PlaceCandidate {
  std::int64_t frame_index = 0;  // of the keyframe
  int num_votes = 0;             // features of the image that look like one of the keyframe's
};

// Whether a map holds what an image shows, and from where it was taken then.
struct PlaceRecognition {
  std::vector<PlaceCandidate> candidates;  // what was looked at first, most votes first
  // Of the candidates or, for a lost camera, of the newest keyframes the first that stood the
  // geometric check; in the map's world. Nothing where none did.
  std::optional<Pose> T_world_cam;
  int num_inliers = 0;  // map points that the pose rests on; 0 without one
  // Of a keyframe of another map: lengths in this map over the same lengths in that one.
  std::optional<double> scale;
};

// The places of a map that Tracker::SaveMap returned, asked as the tracker asks them: by itself
// when it is lost, closes a loop or joins two maps; here without changing the map or needing a
// video. Images are those of the map's camera: where they are larger than
// TrackerOptions::max_side_px, they must be made as small first. Same input, same result.
class SavedPlaces {
 public:
  // Throws Error on anything that SaveMap has not made; `where` names the bytes in messages.
  SavedPlaces(std::string_view map_bytes, const std::string& where,
              const TrackerOptions& options = {});
  ~SavedPlaces();
  SavedPlaces(SavedPlaces&&) noexcept;
  SavedPlaces& operator=(SavedPlaces&&) noexcept;

  // Its keyframes that were not culled, in the order of flight.
  std::vector<TrajectoryEntry> Keyframes() const;

  // From where was the image taken? As a lost tracker finds back, from nothing but the image.
  // Throws Error on an invalid frame or one of another camera.
  PlaceRecognition Relocalise(const Frame& frame);

  // Where is a keyframe of another map in this one? As the tracker joins two maps: by the points of
  // this one, with one scale that the points of both agree on. `frame` is the image of the
  // keyframe. Throws Error as above, or where `other` has no such keyframe.
  PlaceRecognition Recognise(const SavedPlaces& other, const Frame& frame);

 private:
  struct Content;
  std::unique_ptr<Content> content_;
};

}  // namespace mono3d
