// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "mono3d/tracking/tracker.h"
#include "tracking/map/frame_record.h"
#include "tracking/map/map.h"

namespace mono3d::tracking {

// What a saved map holds.
struct SavedMap {
  FeatureOptions features;  // of its keyframes; the levels and their scale must stay the same
  std::unique_ptr<Map> map;
  std::vector<FrameRecord> frames;  // that were tracked in it
};

// Version, then everything that tracking in the map needs: camera, points with their patches,
// keyframes with their features, tracked frames; then a checksum. The images of the keyframes are
// left out. Little endian. Numbers survive to the bit, but for the rounding of rotations.
std::string ToBytes(const Map& map, const FeatureOptions& features,
                    const std::vector<FrameRecord>& frames);

// Bytes without their checksum, with it.
std::string WithChecksum(std::string bytes);

// The map gets the id 0; its keyframes count as finalised. `where` names the bytes in messages.
// Throws Error on anything but what ToBytes has made: other files, other versions, bytes cut off or
// changed, references to what is not there.
SavedMap FromBytes(std::string_view bytes, const std::string& where);

}  // namespace mono3d::tracking
