// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "image/image_state.h"
#include "tracking/alignment/octaves.h"
#include "tracking/features/feature_grid.h"
#include "tracking/map/frame_record.h"
#include "tracking/map/map.h"
#include "tracking/map/map_checks.h"

namespace mono3d::tracking {

// The parts of a map for the archives of image/state_archive.h. Reading checks what each is on its
// own, and that they agree (map_checks.h).

template <typename Archive>
void ExchangeState(Archive& archive, PointId& id) {
  archive.Number(id.index);
  archive.Number(id.generation);
}

template <typename Archive>
void ExchangeState(Archive& archive, Feature& feature) {
  ExchangeElements(archive, feature.pixel);
  archive.Number(feature.level);
  for (double* number : {&feature.angle_deg, &feature.response, &feature.sigma_px}) {
    ExchangeBounded(archive, *number);
  }
  archive.Numbers(feature.descriptor.data(), feature.descriptor.size());
}

template <typename Archive>
void ExchangeState(Archive& archive, Patch& patch) {
  ExchangeElements(archive, patch.pixel);
  archive.Number(patch.octave);
  ExchangeElements(archive, patch.centre);
  archive.Numbers(patch.grey.data(), patch.grey.size());
  ExchangeElements(archive, patch.normal.value);
  ExchangeElements(archive, patch.normal.information);
  if constexpr (Archive::kReads) {
    if (patch.octave < 0 || patch.octave >= kNumOctaves) archive.Refuse("an octave is none");
  }
}

template <typename Archive>
void ExchangeState(Archive& archive, MapPoint& point) {
  archive.Number(point.alive);
  archive.Number(point.generation);
  // Of a point that is not alive nothing else is asked for, but it is saved with the map.
  for (int i = 0; i < 3; ++i) {
    if (point.alive) {
      ExchangeBounded(archive, point.p_world[i]);
      ExchangeBounded(archive, point.towards_cameras[i]);
    } else {
      archive.AnyNumber(point.p_world[i]);
      archive.AnyNumber(point.towards_cameras[i]);
    }
  }
  for (double* number : {&point.depth_sigma, &point.min_distance, &point.max_distance}) {
    if (point.alive) {
      ExchangeBounded(archive, *number);
    } else {
      archive.AnyNumber(*number);
    }
  }
  archive.List(point.observations, [&](Observation& observation) {
    archive.Index(observation.keyframe);
    archive.Index(observation.feature);
  });
  archive.Index(point.created_at);
  for (int* count : {&point.num_predicted, &point.num_found, &point.num_due_keyframes,
                     &point.num_showing_keyframes}) {
    archive.Number(*count);
  }
  archive.Optional(point.patch, [&](Patch& patch) { ExchangeState(archive, patch); });
  archive.Index(point.patch_keyframe);
  archive.Numbers(point.colour.data(), point.colour.size());
  archive.Numbers(point.descriptor.data(), point.descriptor.size());
}

// Where it is what the features as they are make of it, their number is enough: it is as large as
// they are, and seldom anything else (a start moves features to where patches are found).
template <typename Archive>
void ExchangeGrid(Archive& archive, FeatureGrid& grid, const std::vector<Feature>& features,
                  const CameraModel& camera) {
  std::size_t num_features = grid.num_features();
  archive.Index(num_features);
  if constexpr (Archive::kReads) {
    if (num_features > features.size()) archive.Refuse("contradicts itself");
  }
  const auto made_anew = [&] {
    const auto end = features.begin() + static_cast<std::ptrdiff_t>(num_features);
    return FeatureGrid(std::vector<Feature>(features.begin(), end), camera.width, camera.height);
  };
  bool is_as_made = !Archive::kReads && num_features > 0 && num_features <= features.size() &&
                    grid == made_anew();
  archive.Number(is_as_made);
  if (!is_as_made) {
    grid.ExchangeState(archive, features.size());
  } else if constexpr (Archive::kReads) {
    grid = made_anew();
  }
}

// Octaves come back from the image, or from its grey values where it has been released.
template <typename Archive>
void ExchangeState(Archive& archive, Octaves& octaves, const Frame& frame) {
  bool is_there = !octaves.empty();
  archive.Number(is_there);
  cv::Mat grey;
  if (is_there && frame.bgr.empty()) {
    if constexpr (!Archive::kReads) grey = octaves.front();
    archive.Grey(grey, frame.index);
  }
  if constexpr (Archive::kReads) {
    octaves.clear();
    if (!is_there) return;
    if (!frame.bgr.empty()) grey = ToGrey(frame.bgr);
    if (grey.cols != frame.camera.width || grey.rows != frame.camera.height ||
        grey.type() != CV_8UC1) {
      archive.Refuse("an image has another size than its camera");
    }
    octaves = BuildOctaves(grey);
  }
}

template <typename Archive>
void ExchangeState(Archive& archive, View& view) {
  ExchangeState(archive, view.frame);
  // Most of a view, which hardly ever changes once it is a keyframe's.
  archive.NextSection();
  archive.List(view.features, [&](Feature& feature) { ExchangeState(archive, feature); });
  ExchangeGrid(archive, view.grid, view.features, view.frame.camera);
  ExchangeState(archive, view.octaves, view.frame);
  archive.NextSection();
  archive.List(view.points, [&](std::optional<PointId>& point) {
    archive.Optional(point, [&](PointId& id) { ExchangeState(archive, id); });
  });
  ExchangeBounded(archive, view.log_sharpness);
  archive.Optional(view.patch_noise, [&](double& noise) { ExchangeBounded(archive, noise); });
  ExchangeState(archive, view.T_cam_world);
  CameraModel sensor = view.shutter.sensor();
  bool is_of_frame = sensor == view.frame.sensor;
  archive.Number(is_of_frame);
  if (!is_of_frame) ExchangeState(archive, sensor);
  CameraVelocity velocity = view.shutter.velocity();
  ExchangeState(archive, velocity);
  ExchangeState(archive, view.velocity_prior.mean);
  ExchangeBounded(archive, view.velocity_prior.angular_sigma_rad_per_s);
  ExchangeBounded(archive, view.velocity_prior.linear_sigma_su_per_s);
  if constexpr (Archive::kReads) {
    if (is_of_frame) sensor = view.frame.sensor;
    if (sensor.width != 0) Validate(sensor, view.frame.name);
    view.shutter = {sensor, velocity};
  }
}

template <typename Archive>
void ExchangeState(Archive& archive, MapKeyframe& keyframe) {
  ExchangeState(archive, keyframe.view);
  archive.Number(keyframe.id);
  archive.Number(keyframe.alive);
  archive.Number(keyframe.num_newer_adjusted);
  archive.Number(keyframe.is_finalised);
  ExchangeScale(archive, keyframe.scale);
  ExchangeState(archive, keyframe.S_world_visual);
  archive.Index(keyframe.anchor);
  ExchangeState(archive, keyframe.T_cam_anchor);
}

template <typename Archive>
void ExchangeState(Archive& archive, MapConstraint& constraint) {
  archive.Index(constraint.keyframe);
  archive.Index(constraint.anchor);
  ExchangeState(archive, constraint.T_cam_anchor);
  ExchangeScale(archive, constraint.scale);
  ExchangeElements(archive, constraint.information);
  archive.Number(constraint.is_new);
}

template <typename Archive>
void ExchangeState(Archive& archive, FrameRecord& record) {
  archive.Number(record.frame_index);
  ExchangeBounded(archive, record.timestamp_s);
  archive.Number(record.map_id);
  archive.Index(record.keyframe);
  ExchangeState(archive, record.T_cam_keyframe);
}

// Here, because what it is made of leans on the map itself.
template <typename Archive>
void Map::ExchangeState(Archive& archive) {
  // Points that were created together change together.
  constexpr std::size_t kPointsOfSection = 32;
  archive.Sections(points_, kPointsOfSection,
                   [&](MapPoint& point) { tracking::ExchangeState(archive, point); });
  archive.Sections(keyframes_, 1,
                   [&](MapKeyframe& keyframe) { tracking::ExchangeState(archive, keyframe); });
  archive.List(constraints_,
               [&](MapConstraint& constraint) { tracking::ExchangeState(archive, constraint); });
  archive.List(free_, [&](std::uint32_t& index) { archive.Number(index); });
  archive.NextSection();
  if constexpr (Archive::kReads) {
    if (!AreConsistent(*this) || !AreFreePlaces(*this, free_)) archive.Refuse("contradicts itself");
    ListAnew();
  }
}

}  // namespace mono3d::tracking
