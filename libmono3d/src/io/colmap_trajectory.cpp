// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <optional>

#include "io/colmap_images.h"
#include "io/text.h"
#include "io/trajectory_forms.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

// The last run of digits in the stem of the name.
std::optional<std::size_t> NumberInName(const std::string& name) {
  const std::string stem = std::filesystem::path(name).stem();
  const auto is_digit = [](unsigned char c) { return std::isdigit(c) != 0; };
  const auto end = std::find_if(stem.rbegin(), stem.rend(), is_digit);
  const auto begin = std::find_if_not(end, stem.rend(), is_digit);
  const std::optional<std::int64_t> number = ParseInteger(std::string(begin.base(), end.base()));
  if (!number) return std::nullopt;
  return static_cast<std::size_t>(*number);
}

double TimeOfImage(const std::string& name, const TrajectoryTimes& times,
                   const std::string& where) {
  const auto known = times.time_of_image_s.find(name);
  if (known != times.time_of_image_s.end()) return known->second;
  const std::optional<std::size_t> number = NumberInName(name);
  if (!number) {
    throw Error(ErrorParts{.what = "no time for an image",
                           .where = where,
                           .expected = "a number in its name",
                           .found = name});
  }
  return TimeOfPose(*number, times, where);
}

}  // namespace

std::vector<StampedPose> ParseColmapTrajectory(const std::filesystem::path& path,
                                               const std::vector<std::string>& lines,
                                               const TrajectoryTimes& times) {
  std::vector<StampedPose> poses;
  for (const ColmapImage& image : ParseColmapImages(path, lines)) {
    poses.push_back({TimeOfImage(image.name, times, image.where), image.T_world_cam});
  }
  return poses;
}

}  // namespace mono3d
