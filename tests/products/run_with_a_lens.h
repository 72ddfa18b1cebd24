// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <filesystem>
#include <opencv2/imgcodecs.hpp>

#include "mono3d/io/pfm_file.h"
#include "mono3d/products/finished_run.h"

namespace mono3d {

// A run of two images through a lens with distortion, the first of which has a depth map; one point
// that both show.
inline FinishedRun RunWithALens(const std::filesystem::path& folder) {
  FinishedRun run;
  run.folder = folder;
  std::filesystem::create_directories(folder / "images");
  std::filesystem::create_directories(folder / "depth");
  const CameraModel pinhole = {.width = 64, .height = 48, .fx = 50, .fy = 52, .cx = 31, .cy = 24};
  CameraModel lens = pinhole;
  lens.distortion = {-.1, .01, .001, .002, 0};
  SparseModel sparse;
  sparse.camera = pinhole;
  sparse.points = {{.p_world = {.2, -.1, 4}, .colour = {200, 100, 50}}};
  for (int i = 0; i < 2; ++i) {
    RunImage image;
    image.name = i == 0 ? "000004.png" : "000009.png";
    image.file = folder / "images" / image.name;
    image.camera = lens;
    image.T_world_cam =
        Pose(RotationExp(Eigen::Vector3d(.05, .1 * i, 0)), Eigen::Vector3d(.3 * i, 0, .1));
    cv::imwrite(image.file.string(), cv::Mat(48, 64, CV_8UC3, cv::Scalar(10, 20, 30 + i)));
    sparse.images.push_back(
        {.id = i,
         .name = image.name,
         .T_world_cam = image.T_world_cam,
         .observations = {
             {.pixel = pinhole.Project(image.T_world_cam.Inverse() * sparse.points[0].p_world),
              .point = 0}}});
    run.images.push_back(image);
  }
  run.sparse = WithCamera(sparse, lens);
  run.depth_camera = pinhole;
  run.depth_unit = 2;
  cv::Mat depth(48, 64, CV_32FC1, cv::Scalar(3)), confidence(48, 64, CV_32FC1, cv::Scalar(.5));
  cv::Mat normal(48, 64, CV_32FC3, cv::Scalar(.6, 0, -.8));
  depth.at<float>(5, 7) = 1.25F;
  depth.at<float>(6, 7) = 0;
  confidence.at<float>(5, 7) = .9F;
  run.images[0].depth = folder / "depth" / "000004.depth.pfm";
  run.images[0].confidence = folder / "depth" / "000004.confidence.pfm";
  WritePfm(run.images[0].depth, depth);
  WritePfm(run.images[0].confidence, confidence);
  WritePfm(folder / "depth" / "000004.normal.pfm", normal);
  return run;
}

}  // namespace mono3d
