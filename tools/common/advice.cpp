// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/advice.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace mono3d::tools {
namespace {

struct KnownReason {
  std::string_view part;  // of the reason
  std::string_view cause;
  std::string_view remedy;
};

// What the tracker says of each frame for as long as its track is lost.
constexpr std::string_view kTrackLost = "points found again";

// The first one that fits is taken.
constexpr std::array kKnownReasons = {
    KnownReason{"too little parallax: the motion is a rotation",
                "the camera only turned, and did not move sideways",
                "fly sideways or around the scene; depth needs views from places apart"},
    KnownReason{"parallax", "the camera has hardly moved sideways so far",
                "begin with some metres sideways; leave out the time on the ground (--start)"},
    KnownReason{"features,", "the image shows too little structure: sky, water, blur or darkness",
                "point the camera at textured ground, and fly slower or with a shorter exposure"},
    KnownReason{"two motions explain",
                "a flat scene or a short motion can be explained in two ways",
                "go on sideways over ground with some relief"},
    KnownReason{"neither a homography nor a fundamental matrix",
                "the two images agree on no motion of the camera: the scene moves, or the lens is "
                "another one than assumed",
                "check the calibration, and --lens fisheye for a wide lens"},
    KnownReason{"the run ended before photographs were placed",
                "they are placed together, after the last one was read", "run it again"},
    KnownReason{"no other photo shows the same", "it shows nothing that another photograph shows",
                "take photographs that overlap by two thirds with the next ones"},
    KnownReason{"no pose explains what it shares with other photos",
                "it matches other photographs in few places only, or in wrong ones",
                "more overlap; leave out what repeats itself, such as facades from too close"},
    KnownReason{"no third photo", "two photographs match, but no third one does",
                "at least three photographs must show the same"},
    KnownReason{kTrackLost,
                "too little of the scene seen so far was found again: fast motion, blur, something "
                "in the way, or images in the wrong order",
                "take more images a second (a smaller --stride), or a shorter exposure"},
    KnownReason{"matches",
                "this image has too little in common with the one before: fast motion, blur, or "
                "images in the wrong order",
                "take more images a second (a smaller --stride); --photos for photographs"},
    KnownReason{"no baseline", "the images of the bundle were taken from one place",
                "fly sideways; depth needs views from places apart"},
    KnownReason{"baseline is too small",
                "the places of the images are too near to each other for their "
                "distance from the scene",
                "fly farther sideways, or nearer to the scene"},
    KnownReason{"do not overlap", "the images of the bundle show different parts of the scene",
                "take more images a second, or fly slower"},
    KnownReason{"black or saturated", "the image is black or overexposed",
                "hold the exposure, and keep the sun out of the image"},
    KnownReason{"no texture", "the image shows no texture", "point the camera at textured ground"},
    KnownReason{"disagree",
                "the images before and after the middle one do not agree: the scene moves, or "
                "the poses are wrong",
                "check the calibration; water, trees in wind and traffic have no depth"},
    KnownReason{"do not match", "the images show too little texture, or do not show the same",
                "check the order of the images and the calibration"},
    KnownReason{"not registered with the model",
                "the depth map does not fit the model: its pose or its "
                "camera is wrong, or the scene moved",
                "check the calibration (without --camera it is learned), and that nothing large "
                "moves"},
    KnownReason{"nothing in common with map", "tracking was lost and began again somewhere else",
                "fly so that the way back to known ground is seen"},
    KnownReason{"model is full", "the model has reached its largest size", "--fusion.max_surfels"},
    KnownReason{"no estimate", "the depth map is empty: no texture, or images that do not match",
                "check the order of the images and the calibration"},
};

// Of the depth maps of the map: how much of the model they see through, on average.
double MeanContradiction(const MapReconstruction& map) {
  double sum = 0;
  int num_registered = 0;
  for (const FusionRecord& fusion : map.fusions) {
    if (!fusion.registration.registered) continue;
    sum += fusion.registration.contradiction;
    ++num_registered;
  }
  return num_registered > 0 ? sum / num_registered : 0;
}

Advice AdviceOfCamera(const RunRecord& record) {
  const bool is_held = !record.camera.empty() && !record.calibration && record.cameras.empty();
  if (!record.calibration) {
    if (!is_held) return {};
    return {"the calibration was held (--camera-fixed) and may be wrong",
            "run again without --camera-fixed: the images are then asked"};
  }
  const CameraCalibration& calibration = *record.calibration;
  const IntrinsicsVariation& variation = calibration.variation;
  if (variation.principal_point_px > 0 || variation.focal_share > 0 || variation.focal_drift > 0) {
    return {"the camera is not the same in all images (image stabilisation or zoom)",
            "switch electronic stabilisation off, and do not zoom"};
  }
  if (!calibration.is_learned && calibration.prior.source == CameraPriorSource::kDefault) {
    return {"the camera is not known: it is a guess, and the images could not correct it",
            "give a calibration (--camera), or make one by mono3d-calibrate"};
  }
  return {};
}

}  // namespace

