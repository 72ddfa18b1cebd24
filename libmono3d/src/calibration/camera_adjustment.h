// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <span>
#include <vector>

#include "calibration/camera_parameters.h"
#include "calibration/camera_problem.h"
#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/camera_prior.h"
#include "mono3d/image/sparse_model.h"

namespace mono3d::calibration {

struct CameraAdjustment {
  CameraModel camera;
  // Posterior, of the parameters. Zero rows for those that are fixed; those that the images do not
  // determine have their prior variance.
  ParameterMatrix covariance = ParameterMatrix::Zero();
  ParameterFlags is_determined = ParameterFlags::Constant(false);  // by the images
  double sigma_px = 0;  // robust standard deviation of an observed coordinate
  std::size_t num_images = 0;
  std::size_t num_points = 0;
  std::size_t num_observations = 0;  // 0: nothing was adjusted
  std::size_t num_positions = 0;     // of its images, that had a say
  IntrinsicsVariation variation;
  std::vector<CalibrationResidual> residuals;
};

// Bundle adjustment of the poses and points of `maps` and of their one camera, which starts at
// `start` and is drawn to `prior`. The pixels of the maps are those of the images as taken. A
// parameter whose posterior sigma is not below half of its prior's stays where the prior has it,
// and so does a distortion that differs from the prior's by no more than chance. With fewer than
// three images or fifty points of three observations nothing is adjusted. Of more than `max_points`
// points those that most images show. Positions have their weight too, Cauchy's loss keeps those
// that are far off from counting: they tell what the images alone do not, as a block of photographs
// from one height that is bent by its lens.
//
// The covariance is the clustered sandwich estimate (Cameron, Gelbach, Miller 2011), over points
// and over stretches of the footage: the errors of one point in neighbouring images are not
// independent, nor are those of neighbouring images, so that the inverse of the information would
// be too small.
CameraAdjustment AdjustCamera(const CameraPrior& prior, const CameraModel& start,
                              const CalibrationMaps& maps);

// The same; where the distortion that fits best is no lens's, as it folds back within the image,
// with k1 alone, and where that folds too with the distortion of `prior`.
CameraAdjustment AdjustToLens(CameraPrior prior, const CameraModel& start,
                              const CalibrationMaps& maps);

// The same of photos that several cameras took, which SparseImage::camera names, all in one
// adjustment. Their shutters stay as the priors have them: how photos moved is not known. Of a
// camera with fewer than three photos only the focal length, the principal point and k1 are
// adjusted: too little tells the rest from what the model leaves out. The adjustment of a camera
// that took none of the photos has no observations.
std::vector<CameraAdjustment> AdjustCameras(std::vector<CameraPrior> priors,
                                            std::span<const CameraModel> starts,
                                            const CalibrationMaps& maps);

// The standard deviation in px of where the camera shows a ray, at its largest over the image.
double LargestUncertainty_px(const CameraModel& camera, const ParameterMatrix& covariance);

// Do the images contradict a calibration? By more than what they know and what good calibrations
// are off by: a share of the focal length (told.focal_sigma) and 0.3 px in 1,000 anywhere. Compares
// the focal length, at 99 %, and where nine rays show, at 99.9 %: coefficients that differ but mean
// the same lens do not count.
bool Contradicts(const CameraAdjustment& adjustment, const CameraPrior& told);

}  // namespace mono3d::calibration
