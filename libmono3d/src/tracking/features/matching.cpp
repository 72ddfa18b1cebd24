// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/features/matching.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "tracking/optimisation/chi2.h"

namespace mono3d::tracking {
namespace {

// Keeps the members whose angle differs by one of the three most frequent amounts, in 30 bins.
template <typename Match, typename AngleOf>
void KeepCommonRotation(std::vector<Match>& matches, const AngleOf& angle_of) {
  constexpr int kBins = 30;  // of 12 degrees
  std::array<int, kBins> histogram{};
  std::vector<int> bins;
  for (const Match& match : matches) {
    const double turned = std::fmod(angle_of(match) + 720.0, 360.0);
    bins.push_back(static_cast<int>(turned * kBins / 360.0) % kBins);
    ++histogram[static_cast<std::size_t>(bins.back())];
  }
  std::array<int, kBins> order{};
  for (int i = 0; i < kBins; ++i) order[static_cast<std::size_t>(i)] = i;
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return histogram[static_cast<std::size_t>(a)] > histogram[static_cast<std::size_t>(b)];
  });
  std::array<char, kBins> is_common{};
  const int most = histogram[static_cast<std::size_t>(order[0])];
  for (std::size_t i = 0; i < 3; ++i) {
    const auto bin = static_cast<std::size_t>(order[i]);
    is_common[bin] = histogram[bin] * 10 > most ? 1 : 0;
  }
  std::size_t next = 0;
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (is_common[static_cast<std::size_t>(bins[i])] != 0) matches[next++] = matches[i];
  }
  matches.resize(next);
}

struct Nearest {
  std::size_t feature = 0;
  int distance = kDescriptorBits + 1;
  int level = 0;
  int second_distance = kDescriptorBits + 1;
  int second_level = 0;

  void Offer(std::size_t candidate, int candidate_distance, int candidate_level) {
    if (candidate_distance < distance) {
      second_distance = distance;
      second_level = level;
      feature = candidate;
      distance = candidate_distance;
      level = candidate_level;
    } else if (candidate_distance < second_distance) {
      second_distance = candidate_distance;
      second_level = candidate_level;
    }
  }
};

// The matches of `nearest` (of each feature in a) that hold in both directions and are unique.
std::vector<FeatureMatch> MutualMatches(const View& a, const View& b,
                                        const std::vector<Nearest>& nearest, double max_ratio,
                                        int max_distance) {
  std::vector<std::optional<std::size_t>> back(b.features.size());
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    if (nearest[i].distance > kDescriptorBits) continue;
    std::optional<std::size_t>& best = back[nearest[i].feature];
    if (!best || nearest[i].distance < nearest[*best].distance) best = i;
  }
  std::vector<FeatureMatch> matches;
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    const Nearest& found = nearest[i];
    if (found.distance > max_distance) continue;
    if (found.distance >= max_ratio * found.second_distance) continue;
    if (back[found.feature] == i) matches.push_back({i, found.feature});
  }
  KeepCommonRotation(matches, [&](const FeatureMatch& match) {
    return a.features[match.feature_a].angle_deg - b.features[match.feature_b].angle_deg;
  });
  return matches;
}

}  // namespace

std::vector<PointMatch> MatchProjected(std::span<const ProjectedPoint> projected, const View& view,
                                       const MatchRule& rule) {
  struct Proposal {
    PointMatch match;
    std::optional<double> angle_deg;
  };
  std::vector<std::optional<Proposal>> of_feature(view.features.size());
  std::vector<std::size_t> found;
  for (const ProjectedPoint& point : projected) {
    found.clear();
    view.grid.Find(point.pixel, point.radius_px, point.min_level, point.max_level, found);
    Nearest nearest;
    for (const std::size_t i : found) {
      if (!rule.take_occupied && view.points[i]) continue;
      const Feature& feature = view.features[i];
      nearest.Offer(i, Distance(point.descriptor, feature.descriptor), feature.level);
    }
    if (nearest.distance > rule.max_distance) continue;
    if (nearest.level == nearest.second_level &&
        nearest.distance > rule.max_ratio * nearest.second_distance) {
      continue;
    }
    std::optional<Proposal>& best = of_feature[nearest.feature];
    if (!best || nearest.distance < best->match.distance) {
      best = Proposal{{point.point, nearest.feature, nearest.distance}, point.angle_deg};
    }
  }
  std::vector<Proposal> turned;
  std::vector<PointMatch> matches;
  for (const std::optional<Proposal>& proposal : of_feature) {
    if (!proposal) continue;
    if (proposal->angle_deg) {
      turned.push_back(*proposal);
    } else {
      matches.push_back(proposal->match);
    }
  }
  KeepCommonRotation(turned, [&](const Proposal& proposal) {
    return *proposal.angle_deg - view.features[proposal.match.feature].angle_deg;
  });
  for (const Proposal& proposal : turned) matches.push_back(proposal.match);
  return matches;
}

