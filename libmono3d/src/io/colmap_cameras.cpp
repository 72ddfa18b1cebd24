// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/colmap_cameras.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <optional>
#include <string_view>

#include "io/text.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// A camera line begins with CAMERA_ID MODEL WIDTH HEIGHT.
constexpr std::size_t kNumCameraWords = 4;
// Of a JPEG file; nobody has larger images.
constexpr double kMaxImageSide_px = 65535;

struct Model {
  std::string_view name;
  std::int32_t id;                // in binary files
  std::size_t num_focal_lengths;  // then cx cy
  // k1 k2 p1 p2 k3 k4 k5 k6, of a fisheye lens k1 k2 k3 k4: as many as there are.
  std::size_t num_distortion;
  LensModel lens = LensModel::kBrown;
};

constexpr std::array<Model, 9> kModels = {{{"SIMPLE_PINHOLE", 0, 1, 0},
                                           {"PINHOLE", 1, 2, 0},
                                           {"SIMPLE_RADIAL", 2, 1, 1},
                                           {"RADIAL", 3, 1, 2},
                                           {"OPENCV", 4, 2, 4},
                                           {"FULL_OPENCV", 6, 2, 8},
                                           {"SIMPLE_RADIAL_FISHEYE", 8, 1, 1, LensModel::kFisheye},
                                           {"RADIAL_FISHEYE", 9, 1, 2, LensModel::kFisheye},
                                           {"OPENCV_FISHEYE", 5, 2, 4, LensModel::kFisheye}}};

[[noreturn]] void ThrowBadCamera(const std::string& where, const std::string& what,
                                 const std::string& expected, const std::string& found,
                                 ErrorCode code = ErrorCode::kInvalidInput) {
  throw Error(ErrorParts{.what = "camera calibration: " + what,
                         .where = where,
                         .expected = expected,
                         .found = found,
                         .code = code});
}

bool IsComment(const std::vector<std::string_view>& words) {
  return words.empty() || words[0].starts_with('#');
}

const Model& FindModel(std::string_view name, const std::string& where) {
  const auto found = std::find_if(kModels.begin(), kModels.end(),
                                  [&](const Model& model) { return model.name == name; });
  if (found == kModels.end()) {
    std::string names;
    for (const Model& model : kModels) {
      const bool is_last = model.name == kModels.back().name;
      names += (names.empty() ? "" : is_last ? " or " : ", ") + std::string(model.name);
    }
    ThrowBadCamera(where, "unsupported camera model", names, std::string(name),
                   ErrorCode::kUnsupported);
  }
  return *found;
}

CameraModel ParseCamera(const std::vector<std::string_view>& words, const std::string& where) {
  if (words.size() < kNumCameraWords) {
    ThrowBadCamera(where, "incomplete camera", "CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]",
                   std::to_string(words.size()) + " values");
  }
  const Model& model = FindModel(words[1], where);
  const std::size_t num_params = model.num_focal_lengths + 2 + model.num_distortion;
  if (words.size() != kNumCameraWords + num_params) {
    ThrowBadCamera(where, "wrong number of parameters of a " + std::string(model.name) + " camera",
                   std::to_string(num_params), std::to_string(words.size() - kNumCameraWords));
  }
  std::vector<double> values;
  for (std::size_t i = 2; i < words.size(); ++i) {
    const std::optional<double> value = ParseNumber(words[i]);
    if (!value) ThrowBadCamera(where, "bad value", "a finite number", std::string(words[i]));
    values.push_back(*value);
  }
  CameraModel camera;
  camera.lens = model.lens;
  for (std::size_t i = 0; i < 2; ++i) {
    if (values[i] > kMaxImageSide_px || values[i] != std::floor(values[i])) {
      ThrowBadCamera(where, "bad size of the image", "whole numbers up to 65535",
                     std::string(words[2 + i]));
    }
  }
  camera.width = static_cast<int>(std::max(values[0], 0.0));
  camera.height = static_cast<int>(std::max(values[1], 0.0));
  const double* params = values.data() + 2;
  camera.fx = params[0];
  camera.fy = params[model.num_focal_lengths - 1];
  params += model.num_focal_lengths;
  camera.cx = params[0] - 0.5;
  camera.cy = params[1] - 0.5;
  params += 2;
  for (std::size_t i = 0; i < model.num_distortion; ++i) {
    if (i < camera.distortion.size()) {
      camera.distortion[i] = params[i];
    } else if (params[i] != 0) {
      ThrowBadCamera(where, "unsupported distortion", "k4 = k5 = k6 = 0", ToText(params[i]),
                     ErrorCode::kUnsupported);
    }
  }
  Validate(camera, where);
  return camera;
}

}  // namespace

