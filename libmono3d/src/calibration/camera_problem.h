// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "calibration/camera_parameters.h"
#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/geometry/rolling_shutter.h"
#include "mono3d/image/camera_positions.h"
#include "mono3d/image/sparse_model.h"
#include "tracking/optimisation/centre_error.h"

namespace mono3d::calibration {

class FlowCost;
class ReprojectionCost;

// Of all maps, those that most images show. The time grows with their number.
inline constexpr std::size_t kMaxPoints = 3000;

// What a camera is learned from.
struct CalibrationMaps {
  std::span<const SparseModel> maps;  // with the pixels of the images as taken
  // Where the cameras of a map were measured to be: map_id is its position in `maps`, the images'
  // ids are the frames. Maps that are not named here have none.
  std::span<const CameraPositions> positions = {};
  std::size_t max_points = kMaxPoints;
};

// A bundle adjustment of one or more maps with free cameras, mostly one: what it varies, its
// residuals and its gauge. Each map's world is the frame of its first image; one coordinate of
// another of its images holds its unit of length. A map whose images were measured to be in three
// places that are not on a line has the axes and the unit of these measurements instead, with the
// middle of its images as origin, and they hold it.
class CameraProblem {
 public:
  // Of all maps. Time grows with the square of the images and with the points.
  static constexpr std::size_t kMaxImages = 100;

  // Rotation vector and translation of T_cam_axes, in the axes that the map has here.
  using PoseBlock = std::array<double, 6>;
  // Angular and linear.
  using VelocityBlock = std::array<double, 6>;
  // What an adjustment varies.
  struct Unknowns {
    std::vector<PoseBlock> poses;                 // of each image at its middle line
    std::vector<VelocityBlock> velocity_changes;  // from what is known
    std::vector<std::array<double, 3>> points;
    std::vector<ParameterVector> cameras;
  };

  // What is known of the pose of one image: second and first derivatives of its cost.
  using Information = Eigen::Matrix<double, 6, 6>;
  struct Quadratic {
    Information information = Information::Zero();
    Eigen::Matrix<double, 6, 1> gradient = Eigen::Matrix<double, 6, 1>::Zero();
  };

  struct Observation {
    std::size_t image;  // position in Unknowns::poses
    std::size_t point;  // position in Unknowns::points
    // Where the image as taken, its lines read one after the other, shows the point (px). Of a
    // flow: how fast the point moves there at the middle line, by the velocity that the map has
    // for the image (px/s). Flows hold velocities that are free.
    Eigen::Vector2d measured;
    bool is_flow = false;
  };
  // The derivatives of one observation's residual (in sigmas, corrected for the robust loss).
  struct Linearised {
    Eigen::Vector2d residual = Eigen::Vector2d::Zero();
    Eigen::Matrix<double, 2, 6, Eigen::RowMajor> by_pose = decltype(by_pose)::Zero();
    // Zero where that is not varied.
    Eigen::Matrix<double, 2, 6, Eigen::RowMajor> by_velocity = decltype(by_velocity)::Zero();
    Eigen::Matrix<double, 2, kNumParameters, Eigen::RowMajor> by_camera =
        decltype(by_camera)::Zero();
    Eigen::Matrix<double, 2, 3, Eigen::RowMajor> by_point = decltype(by_point)::Zero();
    double weight = 0;  // of the robust loss, in all of them; 0 where the residual is not used

    Linearised& operator*=(double factor);
  };

  // One coordinate of an image's pose that is not varied.
  struct HeldCoordinate {
    std::size_t image;
    int coordinate;
  };

  // Maps without two images or without points are left out. Of more than kMaxImages images each map
  // gives its first ones of each camera, of more than `max_points` points those that most images
  // show. The camera starts at `start`.
  CameraProblem(const CalibrationMaps& maps, const CameraModel& start, const CameraPrior& prior);
  // Of several cameras, which SparseImage::camera names.
  CameraProblem(const CalibrationMaps& maps, std::span<const CameraModel> starts,
                std::span<const CameraPrior> priors);

  // Weights from the residuals: to be called before each adjustment.
  void Weigh();
  const Unknowns& unknowns() const { return unknowns_; }
  void set_unknowns(const Unknowns& unknowns) { unknowns_ = unknowns; }
  // Half of the sum of the squares, of robust losses.
  struct CostSum {
    double sum = 0;
    std::size_t num_behind = 0;  // observations of points behind their image, which are not in it
  };
  CostSum Cost() const;
  void FixAtPrior(const ParameterFlags& which, std::size_t camera = 0);
  // About the prior, to this standard deviation.
  void Free(Parameter which, double prior_sigma, std::size_t camera = 0);
  // Of two readout times, the one that says less is held at the prior. Returns the other one.
  Parameter HoldLesserReadout(std::size_t camera = 0);
  CameraModel camera(std::size_t i = 0) const {
    return WithParameters(cameras_[i].shape, unknowns_.cameras[i]);
  }

