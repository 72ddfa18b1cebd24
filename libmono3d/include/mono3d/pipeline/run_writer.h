// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/core/timing.h"
#include "mono3d/geometry/triangle_mesh.h"
#include "mono3d/gpu/device.h"
#include "mono3d/image/depth_map.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/live_input.h"
#include "mono3d/pipeline/pipeline.h"

namespace MONO3D_EXPORT mono3d {

// How a run ended.
enum class RunEnd {
  kFinished,    // all input was processed
  kStopped,     // told to stop; the model is that of the input so far
  kFailed,      // an error; the model is that of the input before it
  kUnfinished,  // it goes on, or was killed; the model is that of the input so far
};

// One of the cameras of photos.
struct CameraOfRun {
  std::string name;  // as EXIF tells it; may be empty
  std::int64_t num_photos = 0;
  CameraCalibration calibration;
};

// The camera that the pixels of some files of the run are of.
struct CameraOfFiles {
  std::string files;  // "depth/"
  CameraModel camera;
};

// What run.json tells beside the counts.
struct RunRecord {
  RunEnd end = RunEnd::kFinished;
  std::string error;  // when failed
  std::string input;
  std::string camera;  // the file; empty: none was given
  std::optional<CameraCalibration>
      calibration;  // what the images said of it, where they were asked
  // Of photos of several cameras, each: in place of `calibration`.
  std::vector<CameraOfRun> cameras;
  std::vector<CameraOfFiles> cameras_of_files;
  bool are_photos = false;       // in any order, and no video
  bool is_sparse_video = false;  // placed together, as photographs are
  DeviceInfo device;
  std::vector<OptionField> options;
  std::vector<StageTime> stages;
  std::int64_t num_skipped_images = 0;
  // With kStrideByMotion: the images that show next to no motion.
  std::optional<std::int64_t> num_passed_over_images;
  // Of a run that was broken off and resumed: the last frame before each time.
  std::vector<std::int64_t> resumed_after;
  std::optional<LiveInputReport> live_input;  // where a camera sent the images
  double wall_s = 0;
  double cpu_s = 0;  // of the process
};

// Writes the files of a run into one folder:
//   depth/NNNNNN.{depth,normal,confidence}.{pfm,png}   one set a depth map, NNNNNN its frame; in
//                                                       the form of DepthFileOptions
//   depth/scale.txt                                     of PNG files of 16 bits
//   depth/camera.yaml                                   their camera
//   trajectory.txt trajectory_online.txt keyframes.txt model_trajectory.txt   TUM, camera to world
//   model.ply                                           the surfels
//   mesh.ply                                            triangles through them, where asked for
//   sparse/{cameras,images,points3D}.{txt,bin}          keyframes and points, COLMAP's forms
//   images/                                             images of the keyframes: PlaceImagesOfRun
//   images_global_shutter/NAME.png                      images of the keyframes, undistorted and of
//                                                       a global shutter, where asked for
//   learned_camera.yaml                                 the camera, where the images told it
//   learned_camera_N.yaml                               of photos of several cameras, camera N
//   run.json                                            version, device, options, counts, times
// These are of the map with most tracked frames; those of further maps N are called
// trajectory_mapN.txt, sparse_mapN and so on. Files are written beside and renamed: none is ever
// half there. Folders that are removed meanwhile are made again.
class RunWriter {
 public:
  // Creates the folder where needed, and clears what an earlier run left under these names. Throws
  // Error when it cannot be written.
  explicit RunWriter(const std::filesystem::path& folder, const DepthFileOptions& depth_files = {});
  // Of a run that goes on: what it has written stays.
  static RunWriter OfRunToResume(const std::filesystem::path& folder,
                                 const DepthFileOptions& depth_files);

  bool writes_depth_maps() const { return depth_files_.form != DepthFileForm::kNone; }
  void WriteDepthMap(const DepthMap& map) const;
  // depth/camera.yaml: the camera that all depth maps are of, free of distortion; and the scale of
  // their values, where they have one. Throws Error where a scale of other images is there.
  void WriteDepthCamera(const CameraModel& camera) const;
  // The image of a keyframe, as the frame is named, with ".png" behind where it is not there.
  void WriteKeyframeImage(const Frame& frame) const;
  // What WriteDepthMap or WriteKeyframeImage wrote of that frame, where it is there.
  void RemoveDepthMap(std::int64_t frame_index) const;
  void RemoveKeyframeImage(const std::string& frame_name) const;
  // In the order of their worth: trajectories, then models. What cannot be written does not keep
  // the rest from being written: it is logged, and the first such Error is thrown at the end.
  void WriteReconstruction(const Reconstruction& reconstruction) const;
  // trajectory.txt, keyframes.txt and, where it has surfels, model.ply of a run that goes on.
  void WriteInterim(const MapReconstruction& map) const;
  // One mesh for each map that has a model.
  void WriteMeshes(const Reconstruction& reconstruction, const MeshOptions& options) const;
  // The sparse models as the input's own images show them, `calibration` being that of the input:
  // COLMAP and OpenMVS can go on from there.
  void WriteSparseModels(const Reconstruction& reconstruction,
                         const CameraModel& calibration) const;
  // The same of several cameras.
  void WriteSparseModels(const Reconstruction& reconstruction,
                         const CamerasOfImages& calibrations) const;
  // The same as images_global_shutter/ shows them, of the keyframes that are there.
  void WriteSparseModelsOfKeyframeImages(const Reconstruction& reconstruction) const;
  void WriteCamera(const CameraModel& learned) const;
  // Of camera `number` of several, from 1 on.
  void WriteCamera(const CameraModel& learned, std::size_t number) const;
  void WriteRecord(const Reconstruction& reconstruction, const RunRecord& record) const;

  std::filesystem::path model_path() const { return folder_ / "model.ply"; }

 private:
  struct Resumed {};
  RunWriter(const std::filesystem::path& folder, const DepthFileOptions& depth_files, Resumed);

  void MakeFolders() const;
  void WriteDepthScale() const;
  std::filesystem::path KeyframeImagePath(const std::string& frame_name) const;
  void WriteSparse(const MapReconstruction& map, bool is_first, const SparseModel& sparse) const;

  std::filesystem::path folder_;
  DepthFileOptions depth_files_;
};

}  // namespace mono3d
