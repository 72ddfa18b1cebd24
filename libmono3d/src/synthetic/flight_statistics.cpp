// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/flight_statistics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mono3d/core/error.h"
#include "mono3d/core/options.h"
#include "synthetic/noise.h"

namespace mono3d::synthetic {
namespace {

double NormalNumber(RandomNumbers& random) {  // Box and Muller 1958
  const double u = std::max(random.Uniform(0, 1), 1e-12);
  return std::sqrt(-2 * std::log(u)) * std::cos(2 * std::numbers::pi * random.Uniform(0, 1));
}

void AppendTo(std::vector<double>& list, const std::vector<double>& more) {
  list.insert(list.end(), more.begin(), more.end());
}

}  // namespace

std::vector<double> FrameTimes(double duration_s, const FrameClockOptions& options) {
  const double mean = options.frames_per_s;
  RequireOption(std::isfinite(mean) && mean > 0, "frames_per_s", "above 0", mean);
  RequireOption(std::isfinite(options.sigma_per_s) && options.sigma_per_s >= 0, "sigma_per_s",
                "at least 0", options.sigma_per_s);
  RandomNumbers random(static_cast<std::uint64_t>(options.seed));
  std::vector<double> times;
  if (options.sigma_per_s == 0) {  // no sum of steps, so that times are exact
    for (int frame = 0; frame / mean <= duration_s; ++frame) times.push_back(frame / mean);
    return times;
  }
  double t_s = 0;
  while (t_s <= duration_s) {
    times.push_back(t_s);
    const double rate = mean + options.sigma_per_s * NormalNumber(random);
    t_s += 1 / std::clamp(rate, mean / 2, mean * 2);
  }
  return times;
}

Spread Summarise(std::span<const double> values) {
  if (values.empty()) return {};
  Spread spread;
  const auto num = static_cast<double>(values.size());
  for (const double value : values) spread.mean += value / num;
  double variance = 0;
  for (const double value : values) {
    variance += (value - spread.mean) * (value - spread.mean) / num;
  }
  spread.sigma = std::sqrt(variance);
  const auto [min, max] = std::minmax_element(values.begin(), values.end());
  spread.min = *min;
  spread.max = *max;
  return spread;
}

void FlightSamples::Append(const FlightSamples& other) {
  AppendTo(height_m, other.height_m);
  AppendTo(angular_velocity_rad_per_s, other.angular_velocity_rad_per_s);
  AppendTo(speed_m_per_s, other.speed_m_per_s);
  AppendTo(frames_per_s, other.frames_per_s);
}

FlightSamples SampleFlight(std::span<const double> timestamps_s, std::span<const Pose> T_world_cam,
                           double ground_z_m) {
  if (timestamps_s.size() != T_world_cam.size()) {
    throw Error("statistics of a flight need one time for each pose");
  }
  FlightSamples samples;
  for (std::size_t i = 0; i < T_world_cam.size(); ++i) {
    samples.height_m.push_back(T_world_cam[i].translation().z() - ground_z_m);
    if (i == 0) continue;
    const double step_s = timestamps_s[i] - timestamps_s[i - 1];
    if (!(step_s > 0)) throw Error("times of a flight must ascend");
    const Pose T_before_now = T_world_cam[i - 1].Inverse() * T_world_cam[i];
    samples.angular_velocity_rad_per_s.push_back(T_before_now.RotationAngle() / step_s);
    samples.speed_m_per_s.push_back(T_before_now.translation().norm() / step_s);
    samples.frames_per_s.push_back(1 / step_s);
  }
  return samples;
}

FlightStatistics Summarise(const FlightSamples& samples) {
  return {Summarise(samples.height_m), Summarise(samples.angular_velocity_rad_per_s),
          Summarise(samples.speed_m_per_s), Summarise(samples.frames_per_s)};
}

}  // namespace mono3d::synthetic