std::optional<ProjectedPoint> ProjectMapPoint(const Map& map, PointId id, const View& view) {
  const MapPoint& point = map.point(id);
  const Eigen::Vector3d p_cam = view.T_cam_world * point.p_world;
  if (p_cam.z() <= 0) return std::nullopt;
  const Eigen::Vector2d pixel = view.shutter.Project(map.camera(), p_cam);
  if (!map.camera().Contains(pixel)) return std::nullopt;
  // A level's worth of tolerance on the distances at which the pyramid holds the patch.
  const double tolerance = map.scales().factor();
  const double distance = p_cam.norm();
  if (distance > tolerance * point.max_distance) return std::nullopt;
  if (distance * tolerance < point.min_distance) return std::nullopt;
  const Eigen::Vector3d towards_camera = -(view.T_cam_world.rotation().conjugate() * p_cam);
  const double cosine = towards_camera.dot(point.towards_cameras) / distance;
  if (cosine < 0.5) return std::nullopt;  // 60 degrees
  const int level = map.scales().Predict(distance, point.max_distance);
  constexpr double kFrontal = 0.998;  // within 3.6 degrees of what has been seen
  const double radius = (cosine > kFrontal ? 2.5 : 4.0) * map.scales().Scale(level);
  return ProjectedPoint{id, pixel, radius, level - 1, level, point.descriptor, std::nullopt};
}

bool ShowsAt(const CameraModel& camera, const View& view, const Eigen::Vector3d& p_cam,
             const Feature& feature) {
  const Eigen::Vector2d pixel = view.shutter.AtMiddleLine(camera, feature.pixel, p_cam);
  const double squared_error = (camera.Project(p_cam) - pixel).squaredNorm();
  return squared_error <= kChi2TwoDof * feature.sigma_px * feature.sigma_px;
}

std::vector<FeatureMatch> MatchDescriptors(const View& a, const std::vector<char>& use_a,
                                           const View& b, const std::vector<char>& use_b) {
  std::vector<Nearest> nearest(a.features.size());
  for (std::size_t i = 0; i < a.features.size(); ++i) {
    if (use_a[i] == 0) continue;
    for (std::size_t j = 0; j < b.features.size(); ++j) {
      if (use_b[j] == 0) continue;
      nearest[i].Offer(j, Distance(a.features[i].descriptor, b.features[j].descriptor), 0);
    }
  }
  return MutualMatches(a, b, nearest, kMaxDistanceRatio, kFarDistance);
}

std::vector<FeatureMatch> MatchNearby(const View& a, const View& b, const Window& window) {
  constexpr double kNearbyRatio = 0.9;  // the window has ruled most others out already
  std::vector<Nearest> nearest(a.features.size());
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < a.features.size(); ++i) {
    const Feature& feature = a.features[i];
    if (feature.level > window.max_level) continue;
    found.clear();
    b.grid.Find(feature.pixel + window.shift_px, window.radius_px, std::max(0, feature.level - 1),
                std::min(window.max_level, feature.level + 1), found);
    for (const std::size_t j : found) {
      nearest[i].Offer(j, Distance(feature.descriptor, b.features[j].descriptor), 0);
    }
  }
  return MutualMatches(a, b, nearest, kNearbyRatio, kCloseDistance);
}

}  // namespace mono3d::tracking
