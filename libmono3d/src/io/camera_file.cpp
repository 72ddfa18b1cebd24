// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/camera_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <system_error>
#include <vector>

#include "io/calibration_yaml.h"
#include "io/camera_forms.h"
#include "io/colmap_cameras.h"
#include "io/image_names.h"
#include "io/input_advice.h"
#include "io/text.h"
#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"

namespace mono3d {
namespace {

void TakeCameraMatrix(const CalibrationYaml& yaml, CameraModel& camera) {
  const std::string key = yaml.FirstOf({"cameramatrix", "camera_matrix"});
  const std::vector<double> K = yaml.Matrix(key);
  if (K.size() != 9) {
    yaml.Throw(yaml.Line(key), "wrong number of values in " + key, "9", std::to_string(K.size()));
  }
  const bool is_pinhole = K[1] == 0 && K[3] == 0 && K[6] == 0 && K[7] == 0 && K[8] == 1;
  if (!is_pinhole) {
    yaml.Throw(yaml.Line(key), "bad form of " + key, "fx 0 cx 0 fy cy 0 0 1", "another matrix");
  }
  camera.fx = K[0];
  camera.cx = K[2];
  camera.fy = K[4];
  camera.cy = K[5];
}

constexpr const char* kFisheyeModel = "equidistant";  // as ROS calls it

// By the key of ROS, or by that of OpenCV's calibration program.
LensModel LensOf(const CalibrationYaml& yaml) {
  const std::string by_ros = "distortion_model";
  const std::string by_opencv = "fisheye_model";
  const std::optional<std::string> name = yaml.Find(by_ros);
  if (name) {
    if (*name == kFisheyeModel || *name == "fisheye") return LensModel::kFisheye;
    if (*name == "plumb_bob" || *name == "rational_polynomial") return LensModel::kBrown;
    yaml.Throw(yaml.Line(by_ros), "unsupported distortion model", "plumb_bob or equidistant", *name,
               ErrorCode::kUnsupported);
  }
  const bool is_fisheye = yaml.FindNumber(by_opencv).value_or(0) != 0;
  return is_fisheye ? LensModel::kFisheye : LensModel::kBrown;
}

void TakeDistortion(const CalibrationYaml& yaml, CameraModel& camera) {
  const std::string key = yaml.FirstOf({"distcoeffs", "dist_coeffs", "distortion_coefficients"});
  camera.lens = LensOf(yaml);
  if (!yaml.Has(key)) return;  // none
  const bool is_fisheye = camera.lens == LensModel::kFisheye;
  const std::size_t max_coefficients = is_fisheye ? 4 : camera.distortion.size();
  const std::vector<double> coefficients = yaml.Matrix(key);
  if (coefficients.size() < 4) {
    yaml.Throw(yaml.Line(key), "wrong number of values in " + key,
               is_fisheye ? "k1 k2 k3 k4" : "k1 k2 p1 p2 [k3]",
               std::to_string(coefficients.size()));
  }
  for (std::size_t i = 0; i < coefficients.size(); ++i) {
    if (i < max_coefficients) {
      camera.distortion[i] = coefficients[i];
    } else if (coefficients[i] != 0) {
      yaml.Throw(yaml.Line(key), "unsupported distortion",
                 is_fisheye ? "zeros after k1 k2 k3 k4" : "zeros after k1 k2 p1 p2 k3",
                 ToText(coefficients[i]), ErrorCode::kUnsupported);
    }
  }
}

constexpr const char* kLineDelay = "line_delay_s";
constexpr const char* kReadoutDirection = "readout_direction";

int NumLines(const CameraModel& camera) {
  return camera.shutter.reads_columns ? camera.width : camera.height;
}

void TakeShutter(const CalibrationYaml& yaml, CameraModel& camera) {
  const std::string direction = yaml.Find(kReadoutDirection).value_or("down");
  const bool is_backwards = direction == "up" || direction == "left";
  camera.shutter.reads_columns = direction == "right" || direction == "left";
  if (direction != "down" && !is_backwards && !camera.shutter.reads_columns) {
    yaml.Throw(yaml.Line(kReadoutDirection), std::string("bad ") + kReadoutDirection,
               "down, up, right or left", direction);
  }
  const double delay_s = yaml.FindNumber(kLineDelay).value_or(0);
  const double readout_s = std::abs(delay_s) * (NumLines(camera) - 1);
  camera.shutter.readout_s = is_backwards || delay_s < 0 ? -readout_s : readout_s;
  if (camera.shutter.IsGlobal()) camera.shutter = {};
}

// From a line to the next: where there is such a number, the one that makes just the readout time
// when it is multiplied.
double LineDelay_s(const CameraModel& camera) {
  const double readout_s = camera.shutter.readout_s;
  const int num_delays = NumLines(camera) - 1;
  const double delay_s = readout_s / num_delays;
  for (const double near_s : {std::nextafter(delay_s, 0.0), std::nextafter(delay_s, readout_s)}) {
    if (delay_s * num_delays != readout_s && near_s * num_delays == readout_s) return near_s;
  }
  return delay_s;
}

// Nothing of a global shutter.
std::string ShutterText(const CameraModel& camera) {
  const RollingShutter& shutter = camera.shutter;
  if (shutter.IsGlobal() || NumLines(camera) < 2) return "";
  const bool is_backwards = shutter.readout_s < 0;
  const std::string direction =
      shutter.reads_columns ? (is_backwards ? "left" : "right") : (is_backwards ? "up" : "down");
  return std::string(kLineDelay) + ": " + ToText(LineDelay_s(camera)) + "\n" + kReadoutDirection +
         ": " + direction + "\n";
}

// What is given by mistake, before a video is read as text.
void RequireNoImages(const std::filesystem::path& path) {
  std::error_code ignored;
  const bool is_folder = std::filesystem::is_directory(path, ignored);
  const bool is_file = std::filesystem::is_regular_file(path, ignored);
  const bool is_image = is_file && (HasImageExtension(path) || IsOtherPhoto(path));
  const bool is_video = is_file && IsVideoName(path);
  if (!is_folder && !is_image && !is_video) return;
  throw Error(ErrorParts{
      .what = "cannot read it as a calibration; images or a video are the input, with no option "
              "before them",
      .where = path,
      .expected = "a file such as camera.yaml",
      .found = is_folder  ? "a folder"
               : is_image ? "an image"
                          : "a video",
      .code = is_folder ? ErrorCode::kIo : ErrorCode::kInvalidInput});
}

}  // namespace

CameraModel ReadCameraFile(const std::filesystem::path& path) {
  RequireNoImages(path);
  const std::string bytes = ReadBytes(path);
  if (IsColmapBinaryCameras(bytes)) return ParseColmapBinaryCameras(path, bytes);
  const std::vector<std::string> lines = ReadLines(path);
  if (IsColmapCameras(lines)) return ParseColmapCameras(path, lines);
  const CalibrationYaml yaml(path);
  CameraModel camera;
  for (const auto parse : {ParseKalibr, ParseOrbSlam, ParseNerfstudio}) {
    const std::optional<CameraModel> found = parse(yaml);
    if (!found) continue;
    Validate(*found, path);
    return *found;
  }
  camera.width = yaml.Size("image_width");
  camera.height = yaml.Size("image_height");
  TakeCameraMatrix(yaml, camera);
  TakeDistortion(yaml, camera);
  TakeShutter(yaml, camera);
  Validate(camera, path);
  return camera;
}

void WriteCameraFile(const std::filesystem::path& path, const CameraModel& camera) {
  const auto matrix = [](int rows, int cols, const std::vector<double>& values) {
    std::string text = "!!opencv-matrix\n   rows: " + std::to_string(rows) +
                       "\n   cols: " + std::to_string(cols) + "\n   dt: d\n   data: [ ";
    for (std::size_t i = 0; i < values.size(); ++i) text += (i > 0 ? ", " : "") + ToText(values[i]);
    return text + " ]\n";
  };
  const auto& k = camera.distortion;
  const std::string distortion =
      camera.lens == LensModel::kFisheye
          ? std::string("distortion_model: ") + kFisheyeModel +
                "\ndistortion_coefficients: " + matrix(1, 4, {k[0], k[1], k[2], k[3]})
          : "distortion_coefficients: " + matrix(1, 5, {k[0], k[1], k[2], k[3], k[4]});
  WriteFileAtomically(
      path, "%YAML:1.0\n---\nimage_width: " + std::to_string(camera.width) +
                "\nimage_height: " + std::to_string(camera.height) + "\ncamera_matrix: " +
                matrix(3, 3, {camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1}) +
                distortion + ShutterText(camera));
}

}  // namespace mono3d
