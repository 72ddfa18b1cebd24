// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "fusion/depth_map_buffers.h"
#include "fusion/register.params.h"
#include "fusion/registration_system.h"
#include "fusion/surfel_storage.h"
#include "gpu/buffer.h"
#include "gpu/kernel.h"
#include "gpu/recorder.h"
#include "mono3d/fusion/surfel_map.h"

namespace mono3d {

// Where a depth map belongs in the model.
struct RegisteredView {
  Pose T_world_cam;
  double depth_scale = 1;  // its depths are to be multiplied by this
};

// Where the tracker expects it.
struct Prediction {
  RegisteredView view;
  int num_missed = 0;  // depth maps since the last one that was registered
};

struct Registration {
  RegisteredView view;
  RegistrationEvidence evidence;
  std::string rejection;  // why the depth map must not be fused; empty: it may
};

// One line for people.
std::string Describe(const RegistrationEvidence& evidence);

// The registration of depth maps with the model: Gauss-Newton on three levels, each evaluation one
// dispatch of shaders/fusion/register.comp.
class Registrar {
 public:
  explicit Registrar(const std::shared_ptr<Device>& device);

  // `buffers` hold the depth map as it comes, with its candidates; `prediction` is in the
  // model's world.
  Registration Register(Recorder& recorder, const DepthMap& map, const DepthMapBuffers& buffers,
                        const SurfelStorage& surfels, const Prediction& prediction,
                        const SurfelMapOptions& options, StageTimes* times);

  // One evaluation. `params` as the shader has them.
  RegistrationSystem Evaluate(Recorder& recorder, const RegisterParams& params,
                              const DepthMapBuffers& buffers, const SurfelStorage& surfels,
                              StageTimes* times);
  // Takes over the grey image of the depth map and its two halved ones.
  void UploadGrey(const DepthMap& map);

 private:
  static constexpr std::size_t kNumLevels = 3;

  std::shared_ptr<Device> device_;
  Kernel register_;
  std::array<Buffer, kNumLevels> grey_;
  Buffer rows_;
  std::vector<float> downloaded_;
};

}  // namespace mono3d
