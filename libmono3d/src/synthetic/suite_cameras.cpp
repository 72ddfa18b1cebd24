// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/suite_cameras.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

#include "synthetic/draws.h"
#include "synthetic/numbers.h"
#include "synthetic/suite_features.h"

namespace mono3d::synthetic {
namespace {

constexpr int kWidth_px = 576;
constexpr int kHeight_px = 324;
constexpr double kRate_per_s = 10;

// How the camera flies, six times each. Orbits and slanting views of relief determine a lens; nadir
// strips, flights ahead and climbs leave some of it open.
struct FlightPlan {
  const char* name;
  const char* kind;
  double min_pitch_deg;
  double max_pitch_deg;
};
constexpr std::array<FlightPlan, 8> kFlightPlans = {{{"orbit", "orbit", 35, 45},
                                                     {"steep-orbit", "orbit", 48, 60},
                                                     {"lawnmower", "lawnmower", 50, 65},
                                                     {"nadir", "lawnmower", 90, 90},
                                                     {"cruise", "cruise", 35, 55},
                                                     {"lateral", "lateral", 35, 55},
                                                     {"take-off", "take_off", 40, 55},
                                                     {"stop-and-turn", "stop_and_turn", 40, 55}}};
constexpr std::array<double, 4> kReadouts_s = {0, 0.010, 0.020, 0.033};
constexpr std::array<const char*, 4> kExposures = {"constant", "drift", "steps", "lowlight"};
constexpr std::size_t kNumCases = 48;

// One value in each of `kNumCases` slices of a range, in an order of chance.
std::vector<double> DrawSlices(double low, double high, RandomNumbers& random) {
  std::vector<double> values;
  for (std::size_t i = 0; i < kNumCases; ++i) {
    const double part = (static_cast<double>(i) + random.Uniform(0, 1)) / kNumCases;
    values.push_back(low + (high - low) * part);
  }
  Shuffle(values, random);
  return values;
}

// Shutters and exposures, each pair equally often, in an order of chance.
struct Film {
  double readout_s;
  std::string exposure;
};
std::vector<Film> DrawFilms(RandomNumbers& random) {
  std::vector<Film> films;
  for (std::size_t i = 0; i < kNumCases; ++i) {
    films.push_back({kReadouts_s[i % kReadouts_s.size()],
                     kExposures[i / kReadouts_s.size() % kExposures.size()]});
  }
  Shuffle(films, random);
  return films;
}

// Lenses from wide to long, barrel and cushion.
struct Lenses {
  explicit Lenses(RandomNumbers& random)
      : focal_per_width(DrawSlices(0.55, 1.3, random)),
        k1(DrawSlices(-0.3, 0.1, random)),
        offset_x(DrawSlices(-0.02, 0.02, random)),
        offset_y(DrawSlices(-0.02, 0.02, random)) {}

  SequenceCameraOptions Lens(std::size_t i, RandomNumbers& random) const {
    SequenceCameraOptions camera;
    camera.width = kWidth_px;
    camera.height = kHeight_px;
    camera.focal_px = focal_per_width[i] * kWidth_px;
    camera.offset_x_px = offset_x[i] * kWidth_px;
    camera.offset_y_px = offset_y[i] * kHeight_px;
    camera.k1 = k1[i];
    // Above 0.45 k1^2 the distortion grows with the radius, however large that is.
    camera.k2 = random.Uniform(0.6, 1.2) * k1[i] * k1[i];
    camera.p1 = random.Uniform(-0.0005, 0.0005);
    camera.p2 = random.Uniform(-0.0005, 0.0005);
    return camera;
  }

