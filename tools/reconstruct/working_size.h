// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include "mono3d/core/options.h"
#include "mono3d/geometry/camera_model.h"
#include "mono3d/io/frame_source.h"
#include "reconstruct/footage.h"

namespace mono3d::tools {

// The size at which large images are worked on. What is written of the images themselves, images/
// and sparse/, is of those that were taken.
struct WorkingSize {
  // Of the longer side. The time and the memory that a model takes grow with the area. A quarter of
  // 3840 and half of 1920: at 960 a video of a drone keeps up with the camera on two cores, and its
  // images are sharp and have little of what compression makes. Photographs, of which there are
  // few, are sharper: 1600. --best doubles both.
  static constexpr int kAutomatic = -1;
  int max_side_px = kAutomatic;  // 0: no limit
  bool is_doubled = false;       // not among the listed options: --best sets it

  void Visit(OptionVisitor& visit);
  void Validate() const;  // throws UsageError

  // `source` with the limit for such footage, where no size is asked for. Says on stdout that
  // images of `camera` are made smaller.
  FrameSourceOptions Limit(FrameSourceOptions source, Footage footage,
                           const CameraModel& camera) const;
};

}  // namespace mono3d::tools
