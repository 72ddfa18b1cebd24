// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "depth/grey_images.h"

#include <cstddef>
#include <optional>

#include "depth/sweep_geometry.h"

namespace mono3d {

GreyImages GreyImagesOf(const ImageBundle& bundle) {
  GreyImages images;
  images.reference = ToGrey(bundle.reference().frame.bgr);
  for (const std::optional<std::size_t> i : IndicesOfSources(bundle)) {
    images.sources.push_back(i ? ToGrey(bundle.keyframes[*i].frame.bgr) : cv::Mat());
  }
  return images;
}

}  // namespace mono3d
