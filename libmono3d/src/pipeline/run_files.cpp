// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "pipeline/run_files.h"

#include <algorithm>
#include <cstdio>
#include <optional>
#include <set>
#include <system_error>

#include "core/system_error.h"
#include "mono3d/core/error.h"
#include "mono3d/pipeline/images_of_run.h"

namespace mono3d {
namespace {

constexpr std::string_view kCameraStem = "learned_camera_";

bool IsNumber(std::string_view text) {
  return !text.empty() && std::ranges::all_of(text, [](char c) { return c >= '0' && c <= '9'; });
}

// What stays of `name` without the ending; nothing where it has another one.
std::optional<std::string_view> WithoutEnding(std::string_view name, std::string_view ending) {
  if (!name.ends_with(ending)) return std::nullopt;
  return name.substr(0, name.size() - ending.size());
}

bool IsNameOfCamera(std::string_view name) {
  const std::optional<std::string_view> stem = WithoutEnding(name, ".yaml");
  return stem && stem->starts_with(kCameraStem) && IsNumber(stem->substr(kCameraStem.size()));
}

// As NameOfMap makes them.
bool IsNameOfMap(std::string_view name, std::string_view stem, std::string_view extension) {
  const std::optional<std::string_view> rest = WithoutEnding(name, extension);
  constexpr std::string_view kMap = "_map";
  if (!rest || !rest->starts_with(stem)) return false;
  const std::string_view number = rest->substr(stem.size());
  return number.empty() || (number.starts_with(kMap) && IsNumber(number.substr(kMap.size())));
}

bool IsRunFile(std::string_view name) {
  const auto is_text = [&](const char* stem) { return IsNameOfMap(name, stem, ".txt"); };
  // Report, overview, mask and next views are written by mono3d-reconstruct, the others, which tell
  // of this model, by mono3d-evaluate.
  return name == "run.json" || name == "report.html" || name == "overview.png" ||
         name == "mask.png" || name == "next_views.json" || name == "next_views.kml" ||
         name == "evaluation.json" || name == "model_errors.ply" || name == kCameraName ||
         IsNameOfCamera(name) || IsNameOfMap(name, "model", ".ply") ||
         IsNameOfMap(name, "mesh", ".ply") || std::ranges::any_of(kTrajectoryNames, is_text);
}

bool IsDepthFile(std::string_view name) {
  if (name == kDepthCameraName) return true;
  const std::size_t dot = std::min(name.find('.'), name.size());
  constexpr std::size_t kMinDigits = 6;
  if (dot < kMinDigits || !IsNumber(name.substr(0, dot))) return false;
  return std::ranges::count(kDepthEndings, name.substr(dot)) > 0;
}

bool IsDepthPng16(const std::filesystem::path& path) {
  return path.string().ends_with(".depth16.png");
}
bool IsDepthScale(std::string_view name) { return name == kDepthScaleName; }

bool IsPng(std::string_view name) { return name.ends_with(".png"); }

bool IsSparseFile(std::string_view name) {
  return name == "cameras.txt" || name == "images.txt" || name == "points3D.txt" ||
         name == "cameras.bin" || name == "images.bin" || name == "points3D.bin";
}

// What mono3d-export writes into products/ of a run: of another model, once that is replaced.
constexpr std::string_view kProductFolder = "products";
bool IsProduct(std::string_view name) {
  return name == "model.las" || name == "model_local.ply" || name == "dsm.tif" ||
         name == "orthophoto.tif" || name == "contours.gpkg" || name == "mesh.glb" ||
         name == "mesh.obj" || name == "mesh.mtl" || name == "splats.ply" ||
         (name.starts_with("mesh_") && name.ends_with(".jpg"));
}
// The state of a run that is not whole (core/state_folder.h).
constexpr std::string_view kJournalFolder = "journal";
bool IsJournalFile(std::string_view name) {
  constexpr std::string_view kParts = "parts-";
  return name == "manifest" || (name.starts_with(kParts) && IsNumber(name.substr(kParts.size())));
}
bool IsNerfstudioFile(std::string_view name) {
  return name == "transforms.json" || name == "sparse.ply";
}
bool IsStereoSetting(std::string_view name) {
  return name == "fusion.cfg" || name == "patch-match.cfg";
}
bool IsStereoMap(std::string_view name) { return name.ends_with(".geometric.bin"); }
bool IsTiff(std::string_view name) { return name.ends_with(".tif"); }
bool IsPicture(std::string_view name) {
  return name.ends_with(".png") || name.ends_with(".jpg") || name.ends_with(".jpeg") ||
         name.ends_with(".JPG") || name.ends_with(".PNG");
}

// A folder of that name is the user's own.
bool IsFolder(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_directory(std::filesystem::symlink_status(path, ignored));
}

// Is a folder on the way to `folder` / `below` a link? What lies behind it is the user's own.
bool IsBehindLink(const std::filesystem::path& folder, const std::filesystem::path& below) {
  std::error_code ignored;
  std::filesystem::path way = folder;
  for (const std::filesystem::path& name : below) {
    way /= name;
    if (std::filesystem::is_symlink(way, ignored)) return true;
  }
  return false;
}

// The names in the folder; none where there is no such folder. Throws Error where they cannot be
// read: files that are left out would be taken for files of the user.
std::vector<std::string> NamesIn(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  std::error_code error;
  for (std::filesystem::directory_iterator it(folder, error), end; !error && it != end;
       it.increment(error)) {
    names.push_back(it->path().filename().string());
  }
  const bool is_there =
      error != std::errc::no_such_file_or_directory && error != std::errc::not_a_directory;
  if (error && is_there) ThrowSystemError("cannot read the folder", folder, error.value());
  return names;
}

// Adds the files of `folder` / `below` whose names match.
void AddMatching(const std::filesystem::path& folder, const std::filesystem::path& below,
                 bool (*matches)(std::string_view), std::vector<std::filesystem::path>& files) {
  if (IsBehindLink(folder, below)) return;
  for (const std::string& name : NamesIn(folder / below)) {
    const bool is_match = matches(WithoutEnding(name, ".partial").value_or(name));
    if (is_match && !IsFolder(folder / below / name)) files.push_back(below / name);
  }
}

// The folders sparse and sparse_mapN.
std::vector<std::string> SparseFolders(const std::filesystem::path& folder) {
  std::vector<std::string> models = NamesIn(folder);
  std::erase_if(models, [](const std::string& name) { return !IsNameOfMap(name, "sparse", ""); });
  return models;
}

}  // namespace

std::string NameOfMap(const std::string& stem, const std::string& extension, bool is_first,
                      int map_id) {
  return is_first ? stem + extension : stem + "_map" + std::to_string(map_id) + extension;
}

std::string NameOfCamera(std::size_t number) {
  return std::string(kCameraStem) + std::to_string(number) + ".yaml";
}

std::string DepthMapName(std::int64_t frame_index) {
  std::array<char, 32> name{};
  std::snprintf(name.data(), name.size(), "%06lld", static_cast<long long>(frame_index));
  return name.data();
}

std::vector<std::filesystem::path> FilesOfRun(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  AddMatching(folder, kDepthFolder, IsDepthFile, files);
  const bool has_png16 = std::ranges::any_of(files, IsDepthPng16);
  // Else it is of depth images that no run has written, as those of a sequence.
  if (has_png16) AddMatching(folder, kDepthFolder, IsDepthScale, files);
  AddMatching(folder, {}, IsRunFile, files);
  AddMatching(folder, kKeyframeImageFolder, IsPng, files);
  AddMatching(folder, kJournalFolder, IsJournalFile, files);
  const std::filesystem::path products = kProductFolder;
  AddMatching(folder, products, IsProduct, files);
  AddMatching(folder, products / "depth", IsTiff, files);
  AddMatching(folder, products / "nerfstudio", IsNerfstudioFile, files);
  AddMatching(folder, products / "nerfstudio" / "images", IsPicture, files);
  AddMatching(folder, products / "dense" / "images", IsPicture, files);
  AddMatching(folder, products / "dense" / "sparse", IsSparseFile, files);
  AddMatching(folder, products / "dense" / "stereo", IsStereoSetting, files);
  AddMatching(folder, products / "dense" / "stereo" / "depth_maps", IsStereoMap, files);
  AddMatching(folder, products / "dense" / "stereo" / "normal_maps", IsStereoMap, files);
  for (const std::string& model : SparseFolders(folder)) {
    AddMatching(folder, model, IsSparseFile, files);
  }
  for (const std::string& name : NamesOfPlacedImages(folder / kImagesOfRun)) {
    const std::filesystem::path image = std::filesystem::path(kImagesOfRun) / name;
    if (!IsFolder(folder / image)) files.push_back(image);
  }
  return files;
}

void RemoveRun(const std::filesystem::path& folder) {
  std::set<std::filesystem::path> folders;
  for (const std::filesystem::path& file : FilesOfRun(folder)) {
    RemoveRunFile(folder / file);
    for (auto below = file.parent_path(); !below.empty(); below = below.parent_path()) {
      folders.insert(below);
    }
  }
  std::error_code not_empty;
  // Those within others first.
  for (auto below = folders.rbegin(); below != folders.rend(); ++below) {
    std::filesystem::remove(folder / *below, not_empty);
  }
}

void RemoveRunFile(const std::filesystem::path& file) {
  std::error_code failure;
  std::filesystem::remove(file, failure);
  if (failure) {
    throw Error(ErrorParts{.what = "cannot remove the file of an earlier run",
                           .where = file.string(),
                           .expected = {},
                           .found = failure.message(),
                           .code = ErrorCode::kIo});
  }
}

}  // namespace mono3d