  std::vector<double> focal_per_width;
  std::vector<double> k1;
  std::vector<double> offset_x;  // of the width
  std::vector<double> offset_y;  // of the height
};

// About a hundredth of the depth from image to image; the sway and the shake of a small drone.
FlightOptions DrawFlight(const FlightPlan& plan, RandomNumbers& random) {
  FlightOptions flight;
  flight.kind = plan.kind;
  flight.height_m = random.Uniform(40, 75);
  flight.speed_m_per_s = 0.1 * flight.height_m * random.Uniform(0.9, 1.4);
  flight.pitch_deg = random.Uniform(plan.min_pitch_deg, plan.max_pitch_deg);
  flight.radius_m = flight.height_m / std::tan(Radians(std::min(flight.pitch_deg, 80.0)));
  flight.start_deg = random.Uniform(0, 360);
  flight.heading_deg = random.Uniform(0, 360);
  flight.duration_s = random.Uniform(12, 14.5);
  flight.ramp_s = 1;
  flight.row_length_m = 0.5 * flight.height_m;
  flight.row_spacing_m = 0.4 * flight.height_m;  // two rows and the turn between them
  flight.turn_deg_per_s = 20;
  if (flight.kind == "take_off") {
    flight.take_off_height_m = 0.3 * flight.height_m;
    flight.speed_m_per_s = 0.7 * flight.height_m / (flight.duration_s - flight.ramp_s);
  }
  flight.unsteadiness.lowest_hz = 0.1;
  flight.unsteadiness.highest_hz = 2;
  flight.unsteadiness.position_m = random.Uniform(0.02, 0.2);
  flight.unsteadiness.rotation_deg = random.Uniform(0.1, 0.4);
  return flight;
}

// Which way a rolling shutter is read: mostly down.
std::string DrawDirection(RandomNumbers& random) {
  const double draw = random.Uniform(0, 1);
  return draw < 0.55 ? "down" : draw < 0.7 ? "up" : draw < 0.85 ? "right" : "left";
}

// The sensor of a phone or of a small drone: 6,000 electrons and more fill a pixel.
SensorOptions DrawSensor(const Film& film, RandomNumbers& random) {
  SensorOptions sensor;
  sensor.readout_s = film.readout_s;
  sensor.readout_direction = DrawDirection(random);
  const bool is_dark = film.exposure == "lowlight";
  sensor.exposure_s = is_dark ? random.Uniform(0.008, 0.016) : random.Uniform(0.0005, 0.004);
  sensor.full_well_electrons = random.Uniform(6000, 15000);
  sensor.gain = is_dark ? random.Uniform(16, 64) : random.Uniform(1, 3);
  sensor.read_noise_electrons = random.Uniform(1.5, 4);
  if (random.Chance(0.5)) sensor.denoise = random.Uniform(0.3, 0.8);
  if (film.exposure == "drift") sensor.exposure_drift_stops = random.Uniform(0.2, 0.4);
  if (film.exposure == "steps") {
    sensor.exposure_step = random.Uniform(0.2, 0.4);
    sensor.exposure_step_interval_s = 3;
  }
  if (random.Chance(0.6)) sensor.vignetting = random.Uniform(0.1, 0.4);
  sensor.tone_curve = random.Chance(0.5) ? "s_curve" : "srgb";
  sensor.tone_contrast = random.Uniform(0.2, 0.7);
  return sensor;
}

// Lines run along the longer side of a sensor: one that is read by columns is turned, and films
// images higher than wide.
void TurnImagesWithSensor(SequenceOptions& options) {
  const std::string& direction = options.render.sensor.readout_direction;
  if (options.render.sensor.readout_s == 0 || (direction != "right" && direction != "left")) return;
  SequenceCameraOptions& camera = options.camera;
  std::swap(camera.width, camera.height);
  std::swap(camera.offset_x_px, camera.offset_y_px);
}

// Two of three compress. A pixel has 0.25 to 0.8 bits: drones spend 0.2 to 0.6 at 30 images a
// second, and those differ less from one to the next.
VideoOptions DrawVideo(RandomNumbers& random) {
  VideoOptions video;
  if (random.Chance(0.66)) video.codec = "h264";
  video.bit_rate_mbit_per_s =
      1e-6 * kWidth_px * kHeight_px * kRate_per_s * random.Uniform(0.25, 0.8);
  video.b_frames = random.Chance(0.5) ? 2 : 0;
  return video;
}

std::string NameOfCase(std::size_t number, const SequenceOptions& options, const FlightPlan& plan,
                       const Film& film) {
  return (number < 10 ? "cameras_0" : "cameras_") + std::to_string(number) + "_" +
         options.scene.kind + "_" + plan.name + "_" +
         std::to_string(std::lround(1e3 * film.readout_s)) + "ms_" + film.exposure;
}

}  // namespace

std::vector<SuiteSequence> BuildCameras(int seed) {
  RandomNumbers random(static_cast<std::uint64_t>(seed));
  const std::vector<Film> films = DrawFilms(random);
  const Lenses lenses(random);
  std::vector<SuiteSequence> suite;
  for (std::size_t i = 0; i < kNumCases; ++i) {
    const FlightPlan& plan = kFlightPlans[i % kFlightPlans.size()];
    SequenceOptions options;
    options.frames_per_s = kRate_per_s;
    options.depth_stride = 10;
    options.cloud_voxel = 0.006;
    options.flight = DrawFlight(plan, random);
    options.camera = lenses.Lens(i, random);
    options.render.sensor = DrawSensor(films[i], random);
    TurnImagesWithSensor(options);
    SetSeeds(options, 1000 * seed + static_cast<int>(i) + 1);
    // Each time that a flight comes round again, over the next scene; both orbits differ.
    ChooseScene(options, "plain", i / kFlightPlans.size() + 3 * (i % kFlightPlans.size()));
    suite.push_back({.name = NameOfCase(i + 1, options, plan, films[i]),
                     .options = options,
                     .video = DrawVideo(random),
                     .uncalibrated = true});
  }
  return suite;
}

}  // namespace mono3d::synthetic
