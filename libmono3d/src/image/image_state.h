// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "geometry/geometry_state.h"
#include "mono3d/image/camera_positions.h"
#include "mono3d/image/frame.h"
#include "mono3d/image/keyframe.h"
#include "mono3d/image/keyframe_poses.h"

namespace mono3d {

// For the archives of image/state_archive.h.

// What belongs to a frame must be possible: whatever works with it has checked that it is.
template <typename Archive>
void ExchangeState(Archive& archive, Frame& frame) {
  archive.Number(frame.index);
  ExchangeBounded(archive, frame.timestamp_s);
  archive.Text(frame.name);
  ExchangeState(archive, frame.camera);
  ExchangeState(archive, frame.sensor);
  for (int* number :
       {&frame.content.x, &frame.content.y, &frame.content.width, &frame.content.height}) {
    archive.Number(*number);
  }
  archive.Image(frame.bgr, frame.index);
  if constexpr (Archive::kReads) {
    constexpr int kMaxSide = 1 << 15;
    if (frame.camera.width > kMaxSide || frame.camera.height > kMaxSide) {
      archive.Refuse("an image is too large");
    }
    constexpr std::int64_t kMaxIndex = std::int64_t{1} << 53;
    const cv::Rect& content = frame.content;
    const auto is_part = [](int first, int count, int size) {
      return first >= 0 && first <= size && count >= 0 && count <= size - first;
    };
    if (frame.index < 0 || frame.index > kMaxIndex ||
        !is_part(content.x, content.width, frame.camera.width) ||
        !is_part(content.y, content.height, frame.camera.height)) {
      archive.Refuse("contradicts itself");
    }
    if (frame.bgr.empty()) {
      Validate(frame.camera, frame.name);
    } else {
      Validate(frame);
    }
    if (frame.sensor.width != 0) Validate(frame.sensor, frame.name);
  }
}

template <typename Archive>
void ExchangeState(Archive& archive, Keyframe& keyframe) {
  archive.Number(keyframe.id);
  ExchangeState(archive, keyframe.frame);
  archive.List(keyframe.sparse_depths_su, [&](float& depth) { archive.Number(depth); });
  archive.List(keyframe.sparse_pixels,
               [&](Eigen::Vector2f& pixel) { ExchangeElements(archive, pixel); });
  if constexpr (Archive::kReads) {
    const bool has_pixels = !keyframe.sparse_pixels.empty();
    if (has_pixels && keyframe.sparse_pixels.size() != keyframe.sparse_depths_su.size()) {
      archive.Refuse("contradicts itself");
    }
  }
  ExchangeState(archive, keyframe.velocity);
  ExchangeBounded(archive, keyframe.patch_noise);
  if constexpr (Archive::kReads) {
    if (keyframe.patch_noise < 1) archive.Refuse("contradicts itself");
  }
}

template <typename Archive>
void ExchangeState(Archive& archive, KeyframePose& pose) {
  archive.Number(pose.keyframe_id);
  archive.Number(pose.map_id);
  ExchangeState(archive, pose.S_world_kf);
}

template <typename Archive>
void ExchangeState(Archive& archive, CameraPositions& positions) {
  archive.Number(positions.map_id);
  ExchangeState(archive, positions.S_metric_map);
  archive.List(positions.positions, [&](CameraPosition& position) {
    ExchangeBounded(archive, position.time_s);
    ExchangeElements(archive, position.p_m);
    archive.Number(position.frame_index);
    ExchangeElements(archive, position.sigma_m);
  });
  archive.List(positions.points, [&](KnownPoint& point) {
    ExchangeElements(archive, point.p_m);
    ExchangeElements(archive, point.sigma_m);
    archive.List(point.sights, [&](PointSight& sight) {
      archive.Number(sight.frame_index);
      ExchangeElements(archive, sight.ray_cam);
      ExchangeBounded(archive, sight.sigma);
    });
  });
  archive.Number(positions.has_vertical);
  ExchangeBounded(archive, positions.clock_offset_s);
  ExchangeBounded(archive, positions.clock_offset_sigma_s);
  if constexpr (Archive::kReads) {
    if (positions.clock_offset_sigma_s < 0) archive.Refuse("contradicts itself");
  }
  for (double* number :
       {&positions.typical_horizontal_m, &positions.typical_vertical_m, &positions.worth}) {
    ExchangeBounded(archive, *number);
    if constexpr (Archive::kReads) {
      if (*number < 0) archive.Refuse("contradicts itself");
    }
  }
}

template <typename Archive>
void ExchangeState(Archive& archive, PositionFit& fit) {
  archive.Number(fit.map_id);
  archive.Index(fit.num_used);
  archive.Index(fit.num_outliers);
  archive.Index(fit.num_points_used);
  archive.Index(fit.num_point_outliers);
  for (PositionNoise* noise : {&fit.horizontal, &fit.vertical}) {
    // What nothing tells of may be infinite.
    archive.AnyNumber(noise->wander_m);
    archive.AnyNumber(noise->correlation_s);
    archive.AnyNumber(noise->white_m);
  }
  archive.AnyNumber(fit.drift.rotation_rad);
  archive.AnyNumber(fit.drift.log_scale);
  archive.AnyNumber(fit.rms_moved_m);
}

}  // namespace mono3d