ColmapCamera ToColmapCamera(const CameraModel& camera) {
  constexpr double kToCentre = 0.5;  // from a corner of the top-left pixel to its centre
  const auto [k1, k2, p1, p2, k3] = camera.distortion;
  ColmapCamera result;
  result.params = {camera.fx, camera.fy, camera.cx + kToCentre, camera.cy + kToCentre};
  const bool is_fisheye = camera.lens == LensModel::kFisheye;  // whose k3 and k4 are p1 and p2
  result.model = is_fisheye                ? "OPENCV_FISHEYE"
                 : !camera.HasDistortion() ? "PINHOLE"
                 : k3 == 0                 ? "OPENCV"
                                           : "FULL_OPENCV";
  if (camera.HasDistortion()) result.params.insert(result.params.end(), {k1, k2, p1, p2});
  if (k3 != 0) result.params.insert(result.params.end(), {k3, 0, 0, 0});
  result.model_id = FindModel(result.model, {}).id;
  return result;
}

bool IsColmapCameras(const std::vector<std::string>& lines) {
  for (const std::string& line : lines) {
    const std::vector<std::string_view> words = Words(line);
    if (IsComment(words)) continue;
    return words.size() >= 2 && ParseInteger(words[0]) &&
           std::all_of(words[1].begin(), words[1].end(), [](unsigned char c) {
             return std::isupper(c) != 0 || std::isdigit(c) != 0 || c == '_';
           });
  }
  return false;
}

std::map<std::int64_t, CameraModel> ParseAllColmapCameras(const std::filesystem::path& path,
                                                          const std::vector<std::string>& lines) {
  std::map<std::int64_t, CameraModel> cameras;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::vector<std::string_view> words = Words(lines[i]);
    if (IsComment(words)) continue;
    const std::string where = AtLine(path, i + 1);
    const std::optional<std::int64_t> id = ParseInteger(words[0]);
    if (!id) ThrowBadCamera(where, "bad id", "a whole number", std::string(words[0]));
    if (!cameras.emplace(*id, ParseCamera(words, where)).second) {
      ThrowBadCamera(where, "two cameras of one id", {}, std::string(words[0]));
    }
  }
  return cameras;
}

CameraModel ParseColmapCameras(const std::filesystem::path& path,
                               const std::vector<std::string>& lines) {
  std::optional<CameraModel> camera;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::vector<std::string_view> words = Words(lines[i]);
    if (IsComment(words)) continue;
    if (camera) {
      ThrowBadCamera(AtLine(path, i + 1), "several cameras in one file", "one camera",
                     "a second one");
    }
    camera = ParseCamera(words, AtLine(path, i + 1));
  }
  return camera.value();  // IsColmapCameras has seen one
}

bool IsColmapBinaryCameras(std::string_view bytes) {
  // The number of cameras in 8 bytes, of which text has none that is 0.
  return bytes.size() >= sizeof(std::uint64_t) && bytes.substr(0, 8).ends_with(std::string(4, 0));
}

CameraModel ParseColmapBinaryCameras(const std::filesystem::path& path, std::string_view bytes) {
  const auto take = [&]<typename T>(T value) {
    if (bytes.size() < sizeof value) ThrowBadCamera(path, "the file is truncated", {}, {});
    std::memcpy(&value, bytes.data(), sizeof value);
    bytes.remove_prefix(sizeof value);
    return value;
  };
  const auto num_cameras = take(std::uint64_t{});
  if (num_cameras != 1) {
    ThrowBadCamera(path, "several cameras in one file", "one camera", std::to_string(num_cameras));
  }
  const auto id = take(std::uint32_t{});
  const auto model_id = take(std::int32_t{});
  const auto found = std::ranges::find(kModels, model_id, &Model::id);
  if (found == kModels.end()) FindModel("number " + std::to_string(model_id), path);
  // In the words of the text form.
  std::string line = std::to_string(id) + " " + std::string(found->name);
  line += " " + std::to_string(take(std::uint64_t{}));
  line += " " + std::to_string(take(std::uint64_t{}));
  const std::size_t num_params = found->num_focal_lengths + 2 + found->num_distortion;
  for (std::size_t i = 0; i < num_params; ++i) line += " " + ToText(take(double{}));
  return ParseCamera(Words(line), path);
}

}  // namespace mono3d
