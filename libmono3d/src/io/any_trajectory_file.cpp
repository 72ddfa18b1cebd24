// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/any_trajectory_file.h"

#include <cmath>
#include <optional>
#include <string_view>

#include "io/colmap_images.h"
#include "io/text.h"
#include "io/trajectory_forms.h"
#include "mono3d/core/error.h"
#include "mono3d/io/trajectory_file.h"

namespace mono3d {
namespace {

constexpr std::size_t kNumTumValues = 8;
constexpr std::size_t kNumKittiValues = 12;

TrajectoryForm DetectForm(const std::filesystem::path& path,
                          const std::vector<std::string>& lines) {
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::vector<std::string_view> words = Words(lines[i]);
    if (words.empty() || words[0].starts_with('#')) continue;
    if (IsColmapImage(words)) return TrajectoryForm::kColmap;
    if (words.size() == kNumKittiValues) return TrajectoryForm::kKitti;
    if (words.size() == kNumTumValues) return TrajectoryForm::kTum;
    throw Error(ErrorParts{.what = "not a trajectory of a known form",
                           .where = AtLine(path, i + 1),
                           .expected = "8 values (TUM), 12 values (KITTI) or an image of COLMAP's "
                                       "images.txt",
                           .found = std::to_string(words.size()) + " words"});
  }
  return TrajectoryForm::kTum;
}

}  // namespace

void RequireUnitLength(const Eigen::Quaterniond& rotation, const std::string& where) {
  // Rounding each part to three digits changes the length by at most sqrt(4) * 0.0005.
  constexpr double kMaxLengthError = 1e-3;
  if (std::abs(rotation.norm() - 1) > kMaxLengthError) {
    throw Error(ErrorParts{.what = "quaternion of a pose is not of unit length",
                           .where = where,
                           .expected = "length 1",
                           .found = "length " + ToText(rotation.norm())});
  }
}

double ParsePoseValue(std::string_view word, const std::string& where) {
  const std::optional<double> number = ParseNumber(word);
  if (!number) {
    throw Error(ErrorParts{.what = "bad value in a pose",
                           .where = where,
                           .expected = "a finite number",
                           .found = std::string(word)});
  }
  return *number;
}

double TimeOfPose(std::size_t number, const TrajectoryTimes& times, const std::string& where) {
  if (times.timestamps_s.empty()) {
    if (!(times.fps > 0) || !std::isfinite(times.fps)) {
      throw UsageError({"bad frame rate of a trajectory", {}, "more than 0", ToText(times.fps)});
    }
    return static_cast<double>(number) / times.fps;
  }
  if (number >= times.timestamps_s.size()) {
    throw Error(ErrorParts{.what = "no time for a pose",
                           .where = where,
                           .expected = "a number below " +
                                       std::to_string(times.timestamps_s.size()) +
                                       ", as there are as many times",
                           .found = std::to_string(number)});
  }
  return times.timestamps_s[number];
}

TrajectoryForm DetectTrajectoryForm(const std::filesystem::path& path) {
  return DetectForm(path, ReadLines(path));
}

std::vector<StampedPose> ReadAnyTrajectory(const std::filesystem::path& path,
                                           const TrajectoryTimes& times) {
  const std::vector<std::string> lines = ReadLines(path);
  switch (DetectForm(path, lines)) {
    case TrajectoryForm::kKitti:
      return ParseKittiTrajectory(path, lines, times);
    case TrajectoryForm::kColmap:
      return ParseColmapTrajectory(path, lines, times);
    case TrajectoryForm::kTum:
      break;
  }
  return ReadTrajectory(path);
}

}  // namespace mono3d
