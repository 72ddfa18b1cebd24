// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <memory>

#include "depth/texture_filter.params.h"
#include "gpu/recorder.h"

namespace mono3d {

// Depth and confidence where the image has texture (shaders/depth/texture_filter.comp).
class TextureFilterStage {
 public:
  explicit TextureFilterStage(std::shared_ptr<Device> device);

  void Record(Recorder& recorder, const TextureFilterParams& params, const Buffer& response,
              const Buffer& inverse_depth, const Buffer& confidence, const Buffer& depth,
              const Buffer& filtered_confidence) const;

 private:
  Kernel kernel_;
};

}  // namespace mono3d
