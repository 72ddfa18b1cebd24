// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/colmap_model.h"

#include <algorithm>
#include <map>
#include <string_view>
#include <vector>

#include "io/colmap_binary.h"
#include "io/colmap_cameras.h"
#include "io/colmap_images.h"
#include "io/text.h"
#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"

namespace mono3d {
namespace {

// From a corner of the top-left pixel to its centre.
constexpr double kHalfPixel = 0.5;

std::string Joined(std::initializer_list<double> numbers) {
  std::string text;
  for (const double number : numbers) text += " " + ToText(number + 0.0);  // never "-0"
  return text;
}

// The images of the camera at a position name it by this.
std::string CameraId(std::size_t position) { return std::to_string(position + 1); }

std::string CameraText(const CameraModel& camera, std::size_t position) {
  const ColmapCamera form = ToColmapCamera(camera);
  std::string text = CameraId(position) + " " + form.model + " " + std::to_string(camera.width) +
                     " " + std::to_string(camera.height);
  for (const double param : form.params) text += Joined({param});
  return text + "\n";
}

std::string CamerasText(const SparseModel& model) {
  std::string text =
      "# Camera list with one line of data per camera:\n"
      "#   CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  text += CameraText(model.camera, 0);
  for (std::size_t i = 0; i < model.further_cameras.size(); ++i) {
    text += CameraText(model.further_cameras[i], i + 1);
  }
  return text;
}

std::string ImagesText(const SparseModel& model) {
  std::string text =
      "# Image list with two lines of data per image:\n"
      "#   IMAGE_ID, QW, QX, QY, QZ, TX, TY, TZ, CAMERA_ID, NAME\n"
      "#   POINTS2D[] as (X, Y, POINT3D_ID)\n";
  for (const SparseImage& image : model.images) {
    const Pose T_cam_world = image.T_world_cam.Inverse();
    const Eigen::Quaterniond& q = T_cam_world.rotation();
    const Eigen::Vector3d& t = T_cam_world.translation();
    text += std::to_string(image.id + 1) +
            Joined({q.w(), q.x(), q.y(), q.z(), t.x(), t.y(), t.z()}) + " " +
            CameraId(image.camera) + " " + image.name + "\n";
    std::string separator;
    for (const SparseObservation& observation : image.observations) {
      text += separator + ToText(observation.pixel.x() + kHalfPixel) + " " +
              ToText(observation.pixel.y() + kHalfPixel) + " " +
              (observation.point ? std::to_string(*observation.point + 1) : "-1");
      separator = " ";
    }
    text += "\n";
  }
  return text;
}

std::string PointsText(const SparseModel& model) {
  std::vector<std::string> tracks(model.points.size());
  for (const SparseImage& image : model.images) {
    for (std::size_t i = 0; i < image.observations.size(); ++i) {
      const std::optional<std::size_t>& point = image.observations[i].point;
      if (point) tracks[*point] += " " + std::to_string(image.id + 1) + " " + std::to_string(i);
    }
  }
  const std::vector<double> errors_px = ReprojectionErrors_px(model);
  std::string text =
      "# 3D point list with one line of data per point:\n"
      "#   POINT3D_ID, X, Y, Z, R, G, B, ERROR, TRACK[] as (IMAGE_ID, POINT2D_IDX)\n";
  for (std::size_t i = 0; i < model.points.size(); ++i) {
    const SparsePoint& point = model.points[i];
    text +=
        std::to_string(i + 1) + Joined({point.p_world.x(), point.p_world.y(), point.p_world.z()});
    for (const std::uint8_t channel : point.colour) text += " " + std::to_string(channel);
    text += Joined({errors_px[i]}) + tracks[i] + "\n";
  }
  return text;
}

[[noreturn]] void RefusePoint(const std::string& where, const std::string& found) {
  throw Error(ErrorParts{.what = "bad line of a point",
                         .where = where,
                         .expected = "POINT3D_ID X Y Z R G B ERROR TRACK[], all numbers",
                         .found = found});
}

// The points of a points3D.txt, and which id each has.
std::map<std::int64_t, std::size_t> ReadPoints(const std::filesystem::path& path,
                                               std::vector<SparsePoint>& points) {
  constexpr std::size_t kNumPointWords = 8;  // then the track, which the images repeat
  const std::vector<std::string> lines = ReadLines(path);
  std::map<std::int64_t, std::size_t> position_of_id;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::vector<std::string_view> words = Words(lines[i]);
    if (words.empty() || words[0].starts_with('#')) continue;
    const std::string where = AtLine(path, i + 1);
    if (words.size() < kNumPointWords) RefusePoint(where, std::to_string(words.size()) + " words");
    const std::optional<std::int64_t> id = ParseInteger(words[0]);
    if (!id) RefusePoint(where, std::string(words[0]));
    SparsePoint point;
    for (std::size_t k = 0; k < 3; ++k) {
      const std::optional<double> coordinate = ParseNumber(words[1 + k]);
      const std::optional<std::int64_t> channel = ParseInteger(words[4 + k]);
      if (!coordinate || !channel) RefusePoint(where, lines[i].substr(0, 80));
      point.p_world[static_cast<Eigen::Index>(k)] = *coordinate;
      point.colour.at(k) = static_cast<std::uint8_t>(std::clamp<std::int64_t>(*channel, 0, 255));
    }
    if (!position_of_id.emplace(*id, points.size()).second) RefusePoint(where, "an id twice");
    points.push_back(point);
  }
  return position_of_id;
}

// Where there is only one camera, all images are taken for its own, whatever they name.
std::size_t PositionOfCamera(const std::map<std::int64_t, std::size_t>& position_of_camera,
                             const ColmapImage& image) {
  if (position_of_camera.size() == 1) return 0;
  const auto found = position_of_camera.find(image.camera_id);
  if (found != position_of_camera.end()) return found->second;
  throw Error(ErrorParts{.what = "image of a camera that cameras.txt does not have",
                         .where = image.where,
                         .expected = {},
                         .found = std::to_string(image.camera_id)});
}

}  // namespace

