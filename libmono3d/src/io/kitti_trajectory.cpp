// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include <Eigen/LU>

#include "io/text.h"
#include "io/trajectory_forms.h"
#include "mono3d/core/error.h"

namespace mono3d {
namespace {

constexpr std::size_t kNumValues = 12;
// The files of the benchmark print six digits.
constexpr double kMaxRotationError = 1e-3;

Pose ParseKittiPose(const std::vector<std::string_view>& words, const std::string& where) {
  Eigen::Matrix<double, 3, 4> matrix;
  for (std::size_t i = 0; i < kNumValues; ++i) {
    matrix(static_cast<Eigen::Index>(i / 4), static_cast<Eigen::Index>(i % 4)) =
        ParsePoseValue(words[i], where);
  }
  const Eigen::Matrix3d rotation = matrix.leftCols<3>();
  const double deviation =
      (rotation.transpose() * rotation - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (deviation > kMaxRotationError || rotation.determinant() < 0) {
    throw Error(ErrorParts{.what = "the left 3x3 of a pose is not a rotation",
                           .where = where,
                           .expected = "columns of unit length at right angles, determinant 1",
                           .found = "determinant " + ToText(rotation.determinant()) +
                                    ", columns off by " + ToText(deviation)});
  }
  return {rotation, matrix.col(3)};
}

}  // namespace

std::vector<StampedPose> ParseKittiTrajectory(const std::filesystem::path& path,
                                              const std::vector<std::string>& lines,
                                              const TrajectoryTimes& times) {
  std::vector<StampedPose> poses;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    const std::vector<std::string_view> words = Words(lines[i]);
    if (words.empty() || words[0].starts_with('#')) continue;
    const std::string where = AtLine(path, i + 1);
    if (words.size() != kNumValues) {
      throw Error(ErrorParts{.what = "wrong number of values in a pose",
                             .where = where,
                             .expected = "12: a 3x4 matrix row by row",
                             .found = std::to_string(words.size())});
    }
    poses.push_back({TimeOfPose(poses.size(), times, where), ParseKittiPose(words, where)});
  }
  return poses;
}

}  // namespace mono3d
