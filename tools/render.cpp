// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-render: pictures of a model, as a camera sees it or from above and from two sides.

#include <cstdio>
#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgcodecs.hpp>
#include <span>
#include <string>
#include <vector>

#include "common/tool.h"
#include "drawing/cloud_renderer.h"
#include "drawing/cloud_view.h"
#include "drawing/model_picture.h"
#include "mono3d/core/error.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/output_file.h"
#include "mono3d/io/ply_file.h"
#include "mono3d/io/trajectory_file.h"

namespace mono3d::tools {
namespace {

struct Arguments {
  std::string model;
  std::string camera;
  std::vector<double> pose;
  std::string trajectory;
  int every = 1;
  bool overview = false;
  std::string aspect = "colour";
  int width_px = 960;
  std::string output;
};

void WritePng(const std::filesystem::path& path, const cv::Mat& picture) {
  std::vector<uchar> bytes;
  cv::imencode(".png", picture, bytes);
  WriteFileAtomically(path, std::string(bytes.begin(), bytes.end()));
}

void RequireUsable(const Arguments& arguments) {
  const int num_views = (arguments.pose.empty() ? 0 : 1) + (arguments.trajectory.empty() ? 0 : 1) +
                        (arguments.overview ? 1 : 0);
  if (num_views != 1) throw UsageError("one of --pose, --trajectory and --overview is needed");
  if (!arguments.overview && arguments.camera.empty()) {
    throw UsageError("--pose and --trajectory need --camera");
  }
  RequireOption(arguments.every >= 1, "every", "1 or more", arguments.every);
  RequireOption(arguments.width_px >= 16, "width", "16 or more", arguments.width_px);
}

cv::Mat Overview(const PointCloud& model, ModelAspect aspect, int width_px) {
  const PointCloud coloured = Recoloured(model, aspect);
  const CloudLayer layer{.cloud = &coloured};
  std::vector<cv::Mat> pictures;
  for (const CloudView& view : StandardCloudViews(coloured, width_px)) {
    pictures.push_back(RenderClouds({&layer, 1}, view));
  }
  cv::Mat overview;
  cv::vconcat(pictures, overview);
  return overview;
}

Pose PoseOf(const std::vector<double>& v) {
  const Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
  RequireOption(rotation.norm() > 0.5, "pose", "a quaternion of unit length", rotation.norm());
  return {rotation.normalized(), Eigen::Vector3d(v[0], v[1], v[2])};
}

int Render(const Arguments& arguments) {
  RequireUsable(arguments);
  const ModelAspect aspect = ToModelAspect(arguments.aspect);
  const PointCloud model = ReadPly(arguments.model);
  if (arguments.overview) {
    WritePng(arguments.output, Overview(model, aspect, arguments.width_px));
    std::printf("%s: from above and from two sides\n", arguments.output.c_str());
    return 0;
  }
  // Models are made of images without distortion.
  const CameraModel camera = ReadCameraFile(arguments.camera).WithoutDistortion();
  if (!arguments.pose.empty()) {
    WritePng(arguments.output,
             ToPicture(RenderModel(model, camera, PoseOf(arguments.pose)), aspect));
    std::printf("%s\n", arguments.output.c_str());
    return 0;
  }
  const std::vector<StampedPose> poses = ReadTrajectory(arguments.trajectory);
  const std::filesystem::path folder = arguments.output;
  CreateOutputFolder(folder);
  int num_pictures = 0;
  for (std::size_t i = 0; i < poses.size(); i += static_cast<std::size_t>(arguments.every)) {
    std::string name = std::to_string(i);
    name.insert(0, name.size() < 6 ? 6 - name.size() : 0, '0');
    WritePng(folder / (name + ".png"),
             ToPicture(RenderModel(model, camera, poses[i].T_world_cam), aspect));
    ++num_pictures;
  }
  std::printf("%s: %d pictures\n", folder.c_str(), num_pictures);
  return 0;
}

}  // namespace
}  // namespace mono3d::tools

int main(int argc, char** argv) {
  using namespace mono3d::tools;
  Tool tool("mono3d-render",
            "Draws a surfel model as a camera sees it, or from above and from two sides.\n"
            "Example: mono3d-render model/model.ply --overview -o model.png",
            ToolKind::kPlain);
  Arguments arguments;
  CLI::App& app = tool.app();
  app.add_option("MODEL", arguments.model, "model.ply")->required();
  app.add_option("--camera", arguments.camera, "calibration, as for mono3d-reconstruct");
  app.add_option("--pose", arguments.pose, "camera to world: tx ty tz qx qy qz qw")->expected(7);
  app.add_option("--trajectory", arguments.trajectory,
                 "one picture for each pose of a TUM file; OUTPUT is a folder");
  app.add_option("--every", arguments.every, "of these poses only every so many")
      ->capture_default_str();
  app.add_flag("--overview", arguments.overview, "from above and from two sides");
  app.add_option("--show", arguments.aspect, "colour, normal, confidence or depth")
      ->capture_default_str();
  app.add_option("--width", arguments.width_px, "of the overview, in pixels")
      ->capture_default_str();
  app.add_option("-o,--output", arguments.output, "PNG file, or folder with --trajectory")
      ->required();
  return tool.Run(argc, argv, [&] { return Render(arguments); });
}
