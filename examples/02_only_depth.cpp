// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Five images and their poses to the depth of the middle one, every third image of a sequence:
//   02_only_depth village_orbit 10 -> middle.depth.pfm, middle.depth.png

#include <cstdlib>
#include <exception>
#include <iostream>
#include <string>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/depth/depth_estimator.h"
#include "mono3d/gpu/device.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/trajectory_file.h"

namespace {

// Frames first, first + 3, ... first + 12, with the poses of groundtruth.txt (one per image).
mono3d::ImageBundle ReadBundle(const std::string& sequence, int first) {
  mono3d::FrameSourceOptions options;
  options.start = first;
  options.stride = 3;
  options.max_frames = static_cast<int>(mono3d::kBundleSize);
  const auto camera = mono3d::ReadCameraFile(sequence + "/camera.yaml");
  const auto frames = mono3d::OpenFrameSource(sequence, camera, options);
  const auto poses = mono3d::ReadTrajectory(sequence + "/groundtruth.txt");
  mono3d::ImageBundle bundle;
  std::vector<mono3d::Pose> T_world_cam;
  while (auto frame = frames->Next()) {
    mono3d::Keyframe keyframe;
    keyframe.id = frame->index;
    T_world_cam.push_back(poses.at(static_cast<std::size_t>(frame->index)).T_world_cam);
    keyframe.frame = *frame;
    bundle.keyframes.push_back(keyframe);
  }
  mono3d::SetPoses(T_world_cam, bundle);
  return bundle;
}

}  // namespace

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: 02_only_depth SEQUENCE FIRST\n";
    return 2;
  }
  const mono3d::ImageBundle bundle = ReadBundle(argv[1], std::atoi(argv[2]));
  const auto estimator = mono3d::CreateDepthEstimator(mono3d::OpenDevice());
  const mono3d::DepthResult result = estimator->Estimate(bundle);
  if (result.status != mono3d::DepthStatus::kEstimated) {
    std::cerr << "no depth: " << result.reason << "\n";
    return 1;
  }
  mono3d::WriteDepthMap(".", "middle", result.map);
  std::cout << "middle.depth.pfm: " << mono3d::CountEstimates(result.map) << " pixels between "
            << result.min_depth_su << " and " << result.max_depth_su << "\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << "\n";
  return 1;
}
