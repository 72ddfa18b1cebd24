// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// Renders the sequence of this folder anew, from the seed.

#include <cstdio>
#include <exception>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "mono3d/core/error.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/output_file.h"
#include "mono3d/io/pfm_file.h"
#include "mono3d/io/trajectory_file.h"
#include "synthetic/frame_flights.h"
#include "synthetic/render.h"
#include "synthetic/village.h"

namespace {

namespace fs = std::filesystem;
using namespace mono3d;

constexpr double kFramesPerSecond = 30;
constexpr int kDepthStride = 10;  // --depth writes the true depth of every tenth frame
constexpr int kJpegQuality = 65;  // 75 KB an image

const CameraModel kCamera{768, 448, 691.2, 691.2, 383.5, 223.5};

std::string FrameName(int frame) {
  const std::string digits = std::to_string(frame);
  return std::string(6 - digits.size(), '0') + digits;
}

std::vector<Pose> Flight() {
  synthetic::OrbitOptions orbit;
  orbit.num_frames = 76;
  orbit.start_deg = 215;
  return synthetic::OrbitFlight(orbit);
}

void MakeSequence(const fs::path& folder, bool with_depth) {
  const fs::path images = folder / "images";
  CreateOutputFolder(images);
  const synthetic::Scene scene = synthetic::BuildVillage();
  const std::vector<Pose> flight = Flight();
  std::vector<StampedPose> truth;
  for (int frame = 0; frame < static_cast<int>(flight.size()); ++frame) {
    const Pose& T_world_cam = flight[static_cast<std::size_t>(frame)];
    synthetic::RenderOptions options;
    options.sensor.shot_noise = 0.008;  // of a good camera in daylight: about one grey level
    options.with_depth = with_depth && frame % kDepthStride == 0;
    const synthetic::Shot shot{[&](double) { return T_world_cam; }, frame / kFramesPerSecond,
                               frame};
    const synthetic::Rendering rendering = synthetic::Render(scene, kCamera, shot, options);
    const fs::path image = images / (FrameName(frame) + ".jpg");
    if (!cv::imwrite(image.string(), rendering.bgr, {cv::IMWRITE_JPEG_QUALITY, kJpegQuality})) {
      throw Error({"cannot write the image", image.string(), {}, {}});
    }
    if (options.with_depth) {
      CreateOutputFolder(folder / "depth");
      WritePfm(folder / "depth" / (FrameName(frame) + ".depth.pfm"), rendering.depth);
    }
    truth.push_back({frame / kFramesPerSecond, T_world_cam});
  }
  WriteCameraFile(folder / "camera.yaml", kCamera);
  WriteTrajectory(folder / "groundtruth.txt", truth);
}

}  // namespace

int main(int argc, char** argv) {
  const bool with_depth = argc == 3 && std::string(argv[2]) == "--depth";
  if (argc != 2 && !with_depth) {
    std::fputs("usage: mono3d_make_village_orbit FOLDER [--depth]\n", stderr);
    return 2;
  }
  try {
    MakeSequence(argv[1], with_depth);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}
