// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <opencv2/core/mat.hpp>
#include <vector>

#include "mono3d/geometry/pose.h"
#include "mono3d/image/frame.h"
#include "synthetic/frame_flights.h"
#include "synthetic/render.h"
#include "synthetic/village.h"

namespace mono3d::synthetic {

// Frames with their truth, for the tests of other rooms.
struct RenderedSequence {
  std::vector<Frame> frames;
  std::vector<Pose> T_world_cam;
  std::vector<cv::Mat> depth;  // CV_32FC1, metres, 0 = none
};

inline RenderedSequence RenderSequence(const Scene& scene, const CameraModel& camera,
                                       const std::vector<Pose>& flight) {
  RenderedSequence sequence;
  sequence.T_world_cam = flight;
  for (std::size_t i = 0; i < flight.size(); ++i) {
    const Rendering rendering = Render(scene, camera, flight[i]);
    Frame frame;
    frame.index = static_cast<std::int64_t>(i);
    frame.timestamp_s = static_cast<double>(i) / 30;
    frame.name = "rendered#" + std::to_string(i);
    frame.bgr = rendering.bgr;
    frame.camera = camera;
    sequence.frames.push_back(frame);
    sequence.depth.push_back(rendering.depth);
  }
  return sequence;
}

// 20 frames of an orbit over the village at 320x192 (f = 288 px), 0.95 degrees and about 1.4 % of
// the depth a frame. Rendered once per process; do not write into its images.
inline const RenderedSequence& ShortVillageOrbit() {
  static const RenderedSequence sequence = [] {
    OrbitOptions orbit;
    orbit.num_frames = 20;
    orbit.start_deg = 215;
    const CameraModel camera{320, 192, 288, 288, 159.5, 95.5};
    return RenderSequence(BuildVillage(), camera, OrbitFlight(orbit));
  }();
  return sequence;
}

}  // namespace mono3d::synthetic
