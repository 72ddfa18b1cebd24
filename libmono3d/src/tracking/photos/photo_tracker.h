// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mono3d/tracking/photo_mapper.h"
#include "tracking/photos/photo_features.h"
#include "tracking/photos/photo_mapping.h"
#include "tracking/positions/map_positions.h"

namespace mono3d::tracking {

// See CreatePhotoMapper.
class PhotoTracker final : public Tracker {
 public:
  PhotoTracker(const PhotoMapperOptions& options, StageTimes* times);

  TrackingResult Track(const Frame& frame) override;
  KeyframePosesPtr Poses() const override;
  // Places all photos; and moves those of the maps whose positions were told since.
  void WaitForMapping() override;
  void FollowPositions(const CameraPositions& positions) override { positions_.Set(positions); }
  std::vector<PositionFit> PositionFits() const override { return positions_.Fits(); }
  std::vector<Keyframe> Finish() override;
  std::vector<LateResult> LateResults() const override { return late_results_; }
  std::vector<TrajectoryEntry> Trajectory() const override { return trajectory_; }
  std::vector<TrajectoryEntry> KeyframeTrajectory() const override { return trajectory_; }
  SparseModel Sparse(int map_id) const override;

 private:
  void BringInOrder();
  void Place();
  std::vector<PhotoPair> Match(const std::vector<PhotoFeatures>& features) const;
  PhotoMaps PlaceBy(const std::vector<PhotoFeatures>& features,
                    const std::vector<PhotoPair>& pairs) const;
  bool AreSomeLeft(const std::vector<bool>& may_come) const;
  // In place of those so far where more photos hang together.
  void TakeLarger(PhotoMaps maps, std::string_view by);
  void PlaceByMoreMatches(std::vector<PhotoPair> pairs);
  void PlaceByMoreFeatures();
  bool FollowNewPositions();
  void Publish();

  PhotoMapperOptions options_;
  StageTimes* times_;
  std::vector<Frame> frames_;
  std::vector<PhotoFeatures> features_;  // of each
  std::optional<PhotoMaps> placed_;      // the ids of their images are those of frames
  MapPositions positions_;
  mutable std::mutex mutex_;  // of poses_
  KeyframePosesPtr poses_ = std::make_shared<const KeyframePoses>();
  std::vector<TrajectoryEntry> trajectory_;  // by frame
  std::vector<LateResult> late_results_;
  std::vector<SparseModel> sparse_;  // of each map
};

}  // namespace mono3d::tracking
