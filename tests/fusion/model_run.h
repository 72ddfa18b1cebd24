// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "fusion/tracked_model.h"
#include "mono3d/fusion/surfel_map.h"

namespace mono3d {

// What a run does with its model.
struct Step {
  std::optional<TrackedMap> map;
  std::vector<KeyframePose> moved;  // where there is no map: the tracker's, from now on
};

// The house from an angle; with holes, noise, another exposure of every second image.
TrackedMap DisturbedView(int number, double angle_deg);
// Ground far away from it.
TrackedMap FarView(int number, double x_su);
// Farther off than a registration finds back.
TrackedMap FarAstray(TrackedMap map);

// A flight around the house: depth maps that wait, keyframes that the tracker moves (a loop
// correction), a submap of its own, inferred depth.
std::vector<Step> EventfulFlight();

// A model, what its tracker knows, and what a viewer has seen of it.
struct ModelRun {
  std::unique_ptr<SurfelMap> model;
  std::map<std::int64_t, KeyframePose> poses;
  std::uint64_t version = 0;

  KeyframePoses Snapshot() const;
  FusionResult Integrate(const TrackedMap& map);
  // All that it gives, as bytes: the result, and what has changed for a viewer.
  std::string Do(const Step& step);
  // And at the end: where its depth maps are, and its surfels.
  std::string End() const;
};

ModelRun NewModelRun(const SurfelMapOptions& options = {});

}  // namespace mono3d
