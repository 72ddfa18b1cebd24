// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/bundle_input.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <utility>

#include "mono3d/core/error.h"
#include "mono3d/io/any_trajectory_file.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/colmap_model.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/trajectory_file.h"

namespace mono3d::tools {
namespace {

std::vector<Frame> ReadFrames(const BundleInput& input, const CameraModel& calibration) {
  std::vector<std::string> images = input.images;
  if (images.size() == 1 && !std::filesystem::is_regular_file(images[0])) {
    images = ListImages(images[0]);
  }
  if (!IsBundleSize(images.size())) {
    throw UsageError(ErrorParts{
        .what = images.size() > 9 ? "wrong number of images: name those of one depth map, or give "
                                    "all of them to mono3d-reconstruct"
                                  : "wrong number of images",
        .where = input.images[0],
        .expected = kBundleSizesText,
        .found = std::to_string(images.size())});
  }
  FrameSourceOptions options;
  options.resize = input.resize;
  const auto source = OpenFrameSource(images, calibration, options);
  std::vector<Frame> frames;
  while (std::optional<Frame> frame = source->Next()) frames.push_back(*std::move(frame));
  return frames;
}

// Images with where they are, each in the order of flight.
struct PosedImages {
  std::vector<Keyframe> keyframes;
  std::vector<KeyframePose> poses;

  Keyframe& Add(const Frame& frame, const Pose& T_world_cam) {
    const auto id = static_cast<std::int64_t>(keyframes.size());
    keyframes.push_back({.id = id, .frame = frame, .sparse_depths_su = {}});
    poses.push_back({.keyframe_id = id, .map_id = 0, .S_world_kf = {1, T_world_cam}});
    return keyframes.back();
  }
};

PosedImages PosedByTum(const std::vector<Frame>& frames, const std::filesystem::path& path) {
  const std::vector<StampedPose> poses = ReadTrajectory(path);
  if (poses.size() != frames.size()) {
    throw Error(ErrorParts{.what = "wrong number of poses",
                           .where = path,
                           .expected = std::to_string(frames.size()) + ", one for each image",
                           .found = std::to_string(poses.size())});
  }
  PosedImages images;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    images.Add(frames[i], poses[i].T_world_cam).frame.timestamp_s = poses[i].timestamp_s;
  }
  return images;
}

// COLMAP's names may have folders before them.
PosedImages PosedByColmap(const std::vector<Frame>& frames, const std::filesystem::path& folder) {
  const SparseModel model = ReadColmapModel(folder);
  PosedImages images;
  for (const Frame& frame : frames) {
    const auto image =
        std::find_if(model.images.begin(), model.images.end(), [&](const SparseImage& candidate) {
          return std::filesystem::path(candidate.name).filename() == frame.name;
        });
    if (image == model.images.end()) {
      throw Error(ErrorParts{.what = "COLMAP model does not have the image",
                             .where = folder / "images.txt",
                             .expected = frame.name,
                             .found = std::to_string(model.images.size()) + " other images"});
    }
    Keyframe& keyframe = images.Add(frame, image->T_world_cam);
    const Pose T_cam_world = image->T_world_cam.Inverse();
    for (const SparseObservation& seen : image->observations) {
      if (!seen.point) continue;
      const double z = (T_cam_world * model.points[*seen.point].p_world).z();
      if (z > 0) keyframe.sparse_depths_su.push_back(static_cast<float>(z));
    }
  }
  return images;
}

// With the poses of the file or folder that was named.
PosedImages ReadPosedImages(const BundleInput& input, const std::vector<Frame>& frames) {
  if (std::filesystem::is_directory(input.poses)) return PosedByColmap(frames, input.poses);
  if (DetectTrajectoryForm(input.poses) == TrajectoryForm::kColmap) {
    return PosedByColmap(frames, std::filesystem::path(input.poses).parent_path());
  }
  return PosedByTum(frames, input.poses);
}

}  // namespace

PosedBundle ReadBundle(const BundleInput& input, StageTimes* times) {
  PosedBundle posed;
  posed.calibration = ReadCameraFile(input.camera);
  const std::vector<Frame> frames = ReadFrames(input, posed.calibration);
  if (input.poses.empty()) {
    posed.estimation = EstimateImageBundlePoses(frames, input.estimation, times);
    if (!posed.estimation->is_estimated) throw Error("no poses: " + posed.estimation->reason);
    posed.bundle.keyframes = posed.estimation->keyframes;
    std::vector<KeyframePose> poses;
    for (std::size_t i = 0; i < posed.bundle.keyframes.size(); ++i) {
      poses.push_back({.keyframe_id = posed.bundle.keyframes[i].id,
                       .map_id = 0,
                       .S_world_kf = {1, posed.estimation->T_world_cam[i]}});
    }
    posed.poses = KeyframePoses(0, std::move(poses));
  } else {
    PosedImages images = ReadPosedImages(input, frames);
    posed.bundle.keyframes = std::move(images.keyframes);
    posed.poses = KeyframePoses(0, std::move(images.poses));
  }
  if (!SetPoses(posed.poses, posed.bundle)) throw Error("an image of the bundle has no pose");
  return posed;
}

nlohmann::ordered_json PosesRecord(const BundleInput& input, const PosedBundle& posed) {
  nlohmann::ordered_json json;
  json["from"] = posed.estimation ? "estimated" : input.poses;
  if (posed.estimation) {
    std::size_t num_observations = 0;
    for (const SparseImage& image : posed.estimation->model.images) {
      num_observations += image.observations.size();
    }
    json["points"] = posed.estimation->model.points.size();
    json["observations"] = num_observations;
    json["reprojection_px"] = posed.estimation->reprojection_px;
  }
  for (const Keyframe& keyframe : posed.bundle.keyframes) {
    const Pose& T_world_cam = posed.poses.At(keyframe.id).T_world_cam();
    const Eigen::Vector3d& t = T_world_cam.translation();
    const Eigen::Quaterniond& q = T_world_cam.rotation();
    json["images"].push_back({{"name", keyframe.frame.name},
                              {"tx_ty_tz", {t.x(), t.y(), t.z()}},
                              {"qx_qy_qz_qw", {q.x(), q.y(), q.z(), q.w()}}});
  }
  return json;
}

void WriteEstimation(const std::filesystem::path& folder, const PosedBundle& posed) {
  std::vector<StampedPose> poses;
  for (const Keyframe& keyframe : posed.bundle.keyframes) {
    poses.push_back({keyframe.frame.timestamp_s, posed.poses.At(keyframe.id).T_world_cam()});
  }
  WriteTrajectory(folder / "poses.txt", poses);
  WriteColmapModel(folder / "sparse", WithCamera(posed.estimation->model, posed.calibration));
}

}  // namespace mono3d::tools
