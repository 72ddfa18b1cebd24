// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/fusion_scene.h"

#include <random>

#include "gpu/test_device.h"

namespace mono3d {
namespace {

constexpr std::uint32_t kRoom = 100'000;  // surfels
constexpr double kAnchorUnitsPerSu = 1.7;

// `wall_columns` of the image, on the left, show a wall that stands before the rest.
TrackedMap SceneMap(int width_px, int height_px, const Pose& pose, int wall_columns,
                    unsigned seed) {
  // Two per cent is half the sigma of the map: matching noise that is mostly associated.
  constexpr double kNoise = 0.02;
  const Plane slanted{Eigen::Vector3d(0.3, -0.4, -1).normalized(), -9};
  TrackedMap map = PlaneMap(TestCamera(width_px, height_px), pose, slanted);
  const TrackedMap wall = PlaneMap(map.camera, pose, Plane{{0, 0, -1}, -5});
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < wall_columns; ++x) {
      map.depth.at<float>(y, x) = wall.depth.at<float>(y, x);
    }
  }
  Disturb(map, kNoise, 11, seed);
  return map;
}

}  // namespace

CameraModel TestCamera(int width_px, int height_px) {
  CameraModel camera;
  camera.width = width_px;
  camera.height = height_px;
  camera.fx = camera.fy = width_px;
  camera.cx = 0.5 * (width_px - 1);
  camera.cy = 0.5 * (height_px - 1);
  return camera;
}

TrackedMap PlaneMap(const CameraModel& camera, const Pose& T_world_cam, const Plane& plane) {
  TrackedMap map;
  map.camera = camera;
  map.T_world_cam = T_world_cam;
  map.depth = cv::Mat(camera.height, camera.width, CV_32FC1, cv::Scalar(0));
  map.bgr = cv::Mat(camera.height, camera.width, CV_8UC3, cv::Scalar(100, 100, 100));
  map.depth_sigma_per_square_depth = 1 / camera.fx;
  for (int y = 0; y < camera.height; ++y) {
    for (int x = 0; x < camera.width; ++x) {
      const Eigen::Vector3d ray_world = T_world_cam.rotation() * camera.Unproject({x, y});
      const double along = plane.normal.dot(ray_world);
      const double to_plane = plane.offset_su - plane.normal.dot(T_world_cam.translation());
      // The side that can be seen, in front of the camera.
      if (along < 0 && to_plane < 0)
        map.depth.at<float>(y, x) = static_cast<float>(to_plane / along);
    }
  }
  return map;
}

void Disturb(TrackedMap& map, double amount, int nth_missing, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> noise(-amount, amount);
  std::uniform_int_distribution<int> colour(0, 255);
  int count = 0;
  for (int y = 0; y < map.depth.rows; ++y) {
    for (int x = 0; x < map.depth.cols; ++x) {
      float& z = map.depth.at<float>(y, x);
      z = static_cast<float>(z / (1 + noise(random)));
      if (nth_missing > 0 && ++count % nth_missing == 0) z = 0;
      for (int channel = 0; channel < 3; ++channel) {
        map.bgr.at<cv::Vec3b>(y, x)[channel] = static_cast<unsigned char>(colour(random));
      }
    }
  }
}

Pose MovedPose() { return {RotationExp({0.02, -0.05, 0.03}), Eigen::Vector3d(0.7, -0.2, 0.3)}; }

Surfels InUnit(const Surfels& surfels, double per_su) {
  const auto scale = static_cast<float>(per_su);
  Surfels scaled = surfels;
  for (Surfels::Float4& position : scaled.position_radius) {
    for (float& length : position) length *= scale;
  }
  for (Surfels::Float4& normal : scaled.normal_weight) normal[3] /= scale * scale;
  return scaled;
}

StageScene::StageScene(int width_px, int height_px, unsigned seed)
    : StageScene(
          SceneMap(width_px, height_px, MovedPose(), width_px / 10, seed + 1),
          [&] {
            const TrackedMap first = SceneMap(width_px, height_px, Pose(), width_px / 3, seed);
            Surfels model;
            reference::Integrate(MakeViewParams(first, {}, 0, 0), {}, Pack(first), model);
            for (int i = 0; i < 40; ++i) {  // hidden behind it all
              Append(model, OneSurfel({0.5F * static_cast<float>(i) - 10, 1, 30}, {0, 0, -1}, 1));
            }
            return InUnit(model, kAnchorUnitsPerSu);
          }(),
          {}, {Similarity(1 / kAnchorUnitsPerSu, Pose())}) {}

StageScene::StageScene(const TrackedMap& map, const Surfels& model, const SurfelMapOptions& options,
                       const std::vector<Similarity>& S_world_anchor)
    : view(MakeViewParams(map, options, static_cast<std::uint32_t>(model.size()), 1)),
      anchors(AnchorTransforms(Similarity(1, map.T_world_cam), S_world_anchor)),
      packed(Pack(map)),
      surfels(model),
      recorder(TestDevice()),
      kernels(TestDevice()),
      buffers(TestDevice(), map.camera.width, map.camera.height),
      storage(TestDevice(), kRoom) {
  anchor_table.Set(TestDevice(), anchors);
  buffers.Write(TestDevice(), [&](const PackedPixels& to) { return mono3d::Pack(map, true, to); });
  storage.Upload(surfels);
  all_blocks.SetRange(TestDevice(), 0, storage.size());
}

void StageScene::RunAssociate() {
  kernels.Prepare(recorder, view, buffers);
  kernels.Associate(recorder, view, anchor_table, buffers, storage, all_blocks);
  recorder.Submit();
}

void StageScene::RunIndexMap() {
  RunAssociate();
  kernels.DrawIndexMap(recorder, view, anchor_table, buffers.index_map, storage, all_blocks);
  recorder.Submit();
}

void StageScene::RunSelectNew() {
  RunIndexMap();
  kernels.SelectNew(recorder, view, anchor_table, buffers, buffers.index_map, storage, all_blocks);
  recorder.Submit();
}

reference::Candidates StageScene::DeviceCandidates() const {
  return buffers.candidate.Download<std::array<float, 4>>();
}

std::vector<std::uint32_t> StageScene::DeviceAssociation() const {
  std::vector<std::uint32_t> association(surfels.size());
  storage.association().Download(std::span(association));
  return association;
}

std::vector<reference::IndexCell> StageScene::DeviceIndexMap() const {
  return buffers.index_map.Download<reference::IndexCell>();
}

std::vector<std::uint32_t> StageScene::DeviceSelected() const {
  return buffers.selected.Download<std::uint32_t>();
}

Surfels OneSurfel(const Eigen::Vector3f& p_world, const Eigen::Vector3f& normal, float weight) {
  Surfels surfels;
  surfels.position_radius.push_back({p_world.x(), p_world.y(), p_world.z(), 1});
  surfels.normal_weight.push_back({normal.x(), normal.y(), normal.z(), weight});
  surfels.history.push_back({0, 1, 0, 256U << 16});
  return surfels;
}

void Append(Surfels& surfels, const Surfels& more) {
  const auto append = [](auto& to, const auto& from) {
    to.insert(to.end(), from.begin(), from.end());
  };
  append(surfels.position_radius, more.position_radius);
  append(surfels.normal_weight, more.normal_weight);
  append(surfels.history, more.history);
}

}  // namespace mono3d
