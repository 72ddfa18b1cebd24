// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "fusion/tracked_model.h"
#include "mono3d/fusion/surfel_map.h"
#include "mono3d/pipeline/pipeline.h"

namespace mono3d {

// What happens at each frame of a run: the depth map of the keyframe that it is, as the tracker has
// its pose; or none, where `map` has no depth. Before that the tracker moves earlier keyframes.
struct ScriptedFrame {
  TrackedMap map;
  std::vector<KeyframePose> moved;
  bool matches = true;  // else there is no depth, since the images do not match
};

// A run of the chain over a script, with a surfel model of its own kind behind it, written to
// `folder`. Frame i is keyframe i.
struct ScriptedRun {
  Reconstruction reconstruction;
  nlohmann::json json;                          // run.json
  std::vector<KeyframeConstraint> constraints;  // that the tracker was told of
};
ScriptedRun RunScript(const std::vector<ScriptedFrame>& script, const std::filesystem::path& folder,
                      const SurfelMapOptions& options = {});

}  // namespace mono3d
