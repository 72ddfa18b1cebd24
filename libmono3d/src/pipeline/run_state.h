// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "geometry/geometry_state.h"
#include "image/image_state.h"
#include "image/state_archive.h"
#include "mono3d/geometry/point_cloud.h"
#include "mono3d/image/image_bundle.h"
#include "mono3d/image/keyframe_constraint.h"
#include "mono3d/keyframes/keyframe_selector.h"
#include "mono3d/pipeline/reconstruction.h"
#include "pipeline/model_feedback.h"

namespace mono3d {

// For the archives of image/state_archive.h: what the chain itself keeps.

template <typename Archive, typename Enum>
void ExchangeEnum(Archive& archive, Enum& value, Enum last) {
  std::uint8_t number = static_cast<std::uint8_t>(value);
  archive.Number(number);
  if constexpr (Archive::kReads) {
    if (number > static_cast<std::uint8_t>(last)) archive.Refuse("a value is none of its kind");
    value = static_cast<Enum>(number);
  }
}

template <typename Archive, typename Key, typename Value, typename ExchangeKey,
          typename ExchangeValue>
void ExchangeMap(Archive& archive, std::map<Key, Value>& map, const ExchangeKey& exchange_key,
                 const ExchangeValue& exchange_value) {
  std::vector<Key> keys;
  for (const auto& [key, value] : map) keys.push_back(key);
  archive.List(keys, exchange_key);
  if constexpr (Archive::kReads) map.clear();
  for (const Key& key : keys) exchange_value(map[key]);
}

template <typename Archive, typename Number>
void ExchangeNumbersByText(Archive& archive, std::map<std::string, Number>& map) {
  ExchangeMap(
      archive, map, [&](std::string& key) { archive.Text(key); },
      [&](Number& number) { archive.Number(number); });
}

template <typename Archive>
void ExchangeState(Archive& archive, FramePose& frame) {
  archive.Number(frame.frame_index);
  archive.Number(frame.timestamp_s);
  archive.Number(frame.keyframe_id);
  ExchangeState(archive, frame.T_kf_cam);
}

template <typename Archive>
void ExchangeState(Archive& archive, TrajectoryEntry& entry) {
  archive.Number(entry.frame_index);
  archive.Number(entry.timestamp_s);
  archive.Number(entry.map_id);
  ExchangeState(archive, entry.T_world_cam);
}

template <typename Archive>
void ExchangeState(Archive& archive, PipelineCounts& counts) {
  for (std::int64_t* number :
       {&counts.num_frames, &counts.num_dropped_frames, &counts.num_tracked, &counts.num_recovered,
        &counts.num_keyframes, &counts.num_keyframes_without_image, &counts.num_bundles,
        &counts.num_dropped_bundles, &counts.num_depth_maps, &counts.num_fused,
        &counts.num_fused_late, &counts.num_repairs, &counts.num_submaps_started,
        &counts.num_submaps_joined, &counts.num_models_joined, &counts.num_corrections,
        &counts.num_constraints}) {
    ExchangeCount(archive, *number);
  }
  archive.Text(counts.selector_findings);
  ExchangeNumbersByText(archive, counts.reduced_depth_maps);
  ExchangeNumbersByText(archive, counts.untracked_frames);
  ExchangeNumbersByText(archive, counts.rejected_bundles);
  ExchangeNumbersByText(archive, counts.rejected_depth_maps);
}

template <typename Archive>
void ExchangeState(Archive& archive, RegistrationEvidence& evidence) {
  archive.Number(evidence.registered);
  archive.Number(evidence.moved);
  archive.Number(evidence.num_iterations);
  for (double* number :
       {&evidence.tracker_misfit, &evidence.overlap, &evidence.noise, &evidence.agreement,
        &evidence.contradiction, &evidence.depth_residual, &evidence.grey_residual,
        &evidence.grey_correlation, &evidence.deviation_px, &evidence.scale_deviation,
        &evidence.uncertainty_px}) {
    archive.AnyNumber(*number);
  }
}

template <typename Archive>
void ExchangeState(Archive& archive, FusionRecord& record) {
  archive.Number(record.frame_index);
  ExchangeEnum(archive, record.status, FusionStatus::kRejected);
  ExchangeEnum(archive, record.rejection, FusionRejection::kOther);
  archive.Text(record.reason);
  archive.Number(record.is_retry);
  ExchangeState(archive, record.registration);
  archive.Number(record.starts_submap);
  archive.Number(record.is_repaired);
}

template <typename Archive>
void ExchangeState(Archive& archive, ModelHealth& health) {
  ExchangeEnum(archive, health.state, HealthState::kBroken);
  archive.Text(health.reason);
  archive.Number(health.num_registrations);
  for (double* number : {&health.accepted_share, &health.moved_share, &health.depth_residual,
                         &health.scale_drift, &health.deviation_px}) {
    archive.AnyNumber(*number);
  }
  archive.Number(health.num_submaps);
}

template <typename Archive>
void ExchangeState(Archive& archive, HealthChange& change) {
  archive.Number(change.frame_index);
  ExchangeEnum(archive, change.state, HealthState::kBroken);
  archive.Text(change.reason);
}

template <typename Archive>
void ExchangeState(Archive& archive, SubmapJoin& join) {
  archive.Number(join.frame_index);
  archive.Number(join.num_submaps);
  archive.AnyNumber(join.moved_px);
  archive.AnyNumber(join.scale);
  archive.Number(join.num_merged);
}

template <typename Archive>
void ExchangeState(Archive& archive, KeyframeConstraint& constraint) {
  archive.Number(constraint.id);
  archive.Number(constraint.anchor_id);
  ExchangeState(archive, constraint.T_cam_anchor);
  ExchangeScale(archive, constraint.scale);
  ExchangeElements(archive, constraint.information);
}

template <typename Archive>
void ExchangeState(Archive& archive, DepthQuality& quality) {
  archive.Number(quality.reference_id);
  archive.Number(quality.density);
  archive.Number(quality.confidence);
}

template <typename Archive>
void ExchangeState(Archive& archive, ModelFeedback& feedback) {
  const auto exchange = [&](auto& member) { ExchangeState(archive, member); };
  archive.List(feedback.constraints, exchange);
  archive.List(feedback.qualities, exchange);
}

template <typename Archive>
void ExchangeState(Archive& archive, PointCloud& cloud) {
  const auto vectors = [&](std::vector<Eigen::Vector3f>& list) {
    archive.List(list, [&](Eigen::Vector3f& vector) { ExchangeElements(archive, vector); });
  };
  vectors(cloud.points);
  vectors(cloud.normals);
  archive.List(cloud.colours, [&](auto& colour) { archive.Numbers(colour.data(), 3); });
  archive.List(cloud.radii, [&](float& radius) { archive.Number(radius); });
  archive.List(cloud.confidences, [&](float& confidence) { archive.Number(confidence); });
  archive.List(cloud.observations, [&](std::uint32_t& number) { archive.Number(number); });
  archive.List(cloud.inferred, [&](std::uint8_t& is_inferred) { archive.Number(is_inferred); });
  archive.List(cloud.first_frames, [&](std::uint32_t& number) { archive.Number(number); });
  if constexpr (Archive::kReads) {
    for (const std::size_t size :
         {cloud.normals.size(), cloud.colours.size(), cloud.radii.size(), cloud.confidences.size(),
          cloud.observations.size(), cloud.inferred.size(), cloud.first_frames.size()}) {
      if (size != 0 && size != cloud.points.size()) archive.Refuse("contradicts itself");
    }
  }
}

template <typename Archive>
void ExchangeState(Archive& archive, ImageBundle& bundle) {
  const auto exchange = [&](auto& member) { ExchangeState(archive, member); };
  archive.List(bundle.keyframes, exchange);
  archive.List(bundle.T_ref_cam, exchange);
  bool has_sides = bundle.num_first_side.has_value();
  archive.Number(has_sides);
  if (has_sides) {
    if constexpr (Archive::kReads) bundle.num_first_side = 0;
    archive.Index(*bundle.num_first_side);
  }
  if constexpr (Archive::kReads) {
    if (bundle.reference_index() >= bundle.keyframes.size()) archive.Refuse("contradicts itself");
  }
}

// Null is none of them.
template <typename Archive>
void ExchangeState(Archive& archive, KeyframePosesPtr& poses) {
  std::uint64_t version = poses->version();
  std::vector<KeyframePose> list(poses->poses().begin(), poses->poses().end());
  archive.Number(version);
  archive.List(list, [&](KeyframePose& pose) { ExchangeState(archive, pose); });
  if constexpr (Archive::kReads) {
    poses = std::make_shared<const KeyframePoses>(version, std::move(list));
  }
}

}  // namespace mono3d
