// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/anchor_map.h"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "fusion/state_archive.h"
#include "fusion/surfel.h"

namespace mono3d {
namespace {

// How far a motion takes what the view looks at from where another one takes it, over its depth.
double Apart(const PlacedAnchor& view, const Similarity& a, const Similarity& b) {
  return (a * Centre(view) - b * Centre(view)).norm() / view.median_depth();
}

bool IsSame(const Similarity& a, const Similarity& b) {
  return a.scale() == b.scale() && a.pose().translation() == b.pose().translation() &&
         a.pose().rotation().coeffs() == b.pose().rotation().coeffs();
}

// Exactly what it was where nothing moves it.
Similarity Times(const Similarity& motion, const Similarity& S_world_kf) {
  return IsSame(motion, Similarity()) ? S_world_kf : motion * S_world_kf;
}

template <typename Archive>
void ExchangeAnchor(Archive& archive, Anchor& anchor) {
  archive.Number(anchor.keyframe_id);
  archive.Number(anchor.frame_index);
  archive.Number(anchor.timestamp_s);
  ExchangeCamera(archive, anchor.camera);
  ExchangeSimilarity(archive, anchor.S_tracker_kf);
  anchor.depth_scale.Exchange(archive);
  archive.Number(anchor.median_depth_su);
  archive.Number(anchor.is_moved);
  ExchangeSimilarity(archive, anchor.S_tracker_kf_then);
  ExchangeSimilarity(archive, anchor.S_tracker_oldest_then);
}

}  // namespace

std::vector<int> AnchorMap::SubmapIds() const {
  std::vector<int> ids;
  for (const Submap& submap : submaps_) {
    if (!submap.empty()) ids.push_back(submap.id());
  }
  return ids;
}

std::vector<std::uint32_t> AnchorMap::Frames() const {
  std::vector<std::uint32_t> frames;
  for (const Anchor& anchor : anchors_) {
    frames.push_back(static_cast<std::uint32_t>(std::max<std::int64_t>(anchor.frame_index, 0)));
  }
  return frames;
}

void AnchorMap::Add(const Anchor& anchor, const Similarity& S_world_kf, int submap_id) {
  assert(submap_id <= NextSubmapId());
  if (submap_id == NextSubmapId()) submaps_.emplace_back(submap_id);
  const bool starts_part = empty() || SubmapOfLatest() != submap_id;
  const int part = empty() ? 0 : part_of_.back() + (starts_part ? 1 : 0);
  submaps_[static_cast<std::size_t>(submap_id)].Add(size(), S_world_kf);
  anchors_.push_back(anchor);
  S_world_kf_.push_back(S_world_kf);
  S_world_surfels_.push_back(S_world_kf);
  observers_.emplace_back();
  submap_of_.push_back(submap_id);
  part_of_.push_back(part);
  Anchor& added = anchors_.back();
  added.is_moved = !IsSame(S_world_kf, anchor.S_tracker_kf);
  added.S_tracker_kf_then = anchor.S_tracker_kf;
  added.S_tracker_oldest_then = anchors_.front().S_tracker_kf;
}

void AnchorMap::RemoveFrom(std::uint32_t first_anchor) {
  if (first_anchor >= size()) return;
  for (Submap& submap : submaps_) submap.RemoveFrom(first_anchor);
  anchors_.resize(first_anchor);
  S_world_kf_.resize(first_anchor);
  S_world_surfels_.resize(first_anchor);
  observers_.resize(first_anchor);
  for (Observers& observers : observers_) {
    std::erase_if(observers.kept, [&](const Observer& o) { return o.number >= first_anchor; });
  }
  submap_of_.resize(first_anchor);
  part_of_.resize(first_anchor);
}

void AnchorMap::Append(AnchorMap other) {
  const std::uint32_t first_anchor = size();
  const int first_id = NextSubmapId();
  const int first_part = empty() ? 0 : part_of_.back() + 1;
  for (Submap& submap : other.submaps_) {
    submap.Renumber(first_anchor, first_id);
    submaps_.push_back(std::move(submap));
  }
  for (std::uint32_t i = 0; i < other.size(); ++i) {
    anchors_.push_back(other.anchors_[i]);
    // From now on the oldest keyframe is another one.
    anchors_.back().S_tracker_kf_then = anchors_.back().S_tracker_kf;
    anchors_.back().S_tracker_oldest_then = anchors_.front().S_tracker_kf;
    S_world_kf_.push_back(other.S_world_kf_[i]);
    S_world_surfels_.push_back(other.S_world_surfels_[i]);
    for (Observer& observer : other.observers_[i].kept) observer.number += first_anchor;
    observers_.push_back(std::move(other.observers_[i]));
    submap_of_.push_back(other.submap_of_[i] + first_id);
    part_of_.push_back(other.part_of_[i] + first_part);
  }
}

Similarity AnchorMap::ModelFromTracker() const {
  return S_world_kf_.back() * anchors_.back().S_tracker_kf.Inverse();
}

std::optional<int> AnchorMap::MapIdBy(const KeyframePoses& poses) const {
  for (const Anchor& anchor : anchors_) {
    const KeyframePose* found = poses.Find(anchor.keyframe_id);
    if (found != nullptr) return found->map_id;
  }
  return std::nullopt;
}

// Anchors that the model has moved are expected to move as its oldest one does. Whether the
// tracker's new poses are nearer to that than to do both, its motion and the model's, since the
// model moved them.
bool AnchorMap::TrackerConverged(std::span<const std::optional<Similarity>> tracked) const {
  if (empty()) return false;
  const std::optional<Similarity>& oldest = tracked.front();
  double to_tracker = 0;
  double both = 0;
  for (std::uint32_t i = 0; i < size(); ++i) {
    const Anchor& anchor = anchors_[i];
    const std::optional<Similarity>& found = tracked[i];
    if (!found || !anchor.is_moved) continue;
    const Similarity tracker_motion = *found * anchor.S_tracker_kf_then.Inverse();
    const Similarity S_offset = anchor.S_tracker_kf.Inverse() * S_world_kf_[i];
    const Similarity S_world_then = anchor.S_tracker_kf_then * S_offset;
    const PlacedAnchor then{anchor, S_world_then};
    const Similarity expected =
        !oldest ? Similarity() : *oldest * anchor.S_tracker_oldest_then.Inverse();
    to_tracker += Apart(then, expected, *found * S_world_then.Inverse());
    both += Apart(then, expected, tracker_motion);
  }
  return to_tracker < both;
}

bool AnchorMap::Update(const KeyframePoses& poses, int map_id) {
  std::vector<std::optional<Similarity>> tracked;
  for (Anchor& anchor : anchors_) tracked.push_back(TrackedPose(poses, map_id, anchor));
  const bool to_tracker = TrackerConverged(tracked);
  std::vector<std::optional<Similarity>> motions(size());
  std::optional<Similarity> latest;
  for (std::uint32_t i = 0; i < size(); ++i) {
    Anchor& anchor = anchors_[i];
    const std::optional<Similarity>& found = tracked[i];
    if (!found) continue;
    if (IsSame(*found, anchor.S_tracker_kf) && !to_tracker) {
      motions[i] = Similarity();
    } else if (anchor.is_moved && !to_tracker) {
      motions[i] = *found * anchor.S_tracker_kf.Inverse();
    } else {
      motions[i] = *found * S_world_kf_[i].Inverse();
    }
    if (!latest) latest = motions[i];
    anchor.is_moved = anchor.is_moved && !to_tracker;
    anchor.S_tracker_kf = *found;
  }
  if (!latest) return false;
  bool has_moved = false;
  std::vector<bool> is_elsewhere(size());
  for (std::uint32_t i = 0; i < size(); ++i) {
    Anchor& anchor = anchors_[i];
    const bool is_known = motions[i].has_value();
    if (is_known) latest = motions[i];
    has_moved =
        has_moved || anchor.camera.fx * MotionOverDepth(Placed(i), *latest) >= kMinMotion_px;
    // Exactly the tracker's pose where the model has nothing to say: rounding must not add up.
    const Similarity S_world_kf =
        is_known && !anchor.is_moved ? anchor.S_tracker_kf : Times(*latest, S_world_kf_[i]);
    is_elsewhere[i] = !IsSame(S_world_kf, S_world_kf_[i]);
    if (is_elsewhere[i]) SetPlace(i, S_world_kf);
    if (!is_known) anchor.S_tracker_kf = Times(*latest, anchor.S_tracker_kf);
  }
  PlaceSurfelsOf(is_elsewhere);
  return has_moved;
}

void AnchorMap::SetPlace(std::uint32_t number, const Similarity& S_world_kf) {
  submaps_[static_cast<std::size_t>(submap_of_[number])].Place(number, S_world_kf);
  S_world_kf_[number] = S_world_kf;
}

void AnchorMap::MoveSubmap(int submap_id, const Similarity& motion) {
  Submap& submap = submaps_[static_cast<std::size_t>(submap_id)];
  submap.Move(motion);
  for (const std::uint32_t number : submap.anchors()) {
    S_world_kf_[number] = submap.S_world_kf(number);
    Anchor& anchor = anchors_[number];
    anchor.is_moved = true;
    anchor.S_tracker_kf_then = anchor.S_tracker_kf;
    anchor.S_tracker_oldest_then = anchors_.front().S_tracker_kf;
  }
  PlaceSurfelsOf(std::vector<bool>(size(), true));
}

void AnchorMap::LatestConfirmed(std::uint32_t number, double share, double own_share) {
  if (number + 1 == size() || share <= 0) return;
  Observers& observers = observers_[number];
  observers.own_share = own_share;
  if (observers.kept.size() >= kMaxObservers) return;
  observers.kept.push_back(
      {size() - 1, share, S_world_kf_.back().Inverse() * S_world_surfels_[number]});
}

// Where nothing has moved, not even rounding may.
void AnchorMap::PlaceSurfelsOf(const std::vector<bool>& is_elsewhere) {
  for (std::uint32_t i = 0; i < size(); ++i) {
    const bool has_moved =
        is_elsewhere[i] || std::ranges::any_of(observers_[i].kept, [&](const Observer& o) {
          return is_elsewhere[o.number];
        });
    if (has_moved) PlaceSurfels(i);
  }
}

// The mean of where the anchor and its observers have them, by weight: of the place at which the
// anchor looks, of the rotation, and of the logarithm of the scale. Unless they are its only
// observers', the share of each depth map differs from block to block; that of the anchor itself,
// by which blocks differ most, is right on average.
void AnchorMap::PlaceSurfels(std::uint32_t number) {
  const auto& [own_share, kept] = observers_[number];
  const Similarity& S_world_kf = S_world_kf_[number];
  double sum = 0;
  for (const Observer& observer : kept) sum += observer.weight;
  if (sum == 0) {
    S_world_surfels_[number] = S_world_kf;
    return;
  }
  const Eigen::Vector3d centre(0, 0, anchors_[number].median_depth_su);
  Eigen::Vector3d mean_centre = own_share * (S_world_kf * centre);
  Eigen::Vector4d mean_rotation = own_share * S_world_kf.pose().rotation().coeffs();
  double mean_log_scale = own_share * std::log(S_world_kf.scale());
  for (const Observer& observer : kept) {
    const double weight = (1 - own_share) * observer.weight / sum;
    const Similarity S = S_world_kf_[observer.number] * observer.S_kf_surfels;
    const Eigen::Vector4d q = S.pose().rotation().coeffs();
    mean_centre += weight * (S * centre);
    mean_rotation += (q.dot(mean_rotation) < 0 ? -weight : weight) * q;
    mean_log_scale += weight * std::log(S.scale());
  }
  const double scale = std::exp(mean_log_scale);
  const Eigen::Quaterniond rotation(Eigen::Vector4d(mean_rotation.normalized()));
  S_world_surfels_[number] =
      Similarity(scale, Pose(rotation, mean_centre - rotation * (scale * centre)));
}

void AnchorMap::JoinSubmaps(int submap_id, int other_id) {
  Submap& other = submaps_[static_cast<std::size_t>(other_id)];
  submaps_[static_cast<std::size_t>(submap_id)].TakeOver(other);
  for (const std::uint32_t number : other.anchors()) submap_of_[number] = submap_id;
  other.RemoveFrom(0);
}

bool AnchorMap::AreOnePart(std::uint32_t a, std::uint32_t b) const {
  const std::uint32_t gap = a > b ? a - b : b - a;
  return gap <= kMaxAnchorGap && part_of_[a] == part_of_[b];
}

std::vector<std::uint32_t> AnchorMap::EndOfOlderParts() const {
  std::vector<std::uint32_t> ends;
  for (std::uint32_t i = 0; i < size(); ++i) {
    std::uint32_t end = i;
    while (end > 0 && AreOnePart(end - 1, i)) --end;
    ends.push_back(end);
  }
  return ends;
}

template <typename Archive>
void AnchorMap::Exchange(Archive& archive) {
  archive.List(anchors_, [&](Anchor& anchor) { ExchangeAnchor(archive, anchor); });
  ExchangeSimilarities(archive, S_world_kf_);
  ExchangeSimilarities(archive, S_world_surfels_);
  archive.List(observers_, [&](Observers& observers) {
    archive.Number(observers.own_share);
    archive.List(observers.kept, [&](Observer& observer) {
      archive.Number(observer.number);
      archive.Number(observer.weight);
      ExchangeSimilarity(archive, observer.S_kf_surfels);
    });
  });
  archive.Array(submap_of_);
  archive.Array(part_of_);
  std::uint64_t num_submaps = submaps_.size();
  archive.Number(num_submaps);
  if constexpr (kIsReader<Archive>) {
    RequireSound(archive, num_submaps <= kMaxDepthMaps);
    submaps_.assign(num_submaps, Submap(0));
  }
  for (Submap& submap : submaps_) submap.Exchange(archive);
  RequireSound(archive, IsSound());
}

// Everything refers to something that is there.
bool AnchorMap::IsSound() const {
  const std::size_t num_anchors = anchors_.size();
  if (num_anchors > kMaxDepthMaps || S_world_kf_.size() != num_anchors ||
      S_world_surfels_.size() != num_anchors || observers_.size() != num_anchors ||
      submap_of_.size() != num_anchors || part_of_.size() != num_anchors) {
    return false;
  }
  for (const Observers& observers : observers_) {
    if (observers.kept.size() > kMaxObservers) return false;
    for (const Observer& observer : observers.kept) {
      if (observer.number >= num_anchors) return false;
    }
  }
  std::size_t num_in_submaps = 0;
  for (std::size_t id = 0; id < submaps_.size(); ++id) {
    if (submaps_[id].id() != static_cast<int>(id)) return false;
    for (const std::uint32_t number : submaps_[id].anchors()) {
      if (number >= num_anchors || submap_of_[number] != static_cast<int>(id)) return false;
      ++num_in_submaps;
    }
  }
  return num_in_submaps == num_anchors;
}

template void AnchorMap::Exchange(ByteWriter& archive);
template void AnchorMap::Exchange(ByteReader& archive);

}  // namespace mono3d