  Linearised Linearise(const Observation& observation) const;
  // In sigmas, whatever the robust loss; nothing where the point is behind the image. Zero of a
  // flow where the velocity is not varied.
  std::optional<Eigen::Vector2d> Residual(const Observation& observation) const;
  // Of the pixels that lie in front of their image; of all cameras, or of one.
  std::vector<CalibrationResidual> Residuals(std::optional<std::size_t> camera = {}) const;
  // Sorted by point, those of a point by image, pixels before flows.
  const std::vector<Observation>& observations() const { return observations_; }
  std::size_t num_images() const { return unknowns_.poses.size(); }
  std::size_t num_points() const { return unknowns_.points.size(); }
  double sigma_px() const { return sigma_px_; }
  std::size_t num_cameras() const { return cameras_.size(); }
  std::size_t camera_of(const Observation& observation) const {
    return camera_of_image_[observation.image];
  }
  // That a camera took; of the observations, pixels.
  std::size_t NumImagesOf(std::size_t camera) const;
  std::size_t NumObservationsOf(std::size_t camera) const;
  std::size_t NumPositionsOf(std::size_t camera) const;
  const ParameterFlags& is_fixed(std::size_t camera = 0) const { return cameras_[camera].is_fixed; }
  const ParameterVector& parameters(std::size_t camera = 0) const {
    return unknowns_.cameras[camera];
  }
  const ParameterVector& prior(std::size_t camera = 0) const { return cameras_[camera].prior; }
  const ParameterVector& prior_sigmas(std::size_t camera = 0) const {
    return cameras_[camera].prior_sigmas;
  }
  // One over the variances; 0 where a parameter is fixed.
  ParameterVector prior_information(std::size_t camera) const;
  // Is any image's velocity varied?
  bool HasVelocities() const;
  // What its measured position says of an image's pose; zero where there is none.
  Quadratic KnownPosition(std::size_t image) const;
  // The gauge of the maps: images whose poses are not varied, and single coordinates.
  const std::vector<std::size_t>& held_images() const { return held_images_; }
  const std::vector<HeldCoordinate>& held_coordinates() const { return held_coordinates_; }

 private:
  // Found less observed, in `sigma_px`; false behind the camera.
  ReprojectionCost CostOf(const Observation& observation, double sigma_px) const;
  FlowCost FlowCostOf(const Observation& observation, double sigma) const;
  double FlowSigma(std::size_t image) const;
  // As both costs take them.
  std::array<const double*, 4> ParametersOf(const Observation& observation) const;

  struct MeasuredCentre {
    std::size_t image;
    tracking::CentreError error;
  };

  // Of an image's middle line.
  struct ImageVelocity {
    CameraVelocity known;  // zero where the map has none
    // Standard deviation of a flow; 0 where there are none that tell the velocity.
    double flow_sigma_px_per_s = 0;
  };

  struct FreeCamera {
    FreeCamera(const CameraModel& start, const CameraPrior& camera_prior);

    ParameterVector prior;
    ParameterVector prior_sigmas;
    ParameterFlags is_fixed;
    CameraModel shape;  // the size of the images and the kind of lens
  };

  // The first images of each camera, this share of them.
  std::vector<std::size_t> ChooseImages(const SparseModel& map, double share) const;
  void Add(const SparseModel& map, const std::vector<std::size_t>& images,
           const CameraPositions* positions, std::size_t max_points);
  void AddPoints(const SparseModel& map, const std::vector<std::size_t>& images,
                 const Similarity& S_axes_map, std::size_t first_image, std::size_t max_points);
  // Is that of the image varied? Only where its lines are not all read at once.
  bool HasFreeVelocity(std::size_t image) const;
  void AddFlows(const SparseModel& map, const std::vector<std::size_t>& images,
                std::size_t first_image);
  double VelocityVariance() const;
  // Of the map whose images begin at `first_image`.
  void ChooseGauge(std::size_t first_image);

  std::vector<FreeCamera> cameras_;
  std::vector<std::size_t> camera_of_image_;
  std::vector<ImageVelocity> velocities_;  // of each image
  Unknowns unknowns_;
  std::vector<Observation> observations_;
  std::vector<std::size_t> held_images_;
  std::vector<HeldCoordinate> held_coordinates_;
  std::vector<MeasuredCentre> positions_;
  double sigma_px_ = 1;
  double velocity_variance_ = 1;  // of the velocities, over what is said of their flows
};

}  // namespace mono3d::calibration
