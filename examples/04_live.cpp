// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// A camera, by its number, or a video to a coloured point cloud that grows meanwhile:
//   04_live 0 camera.yaml -> cloud.ply, anew every five seconds

#include <chrono>
#include <exception>
#include <iostream>
#include <opencv2/videoio.hpp>
#include <string>
#include <thread>

#include "mono3d/gpu/device.h"
#include "mono3d/image/undistorter.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/pipeline/pipeline.h"

int main(int argc, char** argv) try {
  if (argc != 3) {
    std::cerr << "usage: 04_live DEVICE|VIDEO CAMERA\n";
    return 2;
  }
  const std::string input = argv[1];
  const bool is_device = input.find_first_not_of("0123456789") == std::string::npos;
  cv::VideoCapture capture;
  if (!(is_device ? capture.open(std::stoi(input)) : capture.open(input))) {
    std::cerr << "cannot open " << input << "\n";
    return 1;
  }
  const double fps = capture.get(cv::CAP_PROP_FPS);  // 0 where the file does not tell
  const mono3d::Undistorter undistorter(mono3d::ReadCameraFile(argv[2]));
  mono3d::PipelineOptions options;
  options.is_live = true;
  mono3d::Pipeline pipeline(
      mono3d::CreateStages(options, mono3d::OpenDevice({.device = {}, .yields = true})), {},
      options);
  pipeline.Start();
  const auto start = std::chrono::steady_clock::now();
  cv::Mat image;  // filled again and again: Push keeps a copy of its own
  for (int index = 0, num_seconds = 0; capture.read(image); ++index) {
    if (!is_device && fps > 0)
      std::this_thread::sleep_until(start + std::chrono::duration<double>(index / fps));
    const double now_s =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    pipeline.Push({index, now_s, "frame " + std::to_string(index), undistorter.Undistort(image),
                   undistorter.camera()});
    if (now_s < num_seconds + 1) continue;
    const mono3d::PipelineSnapshot now = pipeline.Snapshot();
    std::cout << num_seconds + 1 << " s: " << mono3d::ToString(now.status) << ", "
              << now.counts.num_keyframes << " keyframes, " << now.counts.num_fused
              << " depth maps, " << now.num_surfels << " surfels" << std::endl;
    if (++num_seconds % 5 == 0) mono3d::WritePly("cloud.ply", mono3d::ToPointCloud(now.surfels));
  }
  const mono3d::Reconstruction result = pipeline.Stop();
  if (result.maps.empty()) {
    std::cerr << "no model came of " << result.counts.num_frames << " frames\n";
    return 1;
  }
  mono3d::WritePly("cloud.ply", result.maps.front().model);
  std::cout << "cloud.ply: " << result.maps.front().model.size() << " points\n";
} catch (const std::exception& error) {
  std::cerr << error.what() << "\n";
  return 1;
}
