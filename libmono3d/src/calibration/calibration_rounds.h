// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "calibration/camera_adjustment.h"
#include "calibration/footage_parts.h"
#include "calibration/velocity_shortfall.h"
#include "mono3d/calibration/camera_calibration.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/geometry/camera_prior.h"
#include "mono3d/image/camera_positions.h"
#include "mono3d/image/sparse_model.h"

namespace mono3d::calibration {

struct TrackedMaps {
  std::vector<SparseModel> maps;
  std::vector<CameraPositions> positions;  // of which map: map_id
  VelocityShortfall shortfall = {};        // unknown of images placed together
};

// The maps of parts of the footage, tracked with a camera and so many features of an image.
using TrackParts = std::function<TrackedMaps(
    const CameraModel& camera, const std::vector<FootagePart>& parts, int num_features)>;

// What rounds came to.
struct LearnedCamera {
  CameraCalibration calibration;
  bool is_settled = false;  // the last round changed the camera by no more than it is known
  double velocity_shortfall = 0;
};

// Tracks footage with the camera known so far, adjusts the camera to the maps, and begins again
// with that camera until it changes no more than it is known. A first round looks at one part,
// which only has to come near; those after it at all parts, then at longer ones where these tell
// too little of the focal length, then anew from the prior where it stays in doubt. What is told is
// compared with what the images say without it, and kept where they agree.
class CalibrationRounds {
 public:
  CalibrationRounds(const CameraPrior& prior, TrackParts track, FootageParts footage,
                    const CalibrationOptions& options);

  // To be called once.
  LearnedCamera Run();

 private:
  enum class Step { kDecide, kNextRound, kEnd };
  struct Change {
    bool is_lens_within_chance = false;
    bool is_readout_within_chance = false;
    double largest_px = 0;
  };
  // One whose camera is nearest to the one it was tracked with: what to believe when the rounds do
  // not settle. A round may start its map wrongly and end far off.
  struct SteadiestRound {
    double change_px = 0;
    CameraModel camera;
    CameraCalibration calibration;
  };

  bool LooksAtAll() const { return parts_ == footage_.all; }
  // Forgets the rounds before: those that follow have another weight or other parts.
  void Restart();
  bool DoRound();  // false: there is nothing more to find
  CameraAdjustment AdjustTracked();
  Step AfterNothingTracked();
  Change TakeAdjustment(const CameraAdjustment& adjustment);
  Step CompareWithTold(const CameraAdjustment& adjustment);
  // Where too little is known, and that has not been tried: the rounds that follow look at longer
  // parts, or begin with the prior. False: neither.
  bool LooksLonger();
  bool BeginsAnew(double change_px);
  // Of the two beginnings.
  void ChooseBetterBeginning();
  LearnedCamera Conclude();

  const CameraPrior prior_;
  const TrackParts track_;
  FootageParts footage_;
  const bool is_told_;

  int round_ = 0;
  int last_round_ = 0;
  CameraPrior weight_;  // that the adjustment gives to what is known
  CameraModel camera_;
  std::vector<FootagePart> parts_;
  // That a round was begun with, under the weight and with the parts of now: begun with the same
  // camera, one ends as that one did, and so do all that follow.
  std::vector<CameraModel> begun_with_;
  std::optional<CameraAdjustment> before_;
  std::optional<SteadiestRound> steadiest_;
  LearnedCamera learned_;
  bool was_settled_ = false;  // with the shorter parts
  // What the rounds before came to that knew little. Those after it begin with the prior and with
  // other features, so that their map starts otherwise.
  std::optional<LearnedCamera> doubtful_;
  // Of a camera that is told.
  bool lens_agrees_ = false;
  bool is_contradicted_ = false;  // by a round
  bool is_tried_again_ = false;   // with all parts, that knew less than was told
};

}  // namespace mono3d::calibration
