// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "io/colmap_images.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "io/text.h"
#include "io/trajectory_forms.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr std::size_t kNameWord = 9;  // IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME

// Names may have blanks in them: all from the tenth word on.
std::string NameOf(const std::vector<std::string_view>& words, const std::string& line) {
  const auto begin = static_cast<std::size_t>(words[kNameWord].data() - line.data());
  const auto& last = words.back();
  const auto end = static_cast<std::size_t>(last.data() - line.data()) + last.size();
  return line.substr(begin, end - begin);
}

Pose ParseColmapPose(const std::vector<std::string_view>& words, const std::string& where) {
  std::array<double, 7> v{};
  for (std::size_t i = 0; i < v.size(); ++i) v[i] = ParsePoseValue(words[i + 1], where);
  const Eigen::Quaterniond rotation(v[0], v[1], v[2], v[3]);
  RequireUnitLength(rotation, where);
  const Pose T_cam_world(rotation, Eigen::Vector3d(v[4], v[5], v[6]));
  const Pose T_world_cam = T_cam_world.Inverse();
  if (!T_world_cam.translation().allFinite()) {
    throw Error(ErrorParts{.what = "the camera of an image is too far away",
                           .where = where,
                           .expected = "a position below 1e300",
                           .found = ToText(T_cam_world.translation().lpNorm<Eigen::Infinity>())});
  }
  return T_world_cam;
}

// The line behind each image: triples X Y POINT3D_ID, or nothing.
std::vector<ColmapObservation> ParseObservations(const std::vector<std::string_view>& words,
                                                 const std::string& where) {
  if (words.size() % 3 != 0) {
    throw Error(ErrorParts{.what = "bad line of points behind an image",
                           .where = where,
                           .expected = "triples X Y POINT3D_ID",
                           .found = std::to_string(words.size()) + " words"});
  }
  std::vector<ColmapObservation> observations;
  for (std::size_t i = 0; i < words.size(); i += 3) {
    const std::optional<double> x = ParseNumber(words[i]);
    const std::optional<double> y = ParseNumber(words[i + 1]);
    const std::optional<std::int64_t> id = ParseInteger(words[i + 2]);
    if (!x || !y || !id) {
      throw Error(ErrorParts{.what = "bad point behind an image",
                             .where = where,
                             .expected = "numbers X Y POINT3D_ID",
                             .found = std::string(words[i]) + " " + std::string(words[i + 1]) +
                                      " " + std::string(words[i + 2])});
    }
    observations.push_back({{*x, *y}, *id});
  }
  return observations;
}

}  // namespace

bool IsColmapImage(const std::vector<std::string_view>& words) {
  return words.size() > kNameWord && ParseInteger(words[0]) && ParseInteger(words[kNameWord - 1]) &&
         std::all_of(words.begin() + 1, words.begin() + kNameWord - 1,
                     [](std::string_view word) { return ParseNumber(word).has_value(); }) &&
         !ParseNumber(words[kNameWord]);
}

std::vector<ColmapImage> ParseColmapImages(const std::filesystem::path& path,
                                           const std::vector<std::string>& lines) {
  std::vector<ColmapImage> images;
  bool points_are_next = false;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::vector<std::string_view> words = Words(lines[i]);
    if (!words.empty() && words[0].starts_with('#')) continue;
    const std::string where = AtLine(path, i + 1);
    // Some tools leave out the lines of points, or the empty ones among them.
    const bool is_image = IsColmapImage(words);
    if (points_are_next && !is_image) {
      images.back().observations = ParseObservations(words, where);
      points_are_next = false;
      continue;
    }
    if (words.empty()) continue;
    if (!is_image) {
      throw Error(ErrorParts{.what = "bad line of an image",
                             .where = where,
                             .expected =
                                 "IMAGE_ID QW QX QY QZ TX TY TZ CAMERA_ID NAME, all but the name "
                                 "numbers",
                             .found = std::to_string(words.size()) + " words"});
    }
    images.push_back({*ParseInteger(words[0]),
                      *ParseInteger(words[kNameWord - 1]),
                      ParseColmapPose(words, where),
                      NameOf(words, lines[i]),
                      where,
                      {}});
    points_are_next = true;
  }
  return images;
}

}  // namespace mono3d
