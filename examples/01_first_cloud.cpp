// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// A folder of images to a coloured point cloud: 01_first_cloud village_orbit
// village_orbit/camera.yaml
#include <exception>
#include <iostream>

#include "mono3d/gpu/device.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/frame_source.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/pipeline/pipeline.h"

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: 01_first_cloud IMAGES CAMERA\n";
    return 2;
  }
  const auto frames = mono3d::OpenFrameSource(argv[1], mono3d::ReadCameraFile(argv[2]));
  mono3d::Pipeline pipeline(mono3d::CreateStages({}, mono3d::OpenDevice()));
  const mono3d::Reconstruction result = pipeline.Run(*frames);
  if (result.maps.empty() || result.maps.front().model.empty()) {
    std::cerr << "no model came of " << result.counts.num_frames << " frames\n";
    return 1;
  }
  mono3d::WritePly("cloud.ply", result.maps.front().model);
  std::cout << "cloud.ply: " << result.maps.front().model.size() << " points from "
            << result.counts.num_fused << " depth maps\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << "\n";
  return 1;
}
