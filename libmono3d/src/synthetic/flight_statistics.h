// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <span>
#include <vector>

#include "mono3d/geometry/pose.h"

namespace mono3d::synthetic {

// Times of frames from 0 to the end, seconds, of a camera that does not keep time exactly: the rate
// of each frame, 1 over the time since the last, is drawn anew around the mean, from half to twice
// of it.
struct FrameClockOptions {
  double frames_per_s = 30;
  double sigma_per_s = 0;  // standard deviation of the rate
  int seed = 1;
};
std::vector<double> FrameTimes(double duration_s, const FrameClockOptions& options);

// Mean, standard deviation and range of a quantity. All 0 when there are no values.
struct Spread {
  double mean = 0;
  double sigma = 0;
  double min = 0;
  double max = 0;
};
Spread Summarise(std::span<const double> values);

// What the paper tells of its flights (Table 1), one value a frame or a step between two frames;
// lists of several flights may be joined and then summarised.
struct FlightSamples {
  std::vector<double> height_m;                    // camera z over `ground_z_m`, per frame
  std::vector<double> angular_velocity_rad_per_s;  // per step
  std::vector<double> speed_m_per_s;               // per step
  std::vector<double> frames_per_s;                // per step

  void Append(const FlightSamples& other);
};

// `ground_z_m`: where the paper's heights begin, the 5 % quantile of the z of the true cloud.
// Throws Error unless there is one time for each pose and the times ascend.
FlightSamples SampleFlight(std::span<const double> timestamps_s, std::span<const Pose> T_world_cam,
                           double ground_z_m);

struct FlightStatistics {
  Spread height_m;
  Spread angular_velocity_rad_per_s;
  Spread speed_m_per_s;
  Spread frames_per_s;
};
FlightStatistics Summarise(const FlightSamples& samples);

}  // namespace mono3d::synthetic
