// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "fusion/anchor.h"
#include "fusion/submap.h"
#include "mono3d/image/keyframe_poses.h"

namespace mono3d {

// The anchors of a model by their numbers, in the order of fusion, in their submaps.
class AnchorMap {
 public:
  std::uint32_t size() const { return static_cast<std::uint32_t>(anchors_.size()); }
  bool empty() const { return anchors_.empty(); }
  const Anchor& anchor(std::uint32_t number) const { return anchors_[number]; }
  const Anchor& back() const { return anchors_.back(); }
  // Of the depth map of each.
  std::vector<std::uint32_t> Frames() const;
  // Where the keyframe of each is in the world.
  const std::vector<Similarity>& S_world_kf() const { return S_world_kf_; }
  // Where its surfels are: with the keyframe, until keyframes move against each other. What later
  // depth maps had confirmed is a mean of what they all saw, and moves as the mean of them.
  const std::vector<Similarity>& S_world_surfels() const { return S_world_surfels_; }
  PlacedAnchor Placed(std::uint32_t number) const {
    return {anchors_[number], S_world_kf_[number]};
  }

  int SubmapOf(std::uint32_t number) const { return submap_of_[number]; }
  int SubmapOfLatest() const { return submap_of_.back(); }
  // Ids of those that have anchors, oldest first.
  std::vector<int> SubmapIds() const;
  int num_submaps() const { return static_cast<int>(SubmapIds().size()); }
  // An id that no submap has had.
  int NextSubmapId() const { return static_cast<int>(submaps_.size()); }

  // The next anchor, of the submap of this id, existing or the next one. The model has moved it
  // where `S_world_kf` is not the tracker's.
  void Add(const Anchor& anchor, const Similarity& S_world_kf, int submap_id);
  // The latest anchor has confirmed a share of the surfels of this one, 0 to 1. Of what is known of
  // these by now, `own_share` is what the anchor itself has seen.
  void LatestConfirmed(std::uint32_t number, double share, double own_share);
  void RemoveFrom(std::uint32_t first_anchor);
  // Behind these. Its submaps become further ones.
  void Append(AnchorMap other);

  // Where the tracker's world around the latest anchor lies in the model's.
  Similarity ModelFromTracker() const;
  // The map of the tracker in which the keyframes are by `poses`, where it knows one of them.
  std::optional<int> MapIdBy(const KeyframePoses& poses) const;
  // Brings the anchors to the tracker's poses of now, those of map `map_id`. One whose keyframe is
  // not among them moves with the nearest one before it that is, else after it. Where the model had
  // moved anchors away from the tracker's poses, they keep that motion, unless the tracker has
  // converged to it: then its new poses are theirs, or it would be done twice. Returns whether one
  // has moved noticeably, by kMinMotion_px of its image. O(anchors).
  bool Update(const KeyframePoses& poses, int map_id);

  // By a motion of the world.
  void MoveSubmap(int submap_id, const Similarity& motion);
  // `other` becomes a part of `submap`, where it is.
  void JoinSubmaps(int submap_id, int other_id);

  // Per anchor: older ones up to this number, exclusive, are of another part of the model, whose
  // surfels may lie upon its own. Depth maps so near to each other in order as kMaxAnchorGap, of
  // one submap, were merged when they were fused.
  std::vector<std::uint32_t> EndOfOlderParts() const;
  bool AreOnePart(std::uint32_t a, std::uint32_t b) const;

  // For a saved state; see state_archive.h.
  template <typename Archive>
  void Exchange(Archive& archive);

  // A fifth of the half pixel of noise that a depth map's matching has: less shows nowhere.
  static constexpr double kMinMotion_px = 0.1;
  static constexpr std::uint32_t kMaxAnchorGap = 3;
  // The first depth maps that confirm surfels of an anchor follow it in the flight, and see the
  // same part of them. Those that come back later, from elsewhere, see another: with 32
  // observers 6.4 % of the surfels were off by more than 2 % of the depth after a corrected loop,
  // with 3, 6 and 10 it were 2.1, 1.9 and 1.9 %.
  static constexpr std::size_t kMaxObservers = 8;

 private:
  // A depth map that has seen surfels of an anchor.
  struct Observer {
    std::uint32_t number = 0;
    double weight = 1;
    Similarity S_kf_surfels;  // as it saw them
  };

  // The depth maps that have seen surfels of an anchor.
  struct Observers {
    double own_share = 1;        // of all that is known: what the anchor has seen itself
    std::vector<Observer> kept;  // the others
  };

  void PlaceSurfelsOf(const std::vector<bool>& is_elsewhere);
  void PlaceSurfels(std::uint32_t number);
  void SetPlace(std::uint32_t number, const Similarity& S_world_kf);
  bool IsSound() const;
  bool TrackerConverged(std::span<const std::optional<Similarity>> tracked) const;

  std::vector<Anchor> anchors_;
  std::vector<Similarity> S_world_kf_;
  std::vector<Similarity> S_world_surfels_;
  std::vector<Observers> observers_;  // per anchor
  std::vector<int> submap_of_;
  std::vector<int> part_of_;     // anchors of one part follow each other
  std::vector<Submap> submaps_;  // by id
};

}  // namespace mono3d
