// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "mono3d/keyframes/keyframe_selector.h"

namespace mono3d {

inline constexpr double kMedianDepth_su = 3;

// 65 by 51 degrees.
inline constexpr CameraModel kViewCamera = {640, 480, 500, 500, 319.5, 239.5, {}, {}};

// A keyframe and where the tracker has it.
struct PosedKeyframe {
  Keyframe keyframe;
  KeyframePose pose;
};

// A camera that has moved sideways by a share of the depth and turned about its vertical axis, so
// that it faces a wall. Lengths are in units of 1 / `scale`.
PosedKeyframe MakeKeyframe(std::int64_t id, double baseline_ratio, double rotation_deg = 0,
                           double scale = 1);

// The same camera held turned by `roll_deg` about its optical axis; the wall has no end.
PosedKeyframe MakeRolled(std::int64_t id, double baseline_ratio, double roll_deg);

// A camera at `T_world_cam` above the ground, the plane y = `height_su`, with the points of the
// ground that it sees up to 40 heights away.
PosedKeyframe MakeAboveGround(std::int64_t id, const Pose& T_world_cam, double height_su);

// A camera on a circle of radius kMedianDepth_su that looks at a ball in the middle.
PosedKeyframe MakeOnCircle(std::int64_t id, double angle_deg);

// A selector beside a tracker: hands each keyframe over with the poses of all.
class TrackedSelector {
 public:
  explicit TrackedSelector(const KeyframeSelectorOptions& options = {})
      : selector_(CreateKeyframeSelector(options)) {}

  std::optional<ImageBundle> Add(const PosedKeyframe& posed) {
    poses_.push_back(posed.pose);
    return selector_->Add(posed.keyframe, Poses());
  }
  std::vector<ImageBundle> Finish() { return selector_->Finish(Poses()); }
  // All bundles of these keyframes.
  std::vector<ImageBundle> Select(const std::vector<PosedKeyframe>& keyframes);

  KeyframePoses Poses() const { return {poses_.size(), poses_}; }

  // The world of all keyframes so far.
  void Move(const Similarity& S_new_old) {
    for (KeyframePose& pose : poses_) pose.S_world_kf = S_new_old * pose.S_world_kf;
  }
  void SetMap(int map_id) {
    for (KeyframePose& pose : poses_) pose.map_id = map_id;
  }

  KeyframeSelector* operator->() { return selector_.get(); }

 private:
  std::unique_ptr<KeyframeSelector> selector_;
  std::vector<KeyframePose> poses_;
};

using IdList = std::vector<std::int64_t>;

IdList Ids(const ImageBundle& bundle);
IdList References(const std::vector<ImageBundle>& bundles);

}  // namespace mono3d