Advice AdviceOf(std::string_view reason) {
  const auto known = std::ranges::find_if(kKnownReasons, [&](const KnownReason& one) {
    return reason.find(one.part) != std::string_view::npos;
  });
  if (known == kKnownReasons.end()) return {};
  return {std::string(known->cause), std::string(known->remedy)};
}

bool WasTrackLost(const PipelineCounts& counts) {
  return std::ranges::any_of(counts.untracked_frames, [](const auto& reason) {
    return reason.first.find(kTrackLost) != std::string::npos;
  });
}

std::vector<Advice> AllAdvice() {
  std::vector<Advice> all;
  for (const KnownReason& known : kKnownReasons) {
    all.push_back({std::string(known.cause), std::string(known.remedy)});
  }
  return all;
}

Advice AdviceOfModel(const Reconstruction& reconstruction, const RunRecord& record) {
  if (reconstruction.maps.empty()) return {};
  const MapReconstruction& map = reconstruction.maps[0];
  if (map.health.state == HealthState::kGood) return {};
  if (Advice camera = AdviceOfCamera(record); !camera.cause.empty()) return camera;
  constexpr std::size_t kManyMaps = 3;
  if (reconstruction.maps.size() >= kManyMaps && !record.are_photos && !record.is_sparse_video) {
    return {"tracking began again " + std::to_string(reconstruction.maps.size() - 1) +
                " times: the images may be in the wrong order, or not of one flight",
            "check the names of the images (they are taken in natural order), or say --photos"};
  }
  constexpr double kMuchContradiction = 0.1;
  if (MeanContradiction(map) > kMuchContradiction) {
    return {"the scene seems to move: depth maps see through what others saw",
            "leave out the parts with water, traffic or trees in wind (--start, --max-frames)"};
  }
  constexpr double kMuchDrift = 0.05;
  if (std::abs(map.health.scale_drift) > kMuchDrift) {
    return {"the scale of the trajectory has drifted",
            "fly a loop, or back over ground that was seen before; avoid turning on the spot"};
  }
  if (record.calibration && record.calibration->determines_focal_length) {
    return {
        "the images agree with the camera, so that blur, things that move or a path that drifts "
        "are left",
        "fly slower, with a shorter exposure, and come back over ground that was seen before"};
  }
  return {
      "depth maps and poses do not fit together: a wrong calibration, blur, or a rolling shutter "
      "are the usual causes",
      "run without --camera, so that the camera is learned; fly slower, with a shorter "
      "exposure"};
}

std::string ToText(const Advice& advice) {
  if (advice.remedy.empty()) return advice.cause;
  return advice.cause.empty() ? advice.remedy : advice.cause + "; " + advice.remedy;
}

}  // namespace mono3d::tools
