// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "synthetic/suite_features.h"

#include <array>
#include <cmath>

#include "mono3d/core/error.h"
#include "synthetic/draws.h"

namespace mono3d::synthetic {
namespace {

constexpr std::array<const char*, 8> kFeatures = {"plain", "haze",  "lowsun", "overcast",
                                                  "water", "wires", "glass",  "cars"};
constexpr std::array<const char*, 6> kOrbitScenes = {"mansion", "town",      "church",
                                                     "village", "warehouse", "hills"};
constexpr std::array<const char*, 4> kStraightScenes = {"town", "village", "fields", "hills"};

}  // namespace

std::vector<std::string> DrawFeatures(std::size_t count, RandomNumbers& random) {
  std::vector<std::string> features;
  for (std::size_t i = 0; i < count; ++i) features.emplace_back(kFeatures[i % kFeatures.size()]);
  Shuffle(features, random);
  return features;
}

void AddFeature(SequenceOptions& options, const std::string& feature) {
  SceneOptions& scene = options.scene;
  if (feature == "plain") {
    return;
  } else if (feature == "haze") {
    scene.light.visibility_m = 12 * options.flight.height_m;
  } else if (feature == "lowsun") {
    scene.light.sun_elevation_deg = 14;
  } else if (feature == "overcast") {
    scene.light.overcast = 0.9;
  } else if (feature == "water") {
    scene.with_water = true;
  } else if (feature == "wires") {
    scene.with_wires = true;
  } else if (feature == "glass") {
    scene.with_glass = true;
  } else if (feature == "cars") {
    scene.num_moving_cars = 12;
  } else {
    throw Error("no such feature of a suite: " + feature);
  }
}

void ChooseScene(SequenceOptions& options, const std::string& feature, std::size_t index) {
  SceneOptions& scene = options.scene;
  scene.kind = options.flight.kind == "orbit" ? kOrbitScenes[index % kOrbitScenes.size()]
                                              : kStraightScenes[index % kStraightScenes.size()];
  // Cars need streets.
  if (feature == "cars" && scene.kind != "village") scene.kind = "town";
  RandomNumbers random(static_cast<std::uint64_t>(scene.seed));
  scene.light.sun_azimuth_deg = random.Uniform(0, 360);
  scene.light.sun_elevation_deg = random.Uniform(25, 65);
  if (random.Chance(0.3)) scene.light.overcast = random.Uniform(0, 0.6);
  AddFeature(options, feature);
}

int SpoilCamera(SequenceOptions& options, RandomNumbers& random) {
  SensorOptions& sensor = options.render.sensor;
  sensor.shot_noise = random.Uniform(0.002, 0.012);
  sensor.read_noise = random.Uniform(0.0005, 0.003);
  if (random.Chance(0.4)) sensor.exposure_drift_stops = random.Uniform(0.05, 0.25);
  if (random.Chance(0.4)) sensor.vignetting = random.Uniform(0.05, 0.3);
  if (random.Chance(0.25)) sensor.readout_s = random.Uniform(0.01, 0.03);
  if (random.Chance(0.25)) sensor.exposure_s = random.Uniform(0.002, 0.02);
  if (random.Chance(0.3)) {
    options.camera.k1 = random.Uniform(-0.12, 0.04);
    options.camera.k2 = random.Uniform(0, 0.02);
    options.camera.p1 = random.Uniform(-0.0005, 0.0005);
    options.camera.p2 = random.Uniform(-0.0005, 0.0005);
  }
  return random.Chance(0.6) ? static_cast<int>(random.Uniform(80, 97)) : 0;
}

}  // namespace mono3d::synthetic
