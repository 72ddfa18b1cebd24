// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "bench/measurements.h"

#include <cstdio>

#include "common/json_file.h"
#include "common/tool.h"
#include "mono3d/io/output_file.h"

namespace mono3d::tools {
namespace {

void AddDeviceOptions(CLI::App& app, DeviceOptions& device) {
  app.add_option("--device", device.device, "Vulkan device: its index or part of its name");
  app.add_flag("!--no-host-kernels", device.host_kernels,
               "without a GPU, all kernels by the driver, to compare");
}

}  // namespace

DepthCommand::DepthCommand(CLI::App& tool)
    : app_(*tool.add_subcommand("depth", "what a depth map costs, by stage")) {
  app_.add_option("DIR", options_.folder, "folder of a sequence")->required();
  app_.add_option("--poses", options_.poses,
                  "TUM file, a pose for each image; default: groundtruth.txt");
  app_.add_option("--resize", options_.resize, "WIDTHxHEIGHT or \"calibration\"");
  app_.add_option("--reference", options_.reference,
                  "index of the middle image; -1: that of the middle")
      ->capture_default_str();
  app_.add_option("--step", options_.step, "images from one of the bundle to the next")
      ->capture_default_str();
  app_.add_option("--images", options_.num_images, "images of the bundle: 3, 5, 7 or 9")
      ->capture_default_str();
  app_.add_option("--repeat", options_.num_repeats, "maps that are timed")->capture_default_str();
  app_.add_flag("!--alone", options_.compare, "do not measure OpenCV's StereoSGBM beside it");
  app_.add_option("--json", json_, "write the figures as JSON");
  AddDeviceOptions(app_, device_);
  Tool::AddOptions(app_, ListOptions(options_.depth), "depth.");
}

int DepthCommand::Run() const {
  RequireOption(options_.num_repeats >= 1, "repeat", "at least 1", options_.num_repeats);
  const DepthBenchResult result = BenchDepth(options_, device_);
  if (!json_.empty()) WriteFileAtomically(json_, JsonText(ToJson(result)));
  std::printf("%s\n", ToText(ToTable(result)).c_str());
  return 0;
}

FusionCommand::FusionCommand(CLI::App& tool)
    : app_(*tool.add_subcommand(
          "fusion", "what it costs to fuse a depth map with a large model, and to correct that")) {
  app_.add_option("--surfels", options_.num_surfels, "of the model")->capture_default_str();
  app_.add_option("--width", options_.width_px, "of the depth maps, in pixels")
      ->capture_default_str();
  app_.add_option("--height", options_.height_px, "of the depth maps, in pixels")
      ->capture_default_str();
  app_.add_option("--repeat", options_.num_repeats, "maps of each kind that are timed")
      ->capture_default_str();
  app_.add_option("--error", options_.error_px, "of the wrong poses, in pixels of the image")
      ->capture_default_str();
  app_.add_option("--json", json_, "write the figures as JSON");
  AddDeviceOptions(app_, device_);
  Tool::AddOptions(app_, ListOptions(options_.fusion), "fusion.");
}

int FusionCommand::Run() const {
  RequireOption(options_.num_repeats >= 1, "repeat", "at least 1", options_.num_repeats);
  RequireOption(options_.width_px >= 32, "width", "at least 32", options_.width_px);
  RequireOption(options_.height_px >= 32, "height", "at least 32", options_.height_px);
  const int one_map = options_.width_px * options_.height_px;
  RequireOption(options_.num_surfels >= one_map, "surfels", "no less than a depth map has pixels",
                options_.num_surfels);
  const FusionBenchResult result = BenchFusion(options_, device_);
  if (!json_.empty()) WriteFileAtomically(json_, JsonText(ToJson(result)));
  for (const Table& table : ToTables(result)) std::printf("%s\n", ToText(table).c_str());
  return 0;
}

FlightCommand::FlightCommand(CLI::App& tool)
    : app_(*tool.add_subcommand(
          "flight", "what a depth map costs, and the memory, while a model grows without end")) {
  app_.add_option("--surfels", options_.num_surfels, "of the model in the end")
      ->capture_default_str();
  app_.add_option("--width", options_.width_px, "of the depth maps, in pixels")
      ->capture_default_str();
  app_.add_option("--height", options_.height_px, "of the depth maps, in pixels")
      ->capture_default_str();
  app_.add_option("--new-share", options_.new_share, "of the ground, with each map")
      ->capture_default_str();
  app_.add_option("--row", options_.num_per_row, "maps of a row of the table")
      ->capture_default_str();
  app_.add_option("--again", options_.num_maps_again, "maps of the beginning, flown once more")
      ->capture_default_str();
  app_.add_flag("--save", options_.with_save, "save the state of the model after each row");
  AddDeviceOptions(app_, device_);
  Tool::AddOptions(app_, ListOptions(options_.fusion), "fusion.");
}

int FlightCommand::Run() const {
  RequireOption(options_.width_px >= 32, "width", "at least 32", options_.width_px);
  RequireOption(options_.height_px >= 32, "height", "at least 32", options_.height_px);
  RequireOption(options_.num_surfels >= 1, "surfels", "at least 1", options_.num_surfels);
  RequireOption(options_.new_share > 0 && options_.new_share <= 1, "new-share", "in (0, 1]",
                options_.new_share);
  RequireOption(options_.num_per_row >= 1, "row", "at least 1", options_.num_per_row);
  RequireOption(options_.num_maps_again >= 1, "again", "at least 1", options_.num_maps_again);
  for (const Table& table : ToTables(BenchFlight(options_, device_))) {
    std::printf("%s\n", ToText(table).c_str());
  }
  return 0;
}

}  // namespace mono3d::tools
