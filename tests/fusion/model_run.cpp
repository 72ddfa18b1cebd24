// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/model_run.h"

#include <cstddef>
#include <opencv2/core.hpp>
#include <utility>

#include "fusion/fusion_scene.h"
#include "fusion/registration_scene.h"
#include "gpu/test_device.h"

namespace mono3d {
namespace {

using Eigen::Vector3d;

// With holes, noise, another exposure of every second image.
TrackedMap Disturbed(TrackedMap map, int number) {
  const cv::Mat image = map.bgr;
  Disturb(map, 0.002, 5, static_cast<unsigned>(number) + 1);
  map.bgr = image * (number % 2 == 0 ? 1.0 : 0.9);
  map.keyframe_id = map.frame_index = number;
  map.timestamp_s = 0.25 * number;
  map.patch_noise = 1 + 0.1 * number;
  return map;
}

// Some of it is inferred.
TrackedMap WithInferred(TrackedMap map) {
  map.inferred = cv::Mat::zeros(map.depth.size(), CV_8UC1);
  map.inferred.colRange(0, map.inferred.cols / 3) = 1;
  return map;
}

template <typename T>
void AddBytes(std::string& bytes, const std::vector<T>& values) {
  const std::size_t size = values.size();
  bytes.append(reinterpret_cast<const char*>(&size), sizeof(size));
  bytes.append(reinterpret_cast<const char*>(values.data()), size * sizeof(T));
}

void AddNumber(std::string& bytes, double number) {
  bytes.append(reinterpret_cast<const char*>(&number), sizeof(number));
}

void AddSimilarity(std::string& bytes, const Similarity& S) {
  AddNumber(bytes, S.scale());
  for (int i = 0; i < 4; ++i) AddNumber(bytes, S.pose().rotation().coeffs()[i]);
  for (int i = 0; i < 3; ++i) AddNumber(bytes, S.pose().translation()[i]);
}

void AddCloud(std::string& bytes, const PointCloud& cloud) {
  AddBytes(bytes, cloud.points);
  AddBytes(bytes, cloud.normals);
  AddBytes(bytes, cloud.colours);
  AddBytes(bytes, cloud.radii);
  AddBytes(bytes, cloud.confidences);
  AddBytes(bytes, cloud.observations);
  AddBytes(bytes, cloud.inferred);
  AddBytes(bytes, cloud.first_frames);
}

std::string BytesOf(const FusionResult& result) {
  std::string bytes = result.reason + result.health.reason;
  AddSimilarity(bytes, result.S_world_kf);
  const RegistrationEvidence& evidence = result.registration;
  for (const double number : {static_cast<double>(result.status),
                              static_cast<double>(result.rejection),
                              static_cast<double>(result.is_waiting),
                              static_cast<double>(evidence.registered),
                              static_cast<double>(evidence.moved),
                              evidence.tracker_misfit,
                              evidence.overlap,
                              evidence.noise,
                              evidence.agreement,
                              evidence.depth_residual,
                              evidence.grey_residual,
                              evidence.deviation_px,
                              evidence.uncertainty_px,
                              static_cast<double>(result.num_merged),
                              static_cast<double>(result.num_inserted),
                              static_cast<double>(result.num_removed),
                              static_cast<double>(result.num_inferred),
                              static_cast<double>(result.num_surfels),
                              static_cast<double>(result.is_repaired),
                              result.exposure_gain,
                              result.exposure_offset,
                              static_cast<double>(result.starts_submap),
                              static_cast<double>(result.health.state),
                              result.health.accepted_share,
                              result.health.depth_residual,
                              result.health.scale_drift,
                              static_cast<double>(result.health.num_submaps)}) {
    AddNumber(bytes, number);
  }
  for (const RetriedMap& retried : result.retried) {
    AddNumber(bytes, static_cast<double>(retried.frame_index));
    AddNumber(bytes, static_cast<double>(retried.status));
  }
  for (const SubmapJoin& join : result.submap_joins) {
    for (const double number : {join.moved_px, join.scale, static_cast<double>(join.num_merged)}) {
      AddNumber(bytes, number);
    }
  }
  return bytes;
}

std::string BytesOf(const SurfelChanges& changes) {
  std::string bytes;
  AddNumber(bytes, static_cast<double>(changes.version));
  for (const SurfelAnchor& anchor : changes.anchors) AddSimilarity(bytes, anchor.S_world_anchor);
  for (const SurfelChunk& chunk : changes.changed) {
    AddNumber(bytes, chunk.anchor);
    AddCloud(bytes, *chunk.surfels);
  }
  return bytes;
}

}  // namespace

TrackedMap DisturbedView(int number, double angle_deg) {
  return Disturbed(HouseView({}, angle_deg), number);
}

TrackedMap FarView(int number, double x_su) {
  return Disturbed(HouseViewFrom({}, PoseOver(80 + x_su, 0)), number);
}

TrackedMap FarAstray(TrackedMap map) {
  const Pose moved(RotationExp({0.1, 0.15, 0.05}), Vector3d(6, 2, -4));
  map.T_world_cam = moved * map.T_world_cam;
  return map;
}

// Matched in the image of the next one, which turns out to be a little nearer.
void AddView(TrackedMap& map, const TrackedMap& next) {
  const Pose T_ref_cam = RelativePose(Similarity(1, map.T_world_cam), next.T_world_cam);
  map.views = {{next.keyframe_id, Pose(T_ref_cam.rotation(), 1.002 * T_ref_cam.translation())}};
}

std::vector<Step> EventfulFlight() {
  std::vector<Step> steps;
  const auto add = [&](const TrackedMap& map) { steps.push_back({map, {}}); };
  add(DisturbedView(0, 0));
  add(WithInferred(DisturbedView(1, 4)));
  add(DisturbedView(2, 8));
  add(FarAstray(DisturbedView(3, 12)));
  add(WithInferred(DisturbedView(4, 16)));
  add(FarView(5, 0));  // shows nothing of what is there: a submap
  add(FarView(6, 0.6));
  for (std::size_t i = 0; i + 1 < steps.size(); ++i) AddView(*steps[i].map, *steps[i + 1].map);
  std::vector<KeyframePose> moved;
  for (const int number : {4, 5, 6}) {
    const Pose pose(RotationExp({0.002, 0.01, 0}), Vector3d(0.1, -0.05, 0.02));
    const Pose before = steps[static_cast<std::size_t>(number)].map->T_world_cam;
    moved.push_back({number, 0, Similarity(1.01, pose * before)});
  }
  steps.push_back({std::nullopt, moved});
  add(DisturbedView(7, 20));
  add(DisturbedView(8, 12));
  add(WithInferred(DisturbedView(9, 2)));
  return steps;
}

KeyframePoses ModelRun::Snapshot() const {
  std::vector<KeyframePose> list;
  for (const auto& [id, pose] : poses) list.push_back(pose);
  return {1, list};
}

FusionResult ModelRun::Integrate(const TrackedMap& map) {
  poses[map.keyframe_id] = {map.keyframe_id, 0, Similarity(1, map.T_world_cam)};
  return model->Integrate(map, Snapshot());
}

std::string ModelRun::Do(const Step& step) {
  std::string bytes;
  if (step.map) {
    bytes = BytesOf(Integrate(*step.map));
  } else {
    for (const KeyframePose& pose : step.moved) poses[pose.keyframe_id] = pose;
    const UpdateResult result = model->Update(Snapshot());
    AddNumber(bytes, static_cast<double>(result.has_moved));
    AddNumber(bytes, static_cast<double>(result.num_surfels));
  }
  const SurfelChanges changes = model->ChangesSince(version);
  version = changes.version;
  return bytes + BytesOf(changes);
}

std::string ModelRun::End() const {
  std::string bytes;
  for (const FusedDepthMap& map : model->DepthMaps()) AddSimilarity(bytes, map.S_world_kf);
  AddCloud(bytes, model->Export(SurfelExportOptions{.min_confidence = 0}));
  return bytes;
}

ModelRun NewModelRun(const SurfelMapOptions& options) {
  return {CreateSurfelMap(TestDevice(), options), {}};
}

}  // namespace mono3d
