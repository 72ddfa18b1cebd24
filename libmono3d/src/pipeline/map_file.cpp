// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/map_file.h"

#include <array>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>

#include "io/binary_block.h"
#include "io/text.h"
#include "mono3d/core/error.h"
#include "mono3d/io/output_file.h"
#include "pipeline/world_continuation.h"

namespace mono3d {
namespace {

// Behind the tracker's bytes: scale, rotation (x y z w) and translation of S_axes_world as doubles,
// then this mark. A file without it, of an earlier version, has the tracker's axes.
constexpr std::string_view kAxesMark = "mono3d axes 1\n";
constexpr std::size_t kNumAxesValues = 8;
constexpr std::size_t kAxesBytes = kNumAxesValues * sizeof(double) + kAxesMark.size();

std::string AxesBytes(const Similarity& S) {
  const Eigen::Quaterniond& q = S.pose().rotation();
  const Eigen::Vector3d& t = S.pose().translation();
  const std::array<double, kNumAxesValues> values = {S.scale(), q.x(), q.y(), q.z(),
                                                     q.w(),     t.x(), t.y(), t.z()};
  std::string bytes;
  AppendBytes(bytes, values.data(), values.size());
  return bytes.append(kAxesMark);
}

Similarity ParseAxes(std::string_view bytes, const std::string& where) {
  std::array<double, kNumAxesValues> v{};
  std::memcpy(v.data(), bytes.data(), sizeof v);
  const Eigen::Quaterniond rotation(v[4], v[1], v[2], v[3]);
  const Eigen::Vector3d translation(v[5], v[6], v[7]);
  constexpr double kRounding = 1e-6;
  const bool is_similarity = v[0] > 0 && std::isfinite(v[0]) && translation.allFinite() &&
                             std::abs(rotation.norm() - 1) < kRounding;
  if (!is_similarity) {
    throw Error(
        ErrorParts{.what = "saved map: damaged axes", .where = where, .expected = {}, .found = {}});
  }
  return {v[0], Pose(rotation, translation)};
}

}  // namespace

void SaveMapFile(const Tracker& tracker, const std::filesystem::path& path,
                 const std::vector<TrajectoryEntry>& keyframes) {
  std::string bytes = tracker.SaveMap();
  if (!keyframes.empty()) {
    const WorldContinuation axes(keyframes, tracker.KeyframeTrajectory(), 0);
    bytes += AxesBytes(axes.Of(keyframes.front().map_id));
  }
  WriteFileAtomically(path, bytes);
}

WorldAxes LoadMapFile(Tracker& tracker, const std::filesystem::path& path) {
  const std::string bytes = ReadBytes(path);
  std::string_view of_tracker = bytes;
  WorldAxes axes;
  if (of_tracker.size() > kAxesBytes && of_tracker.ends_with(kAxesMark)) {
    axes.S_axes_world = ParseAxes(of_tracker.substr(of_tracker.size() - kAxesBytes), path.string());
    axes.source = AxesSource::kSavedMap;
    of_tracker.remove_suffix(kAxesBytes);
  }
  tracker.LoadMap(of_tracker, path.string());
  return axes;
}

}  // namespace mono3d
