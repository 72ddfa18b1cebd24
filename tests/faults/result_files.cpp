// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "faults/result_files.h"

#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <sstream>
#include <stdexcept>

#include "mono3d/core/state_folder.h"
#include "mono3d/io/camera_file.h"
#include "mono3d/io/colmap_model.h"
#include "mono3d/io/mesh_file.h"
#include "mono3d/io/pfm_file.h"
#include "mono3d/io/ply_file.h"

namespace mono3d::faults {
namespace {

namespace fs = std::filesystem;

std::string BytesOf(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

void Require(bool holds, const char* what) {
  if (!holds) throw std::runtime_error(what);
}

// Whole lines of eight finite numbers.
void ReadWholeTrajectory(const std::string& text) {
  Require(text.empty() || text.ends_with('\n'), "the last line is not whole");
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line[0] == '#') continue;
    std::istringstream numbers(line);
    int count = 0;
    for (double number = 0; numbers >> number; ++count) {
      Require(std::isfinite(number), "not a finite number");
    }
    Require(count == 8, "not a line of eight numbers");
  }
}

void ReadWhole(const fs::path& path, RunState state) {
  const std::string name = path.filename();
  const std::string bytes = BytesOf(path);
  const std::string folder = path.parent_path().filename();
  const std::string extension = path.extension();
  if (folder.starts_with("sparse") && state == RunState::kWhole) {
    (void)ReadColmapModel(path.parent_path());
  } else if (folder.starts_with("sparse")) {
    Require(extension == ".bin" || bytes.ends_with('\n'), "the last line is not whole");
  } else if (name.starts_with("mesh")) {
    (void)ReadMeshPly(path);
  } else if (extension == ".ply") {
    (void)ReadPly(path);
  } else if (extension == ".pfm") {
    (void)ReadPfm(path);
  } else if (extension == ".png" || extension == ".jpg") {
    Require(extension == ".jpg" || bytes.find("IEND") != bytes.npos, "the image is cut");
    Require(!cv::imread(path).empty(), "not an image");
  } else if (extension == ".json") {
    Require(nlohmann::json::accept(bytes), "not a JSON text");
  } else if (extension == ".yaml") {
    (void)ReadCameraFile(path);
  } else if (extension == ".html") {
    Require(bytes.find("</html>") != bytes.npos, "the page is cut");
  } else if (folder == "journal" && name == "manifest") {
    const StateFolder states(path.parent_path());
    for (const std::string& part : states.Names("")) (void)states.Get(part);
  } else if (folder == "journal") {
    Require(name.starts_with("parts-"), "no file of a journal");  // whole as the manifest is
  } else if (name == ".images_of_run") {
    Require(bytes.ends_with('\n'), "the last line is not whole");
  } else if (extension == ".txt") {
    ReadWholeTrajectory(bytes);
  } else {
    Require(false, "no file of a run");
  }
}

}  // namespace

std::string FaultsOfFiles(const fs::path& folder, RunState state) {
  std::string faults;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    if (entry.is_directory()) continue;
    const fs::path& path = entry.path();
    const bool is_left =
        path.extension() == ".partial" || path.filename().string().starts_with(".mono3d_probe");
    if (is_left && state == RunState::kKilled) continue;
    try {
      if (BytesOf(path) != "earlier") ReadWhole(path, state);
    } catch (const std::exception& error) {
      faults += " [" + path.lexically_relative(folder).string() + ": " + error.what() + "]";
    }
  }
  return faults;
}

std::set<std::string> NamesOfFiles(const fs::path& folder) {
  std::set<std::string> names;
  for (const auto& entry : fs::recursive_directory_iterator(folder)) {
    const std::string name = entry.path().lexically_relative(folder);
    if (!entry.is_directory() && !name.starts_with("unfinished_")) names.insert(name);
  }
  return names;
}

}  // namespace mono3d::faults
