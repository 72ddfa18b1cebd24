// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/colmap_cameras.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <optional>
#include <string_view>

#include "io/text.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// A camera line begins with CAMERA_ID MODEL WIDTH HEIGHT.
constexpr std::size_t kNumCameraWords = 4;
// Nobody has larger images; keeps a wild number from overflowing.
constexpr double kMaxImageSide_px = 1e6;

struct Model {
  std::string_view name;
  std::size_t num_focal_lengths;  // then cx cy
  // k1 k2 p1 p2 k3 k4 k5 k6, of a fisheye lens k1 k2 k3 k4: as many as there are.
  std::size_t num_distortion;
  LensModel lens = LensModel::kBrown;
};

constexpr std::array<Model, 9> kModels = {{{"SIMPLE_PINHOLE", 1, 0},
                                           {"PINHOLE", 2, 0},
                                           {"SIMPLE_RADIAL", 1, 1},
                                           {"RADIAL", 1, 2},
                                           {"OPENCV", 2, 4},
                                           {"FULL_OPENCV", 2, 8},
                                           {"SIMPLE_RADIAL_FISHEYE", 1, 1, LensModel::kFisheye},
                                           {"RADIAL_FISHEYE", 1, 2, LensModel::kFisheye},
                                           {"OPENCV_FISHEYE", 2, 4, LensModel::kFisheye}}};

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
  camera.width = static_cast<int>(std::clamp(values[0], 0.0, kMaxImageSide_px));
  camera.height = static_cast<int>(std::clamp(values[1], 0.0, kMaxImageSide_px));
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

}  // namespace mono3d
