// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "evaluate/files.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <regex>
#include <system_error>

#include "mono3d/core/error.h"
#include "mono3d/io/depth_map_files.h"
#include "mono3d/io/frame_source.h"

namespace mono3d::tools {
namespace {

bool IsFile(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_regular_file(path, ignored);
}

bool IsFolder(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_directory(path, ignored);
}

std::filesystem::path FileOrNothing(const std::filesystem::path& path) {
  return IsFile(path) ? path : std::filesystem::path{};
}

void RequireFolder(const std::filesystem::path& folder) {
  if (IsFolder(folder)) return;
  throw Error(
      ErrorParts{.what = "no such folder", .where = folder.string(), .expected = {}, .found = {}});
}

// Numbers of the maps after the first one.
std::vector<int> FurtherMaps(const std::filesystem::path& folder) {
  static const std::regex kName(R"((?:trajectory|model)_map(\d{1,6})\.(?:txt|ply))");
  std::vector<int> numbers;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::smatch match;
    const std::string name = entry.path().filename().string();
    if (std::regex_match(name, match, kName)) numbers.push_back(std::stoi(match[1]));
  }
  std::sort(numbers.begin(), numbers.end());
  numbers.erase(std::unique(numbers.begin(), numbers.end()), numbers.end());
  return numbers;
}

RunMapFiles FindMapFiles(const std::filesystem::path& folder, const std::string& suffix) {
  const auto find = [&](const char* stem, const char* extension) {
    return FileOrNothing(folder / (stem + suffix + extension));
  };
  return {suffix,
          find("trajectory", ".txt"),
          find("trajectory_online", ".txt"),
          find("model_trajectory", ".txt"),
          find("model", ".ply"),
          find("mesh", ".ply")};
}

bool IsEmpty(const RunMapFiles& map) {
  return map.trajectory.empty() && map.trajectory_online.empty() && map.model_trajectory.empty() &&
         map.model.empty();
}

}  // namespace

std::string NameOfFolder(const std::filesystem::path& folder) {
  const std::filesystem::path path = std::filesystem::absolute(folder).lexically_normal();
  return (path.has_filename() ? path : path.parent_path()).filename().string();
}

std::optional<std::int64_t> FrameNumber(const std::filesystem::path& path) {
  std::string name = path.filename().string();
  name = name.substr(0, name.find('.'));
  constexpr const char* kDigits = "0123456789";
  const std::size_t last = name.find_last_of(kDigits);
  if (last == std::string::npos) return std::nullopt;
  const std::size_t before = name.find_last_not_of(kDigits, last);
  const std::size_t first = before == std::string::npos ? 0 : before + 1;
  std::int64_t number = 0;
  const char* end = name.data() + last + 1;
  const auto result = std::from_chars(name.data() + first, end, number);
  return result.ec == std::errc{} ? std::optional(number) : std::nullopt;
}

FilesByFrame ListByFrame(const std::filesystem::path& folder, const std::string& ending) {
  FilesByFrame files;
  if (!IsFolder(folder)) return files;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::filesystem::path& path = entry.path();
    if (!path.filename().string().ends_with(ending)) continue;
    const std::optional<std::int64_t> number = FrameNumber(path);
    if (!number) continue;
    const auto [other, is_new] = files.emplace(*number, path);
    if (is_new) continue;
    throw Error(ErrorParts{
        .what = "two files of one frame",
        .where = folder.string(),
        .expected = "one file of number " + std::to_string(*number),
        .found = other->second.filename().string() + " and " + path.filename().string()});
  }
  return files;
}

FilesByFrame ListDepthMapFiles(const std::filesystem::path& folder, const std::string& kind) {
  for (const std::string& ending : DepthFileEndings(kind)) {
    FilesByFrame files = ListByFrame(folder, ending);
    if (!files.empty()) return files;
  }
  return {};
}

FilesByFrame ListDepthImages(const std::filesystem::path& folder) {
  RequireFolder(folder);
  FilesByFrame of_run = ListDepthMapFiles(folder, "depth");
  if (!of_run.empty()) return of_run;
  for (const char* ending : {".pfm", ".exr", ".png"}) {
    FilesByFrame files = ListByFrame(folder, ending);
    if (!files.empty()) return files;
  }
  throw Error(ErrorParts{.what = "no depth images in the folder",
                         .where = folder.string(),
                         .expected = "*.pfm, *.exr or *.png with a number in the name",
                         .found = "none"});
}

RunFiles FindRunFiles(const std::filesystem::path& folder) {
  RequireFolder(folder);
  RunFiles files;
  files.maps.push_back(FindMapFiles(folder, ""));
  for (const int number : FurtherMaps(folder)) {
    files.maps.push_back(FindMapFiles(folder, "_map" + std::to_string(number)));
  }
  std::erase_if(files.maps, IsEmpty);
  files.depth = ListDepthMapFiles(folder / "depth", "depth");
  files.confidence = ListDepthMapFiles(folder / "depth", "confidence");
  files.normal = ListDepthMapFiles(folder / "depth", "normal");
  files.record = FileOrNothing(folder / "run.json");
  if (files.maps.empty() && files.depth.empty()) {
    const bool is_truth = !FileOrNothing(folder / "groundtruth.txt").empty();
    throw Error(ErrorParts{.what = "not the output of a reconstruction",
                           .where = folder.string(),
                           .expected = "trajectory.txt, model.ply or depth/NNNNNN.depth.pfm",
                           .found = is_truth ? "a sequence with its truth: that comes second, "
                                               "behind the run"
                                             : "none of them"});
  }
  return files;
}

SequenceFiles FindSequenceFiles(const std::filesystem::path& folder) {
  RequireFolder(folder);
  SequenceFiles files;
  if (IsFolder(folder / "images")) files.images = ListImages((folder / "images").string());
  files.camera = FileOrNothing(folder / "camera.yaml");
  files.groundtruth = FileOrNothing(folder / "groundtruth.txt");
  files.timestamps = FileOrNothing(folder / "timestamps.txt");
  if (IsFolder(folder / "depth")) files.depth = ListDepthImages(folder / "depth");
  files.cloud = FileOrNothing(folder / "cloud.ply");
  if (files.groundtruth.empty() && files.depth.empty() && files.cloud.empty()) {
    throw Error(ErrorParts{.what = "the sequence has no truth to compare with",
                           .where = folder.string(),
                           .expected = "groundtruth.txt, depth/ or cloud.ply",
                           .found = "none of them"});
  }
  return files;
}

std::int64_t NumberOfImage(const SequenceFiles& sequence, std::int64_t index) {
  if (index < 0 || index >= static_cast<std::int64_t>(sequence.images.size())) return index;
  return FrameNumber(sequence.images[static_cast<std::size_t>(index)]).value_or(index);
}

}  // namespace mono3d::tools
