// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/image/image_bundle.h"

#include <string>

#include "mono3d/core/error.h"

namespace mono3d {

void Validate(const ImageBundle& bundle) {
  if (bundle.keyframes.size() != kBundleSize) {
    throw Error(ErrorParts{.what = "wrong number of images in a bundle",
                           .where = {},
                           .expected = std::to_string(kBundleSize),
                           .found = std::to_string(bundle.keyframes.size())});
  }
  const Keyframe& reference = bundle.reference();
  for (const Keyframe& keyframe : bundle.keyframes) {
    Validate(keyframe.frame);
    if (keyframe.frame.bgr.size() != reference.frame.bgr.size()) {
      throw Error(ErrorParts{.what = "images of a bundle differ in size",
                             .where = keyframe.frame.name,
                             .expected = std::to_string(reference.frame.bgr.cols) + "x" +
                                         std::to_string(reference.frame.bgr.rows),
                             .found = std::to_string(keyframe.frame.bgr.cols) + "x" +
                                      std::to_string(keyframe.frame.bgr.rows)});
    }
    if (keyframe.map_id != reference.map_id) {
      throw Error(ErrorParts{.what = "images of a bundle belong to different maps",
                             .where = keyframe.frame.name,
                             .expected = "map " + std::to_string(reference.map_id),
                             .found = "map " + std::to_string(keyframe.map_id)});
    }
  }
}

}  // namespace mono3d
