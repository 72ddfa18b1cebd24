// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

// mono3d-evaluate: how far a result is from the truth, by the paper's measures and more.

#include <filesystem>

#include "common/tool.h"
#include "evaluate/cloud_part.h"
#include "evaluate/depth_part.h"
#include "evaluate/run_part.h"
#include "evaluate/trajectory_part.h"

namespace mono3d::tools {
namespace {

void AddOutput(CLI::App& app, EvaluationOutput& output, const std::string& defaults) {
  app.add_option("--json", output.json, "write every figure as JSON" + defaults);
  app.add_option("--pictures", output.pictures, "folder for the pictures, as PNG and SVG");
  app.add_option("--report", output.report,
                 "write a page with tables and pictures (HTML, self-contained)" + defaults);
}

void AddTrajectoryOptions(CLI::App& app, TrajectoryErrorOptions& options) {
  app.add_option("--align", options.align, "alignment to the truth: sim3, se3 or none")
      ->capture_default_str();
  app.add_option("--max-time-difference", options.max_time_difference_s,
                 "of two poses that count as simultaneous, in seconds")
      ->capture_default_str();
  app.add_option("--relative-segment", options.relative_segment,
                 "length of the segments for the relative error, as a share of the way")
      ->capture_default_str();
}

void AddDepthOptions(CLI::App& app, DepthEvaluationOptions& options) {
  app.add_option("--scaling", options.scaling,
                 "map: median scaling of each map, as in the paper; run: one scale for all; none")
      ->capture_default_str();
  app.add_flag_callback(
      "--no-scaling", [&options] { options.scaling = "none"; }, "the same as --scaling none");
  app.add_option("--max-depth", options.max_depth_m,
                 "leave out true depths beyond, in metres (the paper: 300); 0: none")
      ->capture_default_str();
  app.add_option("--png-scale", options.png_scale,
                 "metres = value / scale in 16-bit PNG; default: scale.txt beside the images");
}

void AddMeanDepth(CLI::App& app, double& mean_depth_m, const std::string& otherwise) {
  app.add_option("--mean-depth", mean_depth_m,
                 "of the scene in metres, to state errors in percent of it; " + otherwise);
}

void AddTrajectory(CLI::App& app, TrajectoryArguments& arguments) {
  app.add_option("EST", arguments.estimate, "estimated poses: TUM, KITTI or COLMAP images.txt")
      ->required();
  app.add_option("TRUTH", arguments.truth, "true poses, in any of these forms")->required();
  AddTrajectoryOptions(app, arguments.options);
  app.add_option("--times", arguments.times,
                 "file with one time a line, for poses without (KITTI, COLMAP)");
  app.add_option("--fps", arguments.fps, "of poses without a time, when there is no such file")
      ->capture_default_str();
  AddMeanDepth(app, arguments.mean_depth_m, "default: not stated");
}

void AddDepth(CLI::App& app, DepthArguments& arguments) {
  app.add_option("EST", arguments.estimate,
                 "estimated depth: PFM, EXR or 16-bit PNG, or a folder of them")
      ->required();
  app.add_option("TRUTH", arguments.truth,
                 "true depth; the files of folders are matched by the number in their names")
      ->required();
  AddDepthOptions(app, arguments.options);
  app.add_option("--camera", arguments.camera,
                 "calibration of the images, to compare normals as well");
}

void AddCloud(CLI::App& app, CloudArguments& arguments) {
  app.add_option("EST", arguments.estimate, "estimated cloud, PLY")->required();
  app.add_option("TRUTH", arguments.truth, "true cloud, PLY")->required();
  app.add_option("--est-trajectory", arguments.estimate_trajectory,
                 "poses in the frame of EST: their alignment to the true ones is where the "
                 "registration begins");
  app.add_option("--truth-trajectory", arguments.truth_trajectory, "true poses of the same frames");
  app.add_option("--max-time-difference", arguments.trajectory.max_time_difference_s,
                 "of two poses that count as simultaneous, in seconds")
      ->capture_default_str();
  AddMeanDepth(app, arguments.mean_depth_m, "default: no shares within a distance");
}

void AddRun(CLI::App& app, RunArguments& arguments) {
  app.add_option("OUT", arguments.run, "folder that mono3d-reconstruct wrote")->required();
  app.add_option("SEQUENCE", arguments.sequence,
                 "folder with groundtruth.txt, depth/, cloud.ply, as far as there are")
      ->required();
  AddTrajectoryOptions(app, arguments.trajectory);
  AddDepthOptions(app, arguments.depth);
  AddMeanDepth(app, arguments.mean_depth_m, "default: from the true depth maps");
}

}  // namespace
}  // namespace mono3d::tools

int main(int argc, char** argv) {
  using namespace mono3d::tools;
  Tool tool("mono3d-evaluate",
            "Compares trajectories, depth maps and models with the truth.\n"
            "Example: mono3d-evaluate run model/ flight/",
            ToolKind::kPlain);
  tool.app().require_subcommand(1);
  EvaluationOutput output;
  TrajectoryArguments trajectory;
  DepthArguments depth;
  CloudArguments cloud;
  RunArguments run;
  bool no_report = false;
  CLI::App* app = tool.app().add_subcommand("trajectory", "positions and rotations of the camera");
  AddTrajectory(*app, trajectory);
  AddOutput(*app, output, "");
  app = tool.app().add_subcommand("depth", "depth maps, their confidence and normals");
  AddDepth(*app, depth);
  AddOutput(*app, output, "");
  app = tool.app().add_subcommand("cloud", "point clouds: registration, then distances");
  AddCloud(*app, cloud);
  AddOutput(*app, output, "");
  app = tool.app().add_subcommand("run", "everything about one run of mono3d-reconstruct");
  AddRun(*app, run);
  AddOutput(*app, output, "; default: in OUT");
  app->add_flag("--no-report", no_report, "no page, which takes most of the time");
  return tool.Run(argc, argv, [&] {
    if (tool.app().got_subcommand("run")) {
      const std::filesystem::path folder = run.run;
      if (output.json.empty()) output.json = folder / "evaluation.json";
      output.run_report = folder / "report.html";
      if (output.report.empty() && !no_report) output.report = output.run_report;
    }
    const bool with_pictures = output.has_pictures();
    WriteEvaluation(tool.app().got_subcommand("trajectory")
                        ? EvaluateTrajectoryFiles(trajectory, with_pictures)
                    : tool.app().got_subcommand("depth") ? EvaluateDepthFiles(depth, with_pictures)
                    : tool.app().got_subcommand("cloud") ? EvaluateCloudFiles(cloud, with_pictures)
                                                         : EvaluateRun(run, with_pictures),
                    output);
    return 0;
  });
}
