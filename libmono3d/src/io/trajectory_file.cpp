// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/io/trajectory_file.h"

#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "io/text.h"
#include "io/trajectory_forms.h"
#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"

namespace mono3d {
namespace {

constexpr std::size_t kNumFields = 8;
constexpr const char* kForm = "timestamp tx ty tz qx qy qz qw";

StampedPose ParseTumPose(const std::string& line, const std::string& where) {
  const std::vector<std::string_view> words = Words(line);
  if (words.size() != kNumFields) {
    throw Error(ErrorParts{.what = "wrong number of values in a pose",
                           .where = where,
                           .expected = std::to_string(kNumFields) + ": " + kForm,
                           .found = std::to_string(words.size())});
  }
  std::array<double, kNumFields> v{};
  for (std::size_t i = 0; i < kNumFields; ++i) {
    const std::optional<double> number = ParseNumber(words[i]);
    if (!number) {
      throw Error(ErrorParts{.what = "bad value in a pose",
                             .where = where,
                             .expected = "a finite number",
                             .found = std::string(words[i])});
    }
    v[i] = *number;
  }
  const Eigen::Quaterniond rotation(v[7], v[4], v[5], v[6]);
  RequireUnitLength(rotation, where);
  return {v[0], Pose(rotation, Eigen::Vector3d(v[1], v[2], v[3]))};
}

}  // namespace

std::vector<StampedPose> ReadTrajectory(const std::filesystem::path& path) {
  const std::vector<std::string> lines = ReadLines(path);
  std::vector<StampedPose> poses;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::vector<std::string_view> words = Words(lines[i]);
    if (words.empty() || words[0].starts_with('#')) continue;
    poses.push_back(ParseTumPose(lines[i], AtLine(path, i + 1)));
  }
  return poses;
}

void WriteTrajectory(const std::filesystem::path& path, const std::vector<StampedPose>& poses) {
  std::string text = std::string("# ") + kForm + "\n";
  for (const StampedPose& pose : poses) {
    const Eigen::Vector3d& t = pose.T_world_cam.translation();
    const Eigen::Quaterniond& q = pose.T_world_cam.rotation();
    text += ToText(pose.timestamp_s);
    for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) {
      text += ' ' + ToText(value);
    }
    text += '\n';
  }
  WriteFileAtomically(path, text);
}

}  // namespace mono3d
