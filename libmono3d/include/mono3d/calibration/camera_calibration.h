// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "mono3d/core/export.h"
#include "mono3d/core/options.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/camera_prior.h"
#include "mono3d/image/camera_positions.h"
#include "mono3d/image/sparse_model.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/tracking/photo_mapper.h"

namespace MONO3D_EXPORT mono3d {

struct CalibrationOptions {
  // Parts of the footage that are looked at, spread evenly over it, and the frames of each.
  // Different parts show the camera from other directions and under other motions.
  int num_parts = 3;
  int part_frames = 80;
  // Where these do not tell the focal length to 0.1 %, parts of up to so many frames are looked at,
  // as long as all of them are no more than so much of the footage: that bounds what the
  // calibration costs beside a run.
  int max_part_frames = 320;
  double max_share = 0.25;
  // How often they are tracked at most, each time with the camera of the time before. Longer parts
  // come after that, twice at most, and a new beginning from the prior where the focal length is
  // known to no better than 1 %, three times at most.
  int max_rounds = 6;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// An observation, and how far it lies from where the camera shows its point.
struct CalibrationResidual {
  Eigen::Vector2d pixel;     // as observed, in the image with its distortion
  Eigen::Vector2d error_px;  // observed less computed
};

// How a camera differs from image to image, a robust standard deviation; 0: by no more than chance.
// Image stabilisation that moves the section of the sensor's image, and lenses that are stabilised,
// move the principal point; zoom and focus change the focal length.
struct IntrinsicsVariation {
  double principal_point_px = 0;
  double focal_share = 0;  // of the focal length
  // Videos: by how much more the focal length of one stretch of the footage is than that of
  // another, 0.5: by half. A slow zoom is no difference between neighbouring images.
  double focal_drift = 0;
};

// What the images say of their camera.
struct CameraCalibration {
  CameraPrior prior;  // what was known before
  // The camera, and how well it is known. Where the images do not determine a parameter, value and
  // sigma are those of the prior; source and description are the prior's.
  CameraPrior posterior;
  bool is_learned = false;  // the camera differs from the prior's
  // Why it does not: too little was tracked, or the images agree with the prior.
  std::string reason;
  // What the images determine: sigma is below half of the prior's.
  bool determines_focal_length = false;
  bool determines_aspect = false;  // fy / fx
  bool determines_principal_point = false;
  std::array<bool, 5> determines_distortion = {};  // in the order of CameraModel::distortion
  bool determines_readout = false;                 // of the shutter
  // The images contradict the prior: it was wrong and has no more weight.
  bool contradicts_prior = false;
  double change_px = 0;       // LargestDifference_px from the prior's camera
  double uncertainty_px = 0;  // standard deviation of where the camera shows a ray, at its largest
  double sigma_px = 0;        // robust standard deviation of an observed coordinate
  int num_rounds = 0;
  int num_images = 0;  // keyframes of the last round
  int num_points = 0;
  int num_positions = 0;  // of these images, that had a say
  // One camera for all images is exact only without any.
  IntrinsicsVariation variation;
  std::vector<CalibrationResidual> residuals;  // of the last adjustment
};

// Opens the same footage, undistorted by the camera that it is given: `max_frames` frames (0: all)
// from the frame `start` on.
using FootageOpener = std::function<std::unique_ptr<FrameSource>(const CameraModel& camera,
                                                                 int start, int max_frames)>;

// Learns the camera of footage of a static scene: tracks it with the camera known so far, adjusts
// poses, points and camera together, and begins again with the better camera until it changes no
// more than it is known. Footage that cannot be tracked is a reason, not an error; one that
// breaks off with an error is good up to there. Takes about ten seconds of processor time for
// 768x448.
CameraCalibration CalibrateCamera(const CameraPrior& prior, const FootageOpener& open,
                                  const CalibrationOptions& options = {});

// Where the cameras of a map of photographs were measured to be, in its own metric axes; nothing
// where that does not place the map. The images of the map have the index of their frame as id and
// its name. See PositionsToFollow.
using PositionsOfMap = std::function<std::optional<CameraPositions>(const SparseModel& map)>;

// The same of photographs in any order: they are matched once, and placed with the camera known so
// far (CreatePhotoMapper). Takes as long as placing them. `positions` have a say in the adjustment
// of the camera: photographs from one height alone do not tell a wrong lens from ground that is
// bent. Fewer than three, on a line, or without heights they have none.
CameraCalibration CalibrateCameraOfPhotos(const CameraPrior& prior, const FootageOpener& open,
                                          const PhotoMapperOptions& photos = {},
                                          const CalibrationOptions& options = {},
                                          const PositionsOfMap& positions = {});

// Opens photos that several cameras took, undistorted by these into the images of one camera.
using PhotosOpener =
    std::function<std::unique_ptr<FrameSource>(std::span<const CameraModel> cameras)>;

// The same of photos of several cameras, or of one with several zooms: poses, points and all
// cameras are adjusted together. `camera_of_frame` tells which camera took the photo with an index.
// A prior without a standard deviation of its focal length is held as it is. What is found is at
// the sizes of the priors. Shutters stay as they are told.
std::vector<CameraCalibration> CalibrateCamerasOfPhotos(
    std::span<const CameraPrior> priors,
    const std::function<std::size_t(std::int64_t)>& camera_of_frame, const PhotosOpener& open,
    const PhotoMapperOptions& photos = {}, const CalibrationOptions& options = {},
    const PositionsOfMap& positions = {});

// The largest distance in px, over the image, between where two cameras of one size show the same
// ray: how wrong the one is if the other is right.
double LargestDifference_px(const CameraModel& a, const CameraModel& b);

}  // namespace mono3d
