// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <string>
#include <vector>

#include "mono3d/core/options.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/pose.h"
#include "synthetic/control_points.h"
#include "synthetic/flight.h"
#include "synthetic/flight_statistics.h"
#include "synthetic/gps.h"
#include "synthetic/render.h"
#include "synthetic/scene.h"
#include "synthetic/scene_builder.h"

namespace mono3d::synthetic {

struct SequenceCameraOptions {
  int width = 768;               // px
  int height = 448;              // px
  std::string lens = "pinhole";  // or "fisheye"
  // 0: nine tenths of the width, a field of view of 58 degrees across; of a fisheye lens four
  // tenths, 143 degrees.
  double focal_px = 0;
  double offset_x_px = 0;  // of the principal point from the middle of the image
  double offset_y_px = 0;
  double k1 = 0;  // distortion as OpenCV has it; p1 and p2 not of a fisheye lens, k4 of it alone
  double k2 = 0;
  double p1 = 0;
  double p2 = 0;
  double k3 = 0;
  double k4 = 0;

  CameraModel Model() const;
  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// A scene, a flight over it and the camera that films it.
struct SequenceOptions {
  double frames_per_s = 30;
  double frames_sigma_per_s = 0;  // how unsteady the frame rate is
  int max_frames = 0;             // so many from the middle of the flight; 0: all
  int depth_stride = 5;           // true depth for every so many-th image
  double cloud_voxel = 0.004;  // edge of the cells of the true cloud, as a share of the mean depth
  double cloud_max_depth_m = 300;  // beyond it the true cloud ends, as in the paper
  int seed = 1;                    // of the frame clock and of the GPS
  SceneOptions scene;
  FlightOptions flight;
  SequenceCameraOptions camera;
  RenderOptions render;  // its with_depth is not used
  GpsOptions gps;

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError
};

// Takes one seed for everything that has one.
void SetSeeds(SequenceOptions& options, int seed);

// When the frames are taken and where the camera is then, in whole microseconds.
struct FrameTrack {
  std::vector<double> timestamps_s;  // since the start of the flight, ascending
  std::vector<Pose> T_world_cam;
};
FrameTrack TrackFrames(const SequenceOptions& options, const Flight& flight);

// The same over flat ground at height 0: quick, for planning.
FrameTrack PlanFrames(const SequenceOptions& options);

// What the camera will see, from a few rays of each image with depth. Moving objects are left out.
struct SequenceSurvey {
  double nearest_m = 0;  // z-depth
  double farthest_m = 0;
  double mean_depth_m = 0;
  double ground_z_m = 0;  // 5 % quantile of the heights of what is seen
};

// A sequence ready to be filmed: every frame can be made alone, in any order.
class Sequence {
 public:
  // Builds the scene. Throws UsageError on bad options.
  explicit Sequence(const SequenceOptions& options);
  Sequence(const Sequence&) = delete;
  Sequence& operator=(const Sequence&) = delete;

  const SequenceOptions& options() const { return options_; }
  const CameraModel& camera() const { return camera_; }
  const CameraModel& depth_camera() const { return depth_camera_; }  // true depth is in its pixels
  const FrameTrack& track() const { return track_; }
  int num_frames() const { return static_cast<int>(track_.timestamps_s.size()); }
  bool HasDepth(int frame) const { return frame % options_.depth_stride == 0; }

  // Throws Error when the camera never sees a surface.
  SequenceSurvey Survey() const;
  Rendering RenderFrame(int frame);
  // Points on the ground and where the images show them.
  std::vector<TrueControlPoint> ControlPoints(int count) const;
  // The scene as it is in the middle of the frame's exposure.
  const Scene& SceneAt(int frame);

 private:
  SequenceOptions options_;
  CameraModel camera_;
  CameraModel depth_camera_;
  Scene scene_;
  Flight flight_;
  FrameTrack track_;
};

}  // namespace mono3d::synthetic
