// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/camera_file.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "io/colmap_cameras.h"
#include "io/text.h"
#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"

namespace mono3d {
namespace {

std::string LowerCase(std::string text) {
  std::ranges::transform(text, text.begin(),
                         [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  return text;
}

// The calibration in YAML, with the messages that go with it. Keys count in any case of letters.
class CalibrationYaml {
 public:
  explicit CalibrationYaml(const std::filesystem::path& path) : path_(path) {
    try {
      // Header "%YAML:1.0" and tags "!!opencv-matrix" of OpenCV are a directive and a type that
      // YAML does not know, which are to be passed over.
      for (const YAML::Node& document : YAML::LoadAll(ReadBytes(path))) AddKeys(document, "");
    } catch (const YAML::Exception& error) {
      Throw(LineAt(error.mark), "not YAML: " + error.msg, {}, {});
    }
  }

  int Size(const std::string& key) const {
    const std::vector<double> numbers = Numbers(key, Require(key).value);
    if (numbers.size() != 1 || numbers[0] < 1 || numbers[0] > 1e6 ||
        numbers[0] != std::floor(numbers[0])) {
      Throw(Line(key), "bad " + key, "one positive whole number", Text(keys_.at(key).value));
    }
    return static_cast<int>(numbers[0]);
  }

  // The numbers of a matrix: a list, or rows, cols and a list named data.
  std::vector<double> Matrix(const std::string& key) const {
    Require(key);
    const std::string data = keys_.contains(key + ".data") ? key + ".data" : key;
    const std::vector<double> numbers = Numbers(key, keys_.at(data).value);
    for (const char* part : {".rows", ".cols"}) {
      if (!keys_.contains(key + part)) return numbers;
    }
    const int num_numbers = Size(key + ".rows") * Size(key + ".cols");
    if (static_cast<std::size_t>(num_numbers) != numbers.size()) {
      Throw(Line(data), "wrong number of values in " + key, std::to_string(num_numbers),
            std::to_string(numbers.size()));
    }
    return numbers;
  }

  // The number of an optional key.
  std::optional<double> FindNumber(const std::string& key) const {
    if (!keys_.contains(key)) return std::nullopt;
    const std::vector<double> numbers = Numbers(key, Require(key).value);
    if (numbers.size() != 1) {
      Throw(Line(key), "bad " + key, "one number", Text(keys_.at(key).value));
    }
    return numbers[0];
  }

  // The text of an optional key.
  std::optional<std::string> Find(const std::string& key) const {
    if (!keys_.contains(key)) return std::nullopt;
    return Text(keys_.at(key).value);
  }

  // "camera.yaml:12"
  std::string Line(const std::string& key) const { return LineAt(keys_.at(key).mark); }

  [[noreturn]] static void Throw(const std::string& where, const std::string& what,
                                 const std::string& expected, const std::string& found,
                                 ErrorCode code = ErrorCode::kInvalidInput) {
    throw Error(ErrorParts{.what = "camera calibration: " + what,
                           .where = where,
                           .expected = expected,
                           .found = found,
                           .code = code});
  }

 private:
  struct Key {
    YAML::Mark mark;    // of the key itself, the last one where there are several
    int num_times = 0;  // that the key is there
    YAML::Node value;
  };

  // The keys of a map and of the maps in it, as "outer.inner".
  void AddKeys(const YAML::Node& map, const std::string& prefix) {
    if (!map.IsMap()) return;
    for (const auto& pair : map) {
      if (!pair.first.IsScalar()) continue;
      const std::string name = prefix + LowerCase(pair.first.Scalar());
      Key& key = keys_[name];
      key.mark = pair.first.Mark();
      ++key.num_times;
      key.value.reset(pair.second);  // = would change the document itself
      if (prefix.empty()) AddKeys(pair.second, name + ".");
    }
  }

  const Key& Require(const std::string& key) const {
    const auto found = keys_.find(key);
    if (found == keys_.end()) Throw(path_, "key is missing", key, {});
    const int num_times = found->second.num_times;
    if (num_times > 1) {
      Throw(Line(key), "several cameras in one file", key + " once", std::to_string(num_times));
    }
    return found->second;
  }

  std::string LineAt(const YAML::Mark& mark) const {
    return AtLine(path_, static_cast<std::size_t>(mark.line) + 1);
  }

  static std::string Text(const YAML::Node& value) {
    if (value.IsMap()) return "keys and values";
    if (value.IsSequence()) return "a list";
    return value.Scalar().empty() ? "nothing" : value.Scalar();
  }

  // Of a scalar, or of a list of such; none of any other value.
  std::vector<double> Numbers(const std::string& key, const YAML::Node& value) const {
    std::vector<double> numbers;
    const auto add = [&](const YAML::Node& item) {
      const std::optional<double> number =
          item.IsScalar() ? ParseNumber(item.Scalar()) : std::nullopt;
      if (!number) Throw(LineAt(item.Mark()), "bad value in " + key, "a finite number", Text(item));
      numbers.push_back(*number);
    };
    if (value.IsScalar()) add(value);
    if (value.IsSequence()) std::ranges::for_each(value, add);
    return numbers;
  }

  const std::filesystem::path& path_;
  std::map<std::string, Key> keys_;
};

void TakeCameraMatrix(const CalibrationYaml& yaml, CameraModel& camera) {
  const std::string key = "camera_matrix";
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
  const std::string key = "distortion_coefficients";
  camera.lens = LensOf(yaml);
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

}  // namespace

CameraModel ReadCameraFile(const std::filesystem::path& path) {
  const std::vector<std::string> lines = ReadLines(path);
  if (IsColmapCameras(lines)) return ParseColmapCameras(path, lines);
  const CalibrationYaml yaml(path);
  CameraModel camera;
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
