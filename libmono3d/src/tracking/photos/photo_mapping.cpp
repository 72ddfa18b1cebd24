// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "tracking/photos/photo_mapping.h"

#include <algorithm>
#include <numeric>
#include <optional>
#include <utility>

#include "tracking/photos/photo_growth.h"
#include "tracking/photos/photo_joining.h"
#include "tracking/photos/photo_scene.h"
#include "tracking/reason.h"

namespace mono3d::tracking {
namespace {

// The points that each two photos with a pose share.
std::vector<std::vector<int>> CountShared(const PhotoScene& scene) {
  std::vector<std::vector<int>> shared(scene.num_photos(), std::vector<int>(scene.num_photos(), 0));
  for (const PhotoTrack& track : scene.tracks()) {
    if (!track.p_world) continue;
    for (const PhotoObservation& a : track.observations) {
      if (!a.fits) continue;
      for (const PhotoObservation& b : track.observations) {
        if (b.fits && a.photo != b.photo) ++shared[a.photo][b.photo];
      }
    }
  }
  return shared;
}

// As a walk goes: each is followed by the one left that shares most points with it; where none
// does, by the one that shares most with any before. Models grow best where they are.
std::vector<std::size_t> InOrderOfView(const PhotoScene& scene) {
  const std::vector<std::vector<int>> shared = CountShared(scene);
  std::vector<std::size_t> left = scene.posed();
  std::vector<std::size_t> order;
  std::vector<int> shared_with_any(scene.num_photos(), 0);
  while (!left.empty()) {
    const auto with_last = [&](std::size_t photo) {
      return order.empty() ? 0 : shared[order.back()][photo];
    };
    auto next = std::ranges::max_element(left, {}, with_last);
    if (with_last(*next) == 0) {
      next = std::ranges::max_element(left, {},
                                      [&](std::size_t photo) { return shared_with_any[photo]; });
    }
    const std::size_t photo = *next;
    left.erase(next);
    order.push_back(photo);
    for (const std::size_t other : left) {
      shared_with_any[other] = std::max(shared_with_any[other], shared[photo][other]);
    }
  }
  return order;
}

SparseModel SparseOfScene(const PhotoScene& scene, const std::vector<std::size_t>& photos) {
  SparseModel model;
  model.camera = scene.camera();
  std::vector<std::optional<std::size_t>> image_of(scene.num_photos());
  for (const std::size_t photo : photos) {
    image_of[photo] = model.images.size();
    SparseImage& image = model.images.emplace_back();
    image.id = static_cast<std::int64_t>(photo);
    image.T_world_cam = scene.T_cam_world(photo)->Inverse();
    const CameraVelocity& velocity = scene.shutter(photo).velocity();
    if (!(velocity == CameraVelocity())) image.velocity = velocity;
  }
  for (const PhotoTrack& track : scene.tracks()) {
    if (!track.p_world) continue;
    SparsePoint point{*track.p_world};
    for (const PhotoObservation& seen : track.observations) {
      if (!seen.fits) continue;
      const PhotoFeatures& features = scene.features(seen.photo);
      point.colour = features.colours[seen.feature];
      model.images[*image_of[seen.photo]].observations.push_back(
          {scene.Pixel(seen), model.points.size()});
    }
    model.points.push_back(point);
  }
  return model;
}

PhotoMap ToPhotoMap(const PhotoScene& scene) {
  PhotoMap map;
  const std::vector<std::size_t> photos = InOrderOfView(scene);
  for (const std::size_t photo : photos) {
    map.photos.push_back({photo, scene.T_cam_world(photo)->Inverse()});
  }
  map.sparse = SparseOfScene(scene, photos);
  return map;
}

// Why a photo is in no map, by its best pair.
std::string WhyUnplaced(const PhotoScene& scene, std::span<const PhotoPair> pairs,
                        std::size_t photo, const PhotoMapperOptions& options) {
  std::size_t most = 0;
  for (const PhotoPair& pair : pairs) {
    if (pair.a == photo || pair.b == photo) most = std::max(most, pair.matches.size());
  }
  if (static_cast<int>(scene.features(photo).size()) < options.min_matches) {
    return NeededText(static_cast<int>(scene.features(photo).size()), "features",
                      options.min_matches);
  }
  if (most == 0) return "no other photo shows the same";
  return "no pose explains what it shares with other photos (" + std::to_string(most) +
         " matches at most)";
}

}  // namespace

std::vector<std::size_t> OrderOfContent(const std::vector<PhotoFeatures>& photos) {
  std::vector<std::size_t> order(photos.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::stable_sort(order, {}, [&](std::size_t photo) { return photos[photo].digest; });
  return order;
}

PhotoMaps MapPhotos(const std::vector<PhotoFeatures>& photos, const std::vector<PhotoPair>& pairs,
                    const CameraModel& camera, const PhotoMapperOptions& options, double tolerance,
                    std::span<const PhotoTime> times) {
  PhotoMaps result;
  PhotoScene scene(camera, photos, pairs, options.min_parallax_deg);
  scene.SetTolerance(tolerance);
  std::vector<char> is_free(photos.size(), 1);
  std::string reason;
  std::vector<PlacedScene> placed;
  while (!options.IsStopped() && GrowPhotoMap(scene, pairs, is_free, times, options, reason) > 0) {
    placed.push_back(scene.Placed());
    for (const std::size_t photo : scene.posed()) is_free[photo] = 0;
  }
  if (!options.IsStopped()) JoinPhotoMaps(scene, placed, is_free, times, options);
  for (const PlacedScene& map : placed) {
    scene.Place(map);
    scene.Normalise(scene.posed().front());
    result.maps.push_back(ToPhotoMap(scene));
  }
  std::ranges::stable_sort(result.maps, [](const PhotoMap& l, const PhotoMap& r) {
    return l.photos.size() > r.photos.size();
  });
  for (std::size_t i = 0; i < photos.size(); ++i) {
    std::string& why = result.reasons.emplace_back();
    if (is_free[i] == 0) continue;
    why = WhyUnplaced(scene, pairs, i, options);
    // Of all photos, why there is no start at all.
    if (result.maps.empty() && !reason.empty()) why = "no two photos make a start: " + reason;
    if (options.IsStopped()) why = "stopped before it was placed";
  }
  return result;
}

}  // namespace mono3d::tracking
