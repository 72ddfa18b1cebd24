// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "geo/position_pairs.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <string>

#include "mono3d/core/statistics.h"

namespace mono3d {
namespace {

// A position within one second of a flight can be interpolated to less than positions err by;
// between images that are further apart, to within three steps.
double LongestGap(std::span<const PositionedCamera> cameras) {
  constexpr double kShortest_s = 1;
  constexpr double kNumSteps = 3;
  std::vector<double> steps_s;
  for (std::size_t i = 1; i < cameras.size(); ++i) {
    steps_s.push_back(cameras[i].timestamp_s - cameras[i - 1].timestamp_s);
  }
  return std::max(kShortest_s, kNumSteps * UpperMedianOrZero(std::move(steps_s)));
}

}  // namespace

std::vector<bool> AreFrozen(const std::vector<PositionPair>& pairs, double scale, double far_m) {
  constexpr std::size_t kFewestRepeated = 3;
  std::vector<bool> are_frozen(pairs.size(), false);
  std::size_t first = 0;
  for (std::size_t i = 1; i <= pairs.size(); ++i) {
    const bool goes_on =
        i < pairs.size() && pairs[i].p_enu_m.head<2>() == pairs[first].p_enu_m.head<2>();
    if (goes_on) continue;
    const double moved_m = scale * (pairs[i - 1].p_map - pairs[first].p_map).norm();
    if (i - first >= kFewestRepeated && moved_m > far_m) {
      for (std::size_t k = first + 1; k < i; ++k) are_frozen[k] = true;
    }
    first = i;
  }
  return are_frozen;
}

PositionPairs::PositionPairs(std::span<const PositionedCamera> cameras, const PositionTrack& track)
    : cameras_(cameras), track_(track), longest_gap_s_(LongestGap(cameras)) {
  for (const PositionedCamera& camera : cameras) {
    path_.push_back({camera.timestamp_s, camera.T_map_cam.translation()});
  }
  FindPlaces();
}

void PositionPairs::FindPlaces() {
  const std::vector<PositionFix>& fixes = track_.fixes;
  if (fixes.empty()) return;
  const auto has_altitude = [](const PositionFix& fix) { return fix.altitude_m.has_value(); };
  const auto has_height = [](const PositionFix& fix) { return fix.height_m.has_value(); };
  has_altitude_ = std::ranges::all_of(fixes, has_altitude);
  const bool has_heights = std::ranges::all_of(fixes, has_height);
  has_vertical_ = has_altitude_ || has_heights;
  double take_off_m = 0;  // above the ellipsoid or the sea
  if (has_altitude_ && has_heights) {
    std::vector<double> differences_m;
    for (const PositionFix& fix : fixes) differences_m.push_back(*fix.altitude_m - *fix.height_m);
    take_off_m = UpperMedianOrZero(std::move(differences_m));
  }
  const auto altitude_of = [&](const PositionFix& fix) {
    if (has_heights) return take_off_m + *fix.height_m;
    return has_altitude_ ? *fix.altitude_m : 0.0;
  };
  origin_ = {fixes.front().latitude_deg, fixes.front().longitude_deg, altitude_of(fixes.front())};
  for (const PositionFix& fix : fixes) {
    p_enu_m_.push_back(ToEnu({fix.latitude_deg, fix.longitude_deg, altitude_of(fix)}, origin_));
  }
}

std::vector<PositionPair> PositionPairs::At(double clock_offset_s) const {
  if (track_.clock == PositionClock::kImages) return ByName();
  std::vector<PositionPair> pairs;
  std::size_t after = 1;  // the first camera behind the fix
  for (std::size_t i = 0; i < track_.fixes.size() && !cameras_.empty(); ++i) {
    const double time_s = track_.fixes[i].time_s + clock_offset_s;
    if (time_s < cameras_.front().timestamp_s) continue;
    while (after < cameras_.size() && cameras_[after].timestamp_s < time_s) ++after;
    if (after >= cameras_.size()) break;
    if (!IsAcrossGap(after)) pairs.push_back(Interpolated(i, time_s, after));
  }
  return pairs;
}

std::vector<PositionPair> PositionPairs::ByName() const {
  std::map<std::string, const PositionedCamera*, std::less<>> camera_of;
  for (const PositionedCamera& camera : cameras_) camera_of.emplace(camera.image, &camera);
  std::vector<PositionPair> pairs;
  double first_s = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < track_.fixes.size(); ++i) {
    const PositionFix& fix = track_.fixes[i];
    const auto camera = camera_of.find(fix.image);
    if (camera == camera_of.end()) continue;
    const Pose& pose = camera->second->T_map_cam;
    const double order = camera->second->timestamp_s;
    pairs.push_back({i, track_.has_image_times ? fix.time_s : order, p_enu_m_[i],
                     pose.translation(), Eigen::Vector3d::Zero(), pose.rotation(),
                     std::llround(order)});
    first_s = std::min(first_s, fix.time_s);
  }
  if (track_.has_image_times) {
    for (PositionPair& pair : pairs) pair.time_s -= first_s;
  }
  std::ranges::stable_sort(pairs, {}, &PositionPair::time_s);
  return pairs;
}

bool PositionPairs::IsAcrossGap(std::size_t after) const {
  return cameras_[after].timestamp_s - cameras_[after - 1].timestamp_s > longest_gap_s_;
}

Eigen::Vector3d PositionPairs::CentreAt(double time_s) const {
  return PointOnPath(path_, time_s).p;
}

PositionPair PositionPairs::Interpolated(std::size_t fix, double time_s, std::size_t after) const {
  // Over less time the errors of single poses count.
  constexpr double kVelocityTime_s = 0.5;
  const double first_s = std::max(time_s - kVelocityTime_s, cameras_.front().timestamp_s);
  const double last_s = std::min(time_s + kVelocityTime_s, cameras_.back().timestamp_s);
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();
  if (last_s > first_s) velocity = (CentreAt(last_s) - CentreAt(first_s)) / (last_s - first_s);
  const bool is_nearer_after =
      cameras_[after].timestamp_s - time_s < time_s - cameras_[after - 1].timestamp_s;
  const Pose& nearest = cameras_[is_nearer_after ? after : after - 1].T_map_cam;
  return {fix, time_s, p_enu_m_[fix], CentreAt(time_s), velocity, nearest.rotation()};
}

}  // namespace mono3d
