// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/products/finished_run.h"

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <system_error>

#include "mono3d/core/error.h"
#include "mono3d/core/log.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/colmap_model.h"
#include "mono3d/io/frame_source.h"
#include "products/run_record.h"

namespace mono3d {
namespace {

namespace fs = std::filesystem;

std::optional<double> NumberAt(const nlohmann::json& record, const char* pointer) {
  const nlohmann::json::json_pointer place(pointer);
  if (!record.contains(place) || !record[place].is_number()) return std::nullopt;
  const double number = record[place].get<double>();
  return std::isfinite(number) ? std::optional(number) : std::nullopt;
}

// Where an image was found, and its number among those of the input; -1: not known.
struct FoundImage {
  fs::path file;
  std::int64_t frame_index = -1;
};

// The images of a run by the names that sparse/ gives them.
class ImagesOfFolder {
 public:
  ImagesOfFolder(fs::path folder, const nlohmann::json& record) : images_(folder / "images") {
    const auto input = record.find("input");
    if (input == record.end() || !input->is_string()) return;
    std::error_code ignored;
    const std::string path = input->get<std::string>();
    if (path.empty() || fs::is_regular_file(path, ignored)) return;
    try {
      std::int64_t number = 0;
      for (const std::string& file : ListImages(path)) {
        of_input_[fs::path(file).filename().string()] = {.file = file, .frame_index = number++};
      }
    } catch (const Error&) {  // it has moved
    }
  }

  FoundImage Find(const std::string& name) const {
    FoundImage found;
    const std::string file_name = fs::path(name).filename().string();
    if (const auto of_input = of_input_.find(file_name); of_input != of_input_.end()) {
      found = of_input->second;
    } else {
      found.frame_index = NumberIn(file_name);
    }
    std::error_code ignored;
    if (fs::exists(images_ / file_name, ignored)) found.file = images_ / file_name;
    return found;
  }

 private:
  // Frames of a video are NNNNNN.jpg.
  static std::int64_t NumberIn(const std::string& name) {
    const std::string stem = fs::path(name).stem().string();
    if (stem.empty() || stem.size() > 9) return -1;
    std::int64_t number = 0;
    for (const char c : stem) {
      if (c < '0' || c > '9') return -1;
      number = 10 * number + (c - '0');
    }
    return number;
  }

  fs::path images_;
  std::map<std::string, FoundImage> of_input_;
};

// Empty where there is none; with its own ending for each form that depth maps are written in.
fs::path DepthFileOf(const fs::path& folder, std::int64_t frame_index, const std::string& kind) {
  std::string digits = std::to_string(frame_index);
  digits.insert(0, digits.size() < 6 ? 6 - digits.size() : 0, '0');
  for (const char* ending : {".pfm", ".exr", "16.png"}) {
    std::error_code ignored;
    fs::path file = folder / "depth" / (digits + "." + kind + ending);
    if (fs::exists(file, ignored)) return file;
  }
  return {};
}

// Products are written under the names of images: one that leads out of the folder must not.
void RequireNamesOfFiles(const SparseModel& sparse, const fs::path& folder) {
  for (const SparseImage& image : sparse.images) {
    const bool is_name = image.name == fs::path(image.name).filename() && image.name != "." &&
                         image.name != ".." && !image.name.empty();
    if (is_name) continue;
    throw Error(ErrorParts{.what = "the name of an image is none of a file in images/",
                           .where = (folder / "images.txt").string(),
                           .expected = "a name without folders",
                           .found = image.name});
  }
}

void ReadImagesOfRun(const nlohmann::json& record, FinishedRun& run) {
  std::error_code ignored;
  const fs::path folder = run.folder / "sparse";
  if (!fs::exists(folder / "images.txt", ignored)) return;
  SparseModel sparse = ReadColmapModel(folder);
  RequireNamesOfFiles(sparse, folder);
  run.sparse = std::move(sparse);
  const ImagesOfFolder images(run.folder, record);
  for (const SparseImage& image : run.sparse.images) {
    FoundImage found = images.Find(image.name);
    RunImage of_run;
    of_run.name = image.name;
    of_run.file = std::move(found.file);
    of_run.camera = run.sparse.CameraOf(image);
    of_run.T_world_cam = image.T_world_cam;
    if (found.frame_index >= 0) {
      of_run.depth = DepthFileOf(run.folder, found.frame_index, "depth");
      of_run.confidence = DepthFileOf(run.folder, found.frame_index, "confidence");
    }
    run.images.push_back(std::move(of_run));
  }
}

void ReadOrigin(const nlohmann::json& record, FinishedRun& run) {
  const auto latitude = NumberAt(record, "/maps/0/georeference/origin/latitude_deg");
  const auto longitude = NumberAt(record, "/maps/0/georeference/origin/longitude_deg");
  const auto altitude = NumberAt(record, "/maps/0/georeference/origin/altitude_m");
  if (!latitude || !longitude || !altitude) return;
  if (std::abs(*latitude) > 90 || std::abs(*longitude) > 180) return;
  run.origin = Geodetic{*latitude, *longitude, *altitude};
  const nlohmann::json::json_pointer known("/maps/0/georeference/altitude_known");
  run.is_altitude_known =
      record.contains(known) && record[known].is_boolean() && record[known].get<bool>();
}

// Runs `read`; what it fails at is left out, and said.
template <typename Function>
void ReadIfWhole(const char* what, Function&& read) {
  try {
    read();
  } catch (const Error& error) {
    Log(LogLevel::kWarning, std::string(error.what()) + "; " + what);
  }
}

}  // namespace

FinishedRun ReadFinishedRun(const fs::path& folder) {
  FinishedRun run;
  run.folder = folder;
  run.model = folder / "model.ply";
  std::error_code ignored;
  if (!fs::exists(run.model, ignored)) {
    throw Error(ErrorParts{.what = "there is no run with a model",
                           .where = folder.string(),
                           .expected = "the output folder of mono3d-reconstruct",
                           .found = fs::is_regular_file(folder, ignored) ? "a file: name its folder"
                                                                         : "no model.ply"});
  }
  if (fs::exists(folder / "mesh.ply", ignored)) run.mesh = folder / "mesh.ply";
  const nlohmann::json record = ReadRunRecord(folder / "run.json");
  ReadIfWhole("the images are left out", [&] { ReadImagesOfRun(record, run); });
  const fs::path depth_camera = folder / "depth" / "camera.yaml";
  if (fs::exists(depth_camera, ignored)) {
    ReadIfWhole("the depth maps are left out",
                [&] { run.depth_camera = ReadCameraFile(depth_camera.string()); });
  }
  // Depth maps are in the tracker's unit, whatever the axes of the model.
  const double scale = NumberAt(record, "/maps/0/axes/scale").value_or(1);
  if (scale > 0) run.depth_unit = scale;
  ReadOrigin(record, run);
  return run;
}

}  // namespace mono3d
