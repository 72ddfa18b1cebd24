// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "common/state_json.h"

#include <cstddef>
#include <cstdint>
#include <cstring>
#include <vector>

#include "mono3d/core/error.h"

namespace mono3d::tools {
namespace {

// Nothing but how deep it is.
class DepthCheck : public nlohmann::json_sax<nlohmann::json> {
 public:
  bool null() override { return true; }
  bool boolean(bool) override { return true; }
  bool number_integer(number_integer_t) override { return true; }
  bool number_unsigned(number_unsigned_t) override { return true; }
  bool number_float(number_float_t, const string_t&) override { return true; }
  bool string(string_t&) override { return true; }
  bool binary(binary_t&) override { return true; }
  bool key(string_t&) override { return true; }
  bool start_object(std::size_t) override { return ++depth_ <= kMaxDepth; }
  bool end_object() override { return --depth_ >= 0; }
  bool start_array(std::size_t) override { return ++depth_ <= kMaxDepth; }
  bool end_array() override { return --depth_ >= 0; }
  bool parse_error(std::size_t, const std::string&, const nlohmann::json::exception&) override {
    return false;
  }

 private:
  static constexpr int kMaxDepth = 64;
  int depth_ = 0;
};

}  // namespace

nlohmann::json StateFromCbor(const std::string& bytes) {
  DepthCheck check;
  if (!nlohmann::json::sax_parse(bytes, &check, nlohmann::json::input_format_t::cbor)) {
    throw Error("the journal is damaged: a part of it is no CBOR");
  }
  return nlohmann::json::from_cbor(bytes);
}

SavedPose ToSaved(const Pose& pose) {
  const Eigen::Quaterniond& q = pose.rotation();
  const Eigen::Vector3d& t = pose.translation();
  return {q.x(), q.y(), q.z(), q.w(), t.x(), t.y(), t.z()};
}

Pose FromSaved(const SavedPose& n) {
  return Pose(Eigen::Quaterniond(n[3], n[0], n[1], n[2]), Eigen::Vector3d(n[4], n[5], n[6]));
}

nlohmann::json CameraToJson(const CameraModel& camera) {
  return {{"size", {camera.width, camera.height}},
          {"pinhole", {camera.fx, camera.fy, camera.cx, camera.cy}},
          {"distortion", camera.distortion},
          {"is_fisheye", camera.lens == LensModel::kFisheye},
          {"readout_s", camera.shutter.readout_s},
          {"reads_columns", camera.shutter.reads_columns}};
}

CameraModel CameraFromJson(const nlohmann::json& json) {
  CameraModel camera;
  const nlohmann::json& pinhole = json.at("pinhole");
  camera.width = json.at("size").at(0).get<int>();
  camera.height = json.at("size").at(1).get<int>();
  camera.fx = pinhole.at(0).get<double>();
  camera.fy = pinhole.at(1).get<double>();
  camera.cx = pinhole.at(2).get<double>();
  camera.cy = pinhole.at(3).get<double>();
  json.at("distortion").get_to(camera.distortion);
  camera.lens = json.at("is_fisheye").get<bool>() ? LensModel::kFisheye : LensModel::kBrown;
  camera.shutter.readout_s = json.at("readout_s").get<double>();
  camera.shutter.reads_columns = json.at("reads_columns").get<bool>();
  return camera;
}

nlohmann::json ImageToJson(const cv::Mat& image) {
  const cv::Mat pixels = image.isContinuous() ? image : image.clone();
  const std::size_t num_bytes = pixels.total() * pixels.elemSize();
  std::vector<std::uint8_t> bytes(pixels.data, pixels.data + num_bytes);
  return {{"rows", image.rows},
          {"columns", image.cols},
          {"type", image.type()},
          {"pixels", nlohmann::json::binary(std::move(bytes))}};
}

cv::Mat ImageFromJson(const nlohmann::json& json) {
  const int rows = json.at("rows").get<int>();
  const int columns = json.at("columns").get<int>();
  const int type = json.at("type").get<int>();
  const std::vector<std::uint8_t>& bytes = json.at("pixels").get_binary();
  if (rows == 0 || columns == 0) return {};
  // A small picture of 8-bit or float channels, of which there are just so many bytes.
  const bool is_known = type == CV_8UC1 || type == CV_8UC3 || type == CV_32FC1;
  const std::size_t pixel_bytes = type == CV_8UC1 ? 1 : type == CV_8UC3 ? 3 : 4;
  const bool is_whole = is_known && rows > 0 && columns > 0 &&
                        bytes.size() == static_cast<std::size_t>(rows) *
                                            static_cast<std::size_t>(columns) * pixel_bytes;
  if (!is_whole) throw Error("the journal is damaged: an image is not whole");
  cv::Mat image(rows, columns, type);
  std::memcpy(image.data, bytes.data(), bytes.size());
  return image;
}

}  // namespace mono3d::tools
