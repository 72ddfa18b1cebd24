// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "mono3d/pipeline/reconstruction.h"

namespace mono3d {

const char* ToString(AxesSource source) {
  switch (source) {
    case AxesSource::kFirstCamera:
      return "first camera";
    case AxesSource::kLevel:
      return "level";
    case AxesSource::kSavedMap:
      return "saved map";
    case AxesSource::kEarth:
      return "earth";
  }
  return "unknown";
}

}  // namespace mono3d
