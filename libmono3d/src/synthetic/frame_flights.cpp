// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/frame_flights.h"

#include <array>
#include <cmath>
#include <numbers>

#include "mono3d/core/error.h"
#include "synthetic/flight.h"
#include "synthetic/noise.h"
#include "synthetic/numbers.h"

namespace mono3d::synthetic {
namespace {

// One channel of unsteadiness: a few swings of seeded period and phase, standard deviation 1.
class FrameSway {
 public:
  explicit FrameSway(RandomNumbers& random) {
    for (Swing& swing : swings_) {
      swing.radians_per_frame = 2 * std::numbers::pi / random.Uniform(18, 90);
      swing.phase = random.Uniform(0, 2 * std::numbers::pi);
    }
  }

  double At(int frame) const {
    double sum = 0;
    for (const Swing& swing : swings_)
      sum += std::sin(swing.radians_per_frame * frame + swing.phase);
    return sum * std::sqrt(2.0 / static_cast<double>(swings_.size()));
  }

 private:
  struct Swing {
    double radians_per_frame;
    double phase;
  };
  std::array<Swing, 3> swings_{};
};

void MakeUnsteady(std::vector<Pose>& flight, const FrameUnsteadinessOptions& options) {
  RandomNumbers random(static_cast<std::uint64_t>(options.seed));
  std::vector<FrameSway> sways;
  for (int channel = 0; channel < 6; ++channel) sways.emplace_back(random);
  for (std::size_t i = 0; i < flight.size(); ++i) {
    const int frame = static_cast<int>(i);
    const Eigen::Vector3d shift(sways[0].At(frame), sways[1].At(frame), sways[2].At(frame));
    const Eigen::Vector3d turn(sways[3].At(frame), sways[4].At(frame), sways[5].At(frame));
    const Pose T_cam_unsteady(RotationExp(Radians(options.rotation_deg) * turn),
                              options.position_m * shift);
    flight[i] = flight[i] * T_cam_unsteady;
  }
}

void RequireFrames(int num_frames) {
  RequireOption(num_frames >= 1, "num_frames", "at least 1", num_frames);
}

}  // namespace

void FrameUnsteadinessOptions::Visit(OptionVisitor& visit) {
  visit("position_m", position_m, "standard deviation of the position, metres");
  visit("rotation_deg", rotation_deg, "standard deviation of the rotation, degrees");
  visit("seed", seed, "seed of the swings");
}

void FrameUnsteadinessOptions::Validate() const {
  RequireOption(std::isfinite(position_m) && position_m >= 0, "unsteadiness.position_m",
                "at least 0", position_m);
  RequireOption(std::isfinite(rotation_deg) && rotation_deg >= 0, "unsteadiness.rotation_deg",
                "at least 0", rotation_deg);
}

void OrbitOptions::Visit(OptionVisitor& visit) {
  visit("num_frames", num_frames, "frames of the flight");
  visit("radius_m", radius_m, "radius of the circle, metres");
  visit("height_m", height_m, "height above the target, metres");
  visit("start_deg", start_deg, "where on the circle it starts, degrees");
  visit("step_deg", step_deg, "degrees per frame");
  visit.Group("unsteadiness", unsteadiness);
}

void OrbitOptions::Validate() const {
  RequireFrames(num_frames);
  RequireOption(std::isfinite(radius_m) && radius_m > 0, "radius_m", "above 0", radius_m);
  unsteadiness.Validate();
}

std::vector<Pose> OrbitFlight(const OrbitOptions& options) {
  options.Validate();
  std::vector<Pose> flight;
  for (int frame = 0; frame < options.num_frames; ++frame) {
    const double angle = Radians(options.start_deg + frame * options.step_deg);
    const Eigen::Vector3d offset(options.radius_m * std::cos(angle),
                                 options.radius_m * std::sin(angle), options.height_m);
    flight.push_back(LookAt(options.target + offset, options.target));
  }
  MakeUnsteady(flight, options.unsteadiness);
  return flight;
}

void LateralOptions::Visit(OptionVisitor& visit) {
  visit("num_frames", num_frames, "frames of the flight");
  visit("heading_deg", heading_deg, "direction of the flight, degrees");
  visit("step_m", step_m, "metres per frame");
  visit("pitch_deg", pitch_deg, "of the view below the horizon, degrees");
  visit.Group("unsteadiness", unsteadiness);
}

void LateralOptions::Validate() const {
  RequireFrames(num_frames);
  RequireOption(std::abs(pitch_deg) < 90, "pitch_deg", "between -90 and 90", pitch_deg);
  unsteadiness.Validate();
}

std::vector<Pose> LateralFlight(const LateralOptions& options) {
  options.Validate();
  const double heading = Radians(options.heading_deg);
  const double pitch = Radians(options.pitch_deg);
  const Eigen::Vector3d along(std::cos(heading), std::sin(heading), 0);
  const Eigen::Vector3d left(-std::sin(heading), std::cos(heading), 0);
  const Eigen::Vector3d view = std::cos(pitch) * left - std::sin(pitch) * Eigen::Vector3d::UnitZ();
  std::vector<Pose> flight;
  for (int frame = 0; frame < options.num_frames; ++frame) {
    const Eigen::Vector3d eye = options.start + frame * options.step_m * along;
    flight.push_back(LookAt(eye, eye + view));
  }
  MakeUnsteady(flight, options.unsteadiness);
  return flight;
}

}  // namespace mono3d::synthetic