void WriteColmapModel(const std::filesystem::path& folder, const SparseModel& model) {
  Validate(model);
  CreateOutputFolder(folder);
  WriteFileAtomically(folder / "cameras.txt", CamerasText(model));
  WriteFileAtomically(folder / "images.txt", ImagesText(model));
  WriteFileAtomically(folder / "points3D.txt", PointsText(model));
  WriteColmapBinary(folder, model);
}

SparseModel ReadColmapModel(const std::filesystem::path& folder) {
  SparseModel model;
  const std::filesystem::path cameras = folder / "cameras.txt";
  const std::vector<std::string> camera_lines = ReadLines(cameras);
  if (!IsColmapCameras(camera_lines)) {
    throw Error(ErrorParts{.what = "no camera in the file",
                           .where = cameras,
                           .expected = "CAMERA_ID MODEL WIDTH HEIGHT PARAMS[]",
                           .found = {}});
  }
  std::map<std::int64_t, std::size_t> position_of_camera;
  for (const auto& [id, camera] : ParseAllColmapCameras(cameras, camera_lines)) {
    const std::size_t position = position_of_camera.size();
    position_of_camera.emplace(id, position);
    if (position == 0) {
      model.camera = camera;
    } else {
      model.further_cameras.push_back(camera);
    }
  }
  const auto position_of_id = ReadPoints(folder / "points3D.txt", model.points);
  const std::filesystem::path images = folder / "images.txt";
  for (const ColmapImage& from : ParseColmapImages(images, ReadLines(images))) {
    SparseImage& image = model.images.emplace_back();
    image.id = from.id - 1;
    image.name = from.name;
    image.T_world_cam = from.T_world_cam;
    image.camera = PositionOfCamera(position_of_camera, from);
    for (const ColmapObservation& seen : from.observations) {
      SparseObservation& observation = image.observations.emplace_back();
      observation.pixel = seen.pixel - Eigen::Vector2d(kHalfPixel, kHalfPixel);
      if (seen.point_id < 0) continue;
      const auto position = position_of_id.find(seen.point_id);
      if (position == position_of_id.end()) {
        throw Error(ErrorParts{.what = "image shows a point that points3D.txt does not have",
                               .where = from.where,
                               .expected = {},
                               .found = std::to_string(seen.point_id)});
      }
      observation.point = position->second;
    }
  }
  Validate(model);
  return model;
}

}  // namespace mono3d
