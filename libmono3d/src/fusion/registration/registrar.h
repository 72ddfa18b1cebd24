// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "fusion/anchor_table.h"
#include "fusion/blocks.h"
#include "fusion/depth_map_buffers.h"
#include "fusion/register.params.h"
#include "fusion/registration/problem.h"
#include "fusion/storage.h"
#include "gpu/buffer.h"
#include "gpu/kernel.h"
#include "gpu/recorder.h"
#include "mono3d/fusion/surfel_map.h"
#include "mono3d/image/keyframe_constraint.h"

namespace mono3d {

// Where the tracker expects a depth map, most trusted first: by its poses as they are, and as the
// last registration has moved them.
using Predictions = std::vector<Similarity>;  // S_world_kf

struct Registration {
  Similarity S_world_kf;
  RegistrationEvidence evidence;
  std::string rejection;  // why the depth map must not be fused; empty: it may
  // Where it was moved: what is known of the pose, see InformationOf, and what the tracker is told.
  Matrix7d information = Matrix7d::Zero();
  std::optional<KeyframeConstraint> constraint;
  // Whether the depth map's own error cannot explain how far the tracker's pose is off.
  bool is_tracker_wrong = false;
};

// The registration of depth maps with the model. A pose of the tracker that the model does not
// contradict stands as it is: over many frames the tracker knows better than one depth map. Where
// none stands, Gauss-Newton on three levels, each evaluation one dispatch of
// shaders/fusion/register.comp.
class Registrar {
 public:
  explicit Registrar(const std::shared_ptr<Device>& device);

  // `buffers` hold the depth map with its candidates; `blocks` what may be in view; one prediction
  // at least. `S_world_anchor`: per anchor of the model.
  Registration Register(Recorder& recorder, const DepthMap& map, const DepthMapBuffers& buffers,
                        const SurfelStorage& surfels, const BlockList& blocks,
                        std::span<const Similarity> S_world_anchor, const Predictions& predictions,
                        const SurfelMapOptions& options, StageTimes* times);

  // One evaluation, of two dispatches where hidden surfels are left out. `params` as the shader has
  // them; `anchors` as the depth map's camera has them.
  RegistrationSystem Evaluate(Recorder& recorder, const RegisterParams& params,
                              const AnchorTable& anchors, const DepthMapBuffers& buffers,
                              const SurfelStorage& surfels, const BlockList& blocks,
                              StageTimes* times);
  // Takes over the grey image of the depth map and its two halved ones.
  void UploadGrey(const DepthMap& map);

 private:
  // One pose, looked at closely.
  struct Evaluation {
    Similarity S_world_kf;
    RegistrationSystem system;
    std::uint32_t stride = 1;
  };
  struct Target;  // what there is to register with

  // Writes nearest_.
  void DrawNearest(Recorder& recorder, const RegisterParams& params, const AnchorTable& anchors,
                   const SurfelStorage& surfels, const BlockList& blocks);

  Evaluation EvaluateAt(const Target& target, const RegistrationProblem& problem, int level,
                        int& num_evaluations);
  // What the model says of one prediction.
  struct Assessment {
    RegistrationEvidence evidence;
    Matrix7d information;
    double misfit_from_tracker = 0;  // of the tracker's pose, were the prediction right; sigmas
  };
  Assessment Assess(const Target& target, const RegistrationProblem& of_tracker,
                    const Similarity& predicted, int& num_evaluations);
  std::optional<Registration> Tolerate(const Target& target, const RegistrationProblem& of_tracker,
                                       const Predictions& predictions, int& num_evaluations);
  Assessment AssessVisible(Target& target, const RegistrationProblem& of_tracker,
                           const Similarity& predicted, int& num_evaluations);
  Registration Judge(Target& target, const RegistrationProblem& of_tracker,
                     const Similarity& predicted);
  Evaluation Converge(const Target& target, const RegistrationProblem& problem,
                      int& num_evaluations);

  static constexpr std::size_t kNumLevels = 3;

  std::shared_ptr<Device> device_;
  Kernel register_;
  Kernel draw_nearest_;
  std::array<Buffer, kNumLevels> grey_;
  AnchorTable anchors_;
  Buffer rows_;
  Buffer nearest_;  // depth of the nearest surfel per cell
  std::vector<float> downloaded_;
};

}  // namespace mono3d
