// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/position_draw.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <iterator>
#include <numbers>
#include <random>

#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"

namespace mono3d::tools {
namespace {

using Eigen::Vector3d;

// The same numbers wherever the standard library comes from: its engines are laid down, its
// distributions are not.
class Draws {
 public:
  explicit Draws(std::uint64_t seed) : engine_(seed) {}

  double Uniform() {  // [0, 1)
    constexpr double kStep = 0x1p-53;
    return static_cast<double>(engine_() >> 11U) * kStep;
  }
  double Normal() {  // Box and Muller 1958
    const double radius = std::sqrt(-2 * std::log(1 - Uniform()));
    return radius * std::cos(2 * std::numbers::pi * Uniform());
  }
  Vector3d Normals() {
    const double x = Normal();
    const double y = Normal();
    return {x, y, Normal()};
  }

 private:
  std::mt19937_64 engine_;
};

// By the two poses beside it; at an end by the one beside it.
Vector3d VelocityAt(std::span<const StampedPose> path, std::size_t i) {
  const StampedPose& before = path[i > 0 ? i - 1 : i];
  const StampedPose& after = path[std::min(path.size() - 1, i + 1)];
  return (after.T_world_cam.translation() - before.T_world_cam.translation()) /
         (after.timestamp_s - before.timestamp_s);
}

}  // namespace

ReceiverKind ReceiverKindOf(const std::string& name) {
  if (name == "wander") return {"1 Hz, 3 m, wandering over 60 s", 1, {3, 60, 0}, false};
  if (name == "white") return {"5 Hz, 1 m, white", 5, {0, 0, 1}, false};
  if (name == "rtk") return {"5 Hz, 3 cm, white, stated (RTK)", 5, {0, 0, 0.03}, true};
  throw UsageError(ErrorParts{.what = "unknown kind of positions",
                              .where = "--kinds",
                              .expected = "wander, white, rtk",
                              .found = name});
}

PathPoint PathAt(std::span<const StampedPose> path, double time_s) {
  const auto found = std::ranges::lower_bound(path, time_s, {}, &StampedPose::timestamp_s);
  const auto after = static_cast<std::size_t>(
      std::clamp<std::ptrdiff_t>(found - path.begin(), 1, std::ssize(path) - 1));
  const StampedPose& a = path[after - 1];
  const StampedPose& b = path[after];
  const double step_s = b.timestamp_s - a.timestamp_s;
  const double u = std::clamp((time_s - a.timestamp_s) / step_s, 0.0, 1.0);
  const Vector3d& p_a = a.T_world_cam.translation();
  const Vector3d& p_b = b.T_world_cam.translation();
  const Vector3d v_a = step_s * VelocityAt(path, after - 1);
  const Vector3d v_b = step_s * VelocityAt(path, after);
  const Vector3d c2 = 3 * (p_b - p_a) - 2 * v_a - v_b;  // Hermite
  const Vector3d c3 = 2 * (p_a - p_b) + v_a + v_b;
  return {p_a + u * (v_a + u * (c2 + u * c3)), (v_a + u * (2 * c2 + 3 * u * c3)) / step_s};
}

DrawnPositions DrawPositions(std::span<const StampedPose> truth, const Geodetic& origin,
                             const ReceiverKind& kind, const PositionDrawOptions& options,
                             std::uint64_t seed) {
  Draws draws(seed);
  DrawnPositions drawn;
  drawn.clock_offset_s = options.max_clock_offset_s * (2 * draws.Uniform() - 1);
  drawn.track.form = kind.name;
  const double step_s = 1 / kind.rate_hz;
  const double first_s = truth.front().timestamp_s + step_s * draws.Uniform();
  const PositionNoise& noise = kind.noise;
  const double kept = noise.correlation_s > 0 ? std::exp(-step_s / noise.correlation_s) : 0;
  Vector3d wander = draws.Normals();
  for (double time_s = first_s; time_s <= truth.back().timestamp_s; time_s += step_s) {
    Vector3d error_m = noise.wander_m * wander + noise.white_m * draws.Normals();
    wander = kept * wander + std::sqrt(1 - kept * kept) * draws.Normals();
    const bool is_outlier = draws.Uniform() < options.outlier_share;
    if (is_outlier) error_m += options.outlier_m * draws.Normals();
    const Geodetic place = ToGeodetic(PathAt(truth, time_s).p_m + error_m, origin);
    PositionFix fix;
    fix.time_s = time_s - drawn.clock_offset_s;
    fix.latitude_deg = place.latitude_deg;
    fix.longitude_deg = place.longitude_deg;
    fix.altitude_m = place.altitude_m;
    if (kind.is_stated) fix.sigma_horizontal_m = fix.sigma_vertical_m = noise.white_m;
    drawn.track.fixes.push_back(fix);
    drawn.true_times_s.push_back(time_s);
    drawn.is_outlier.push_back(is_outlier ? 1 : 0);
    drawn.errors_m.push_back(error_m);
  }
  drawn.track.num_entries = drawn.track.fixes.size();
  return drawn;
}

void WritePositionTable(const std::filesystem::path& path, const PositionTrack& track) {
  std::string text = "time,latitude,longitude,altitude,sigma_horizontal,sigma_vertical\n";
  for (const PositionFix& fix : track.fixes) {
    char line[160];
    std::snprintf(line, sizeof(line), "%.6f,%.10f,%.10f,%.4f,%.4g,%.4g\n", fix.time_s,
                  fix.latitude_deg, fix.longitude_deg, fix.altitude_m.value_or(0),
                  fix.sigma_horizontal_m, fix.sigma_vertical_m);
    text += line;
  }
  WriteFileAtomically(path, text);
}

}  // namespace mono3d::tools
