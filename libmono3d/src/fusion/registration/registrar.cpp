// SPDX-License-Identifier: Apache-2.0
// Copyright the mono3d authors

#include "fusion/registration/registrar.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "fusion/grid.h"
#include "fusion/register.spirv.h"
#include "fusion/register_nearest.spirv.h"
#include "fusion/registration/constraint.h"
#include "fusion/registration/gate.h"

namespace mono3d {
namespace {

// To judge a pose, or to come near it, a quarter of the surfels is enough that finding it takes.
constexpr std::uint32_t kCoarseStride = 4;

// Steps on one level, over every `stride`-th of the surfels that it looks at.
struct Pass {
  int level;
  std::uint32_t stride;
};
constexpr std::array<Pass, 4> kPasses = {{{2, 1}, {1, 1}, {0, kCoarseStride}, {0, 1}}};
constexpr int kMaxStepsPerPass = 6;
// A step that moves the image by less ends a pass, in pixels of its level: the next pass may well
// start farther away.
constexpr double kNearStep_px = 0.1;
// The last step of all is shorter than so many standard errors of the pose: the next one, a part of
// it, would be lost in the noise.
constexpr double kLastStepErrors = 1.5;
// Root mean square of residuals in sigmas that is no reason for a closer look: 1, half as much
// again.
constexpr double kExpectedResidual = 1.5;
// What is common to the errors of a depth map's pixels is at most as large as they are.
constexpr double kLargestOwnMisfit = 1;
// The tracker holds on to what it is told: it is told where it misses by twice what a depth map's
// own error can be.
constexpr double kToldMisfit = 2 * kLargestOwnMisfit;
// Half of the variance of the grey values is explained by the model.
constexpr double kMinCorrelation = 0.7;
// By how much more than it claims a depth map may err: half as much again at a time, about.
constexpr std::array<double, 6> kNoiseFactors = {1, 1.5, 2, 3, 4, 6};
// Surfels in view per pixel below which a pose that is not well known is so for want of overlap;
// else for want of anything in the scene that could tell.
constexpr double kLittleOverlap = 0.25;

// Length of a step in standard errors of the pose that it leads to, root mean square over the
// unknowns. Turning and moving together, which no residual notices, count nothing.
double StandardErrors(const RegistrationSystem& system, const Vector7d& step,
                      std::uint32_t stride) {
  const double independent = std::min(1.0, stride / kPixelsPerMeasurement);
  const double square = independent * step.dot(system.information * step);
  return std::sqrt(std::max(0.0, square) / static_cast<double>(step.size()));
}

// A pose against the tracker's needs twice the evidence.
RegistrationGateOptions Strict(const RegistrationGateOptions& gate) {
  RegistrationGateOptions strict = gate;
  strict.min_agreement = 1 - (1 - gate.min_agreement) / 2;
  strict.max_contradiction = gate.max_contradiction / 2;
  strict.max_residual = gate.max_residual / 2;
  strict.max_grey_residual = gate.max_grey_residual / 2;
  return strict;
}

// Whether a depth map of which too much was believed fits where it is, with what is believed now.
bool LooksLikeNoise(const RegistrationEvidence& evidence, const SurfelMapOptions& options) {
  RegistrationGateOptions gate = options.gate;
  gate.max_contradiction /= 2;  // a wider sigma leaves less to be contradicted by
  const bool has_picture = options.registration.with_grey && evidence.grey_correlation != 0;
  return evidence.registered && evidence.depth_residual <= kExpectedResidual &&
         (!has_picture || evidence.grey_correlation >= kMinCorrelation) &&
         RejectionReason(evidence, gate).empty();
}

bool IsSamePose(const Similarity& a, const Similarity& b) {
  return a.scale() == b.scale() && a.pose().translation() == b.pose().translation() &&
         a.pose().rotation().coeffs() == b.pose().rotation().coeffs();
}

// The share of the model that is where the depth map says counts first, then how exactly.
double Cost(const RegistrationEvidence& evidence) {
  return (evidence.depth_residual * evidence.depth_residual +
          evidence.grey_residual * evidence.grey_residual + 1) /
         std::max(evidence.agreement, 1e-3);
}

// Whether the prediction is where the model shows the depth map, as exactly as that can be told.
bool IsConfirmed(const RegistrationEvidence& evidence, const SurfelMapOptions& options) {
  return evidence.registered && evidence.tracker_misfit <= options.registration.max_misfit &&
         evidence.grey_residual <= kExpectedResidual &&
         evidence.depth_residual <= kExpectedResidual &&
         RejectionReason(evidence, options.gate).empty();
}

// Whether the tracker's pose is not where the model shows the depth map, but too little of that is
// in view to say where it is. The model's word would move all that comes after it.
bool TellsTooLittle(const RegistrationEvidence& evidence, const SurfelMapOptions& options) {
  return evidence.tracker_misfit > options.registration.max_misfit &&
         evidence.overlap < kLittleOverlap &&
         evidence.uncertainty_px > options.gate.max_join_uncertainty_px;
}

// Whether so much of the model lies behind the depth map that it counts against the stricter gate.
// What the model itself hides must then be told from what it shows elsewhere.
bool MuchLiesBehind(const RegistrationEvidence& evidence, const RegistrationGateOptions& gate) {
  const double share_behind = 1 - evidence.agreement - evidence.contradiction;
  return evidence.registered && share_behind > 1 - Strict(gate).min_agreement;
}

// As in shaders/fusion/nearest_cell.glsl.
constexpr int kNearestCell_px = 4;

std::size_t NumNearestCells(const RegisterParams& params) {
  return std::size_t{DivideRoundingUp(params.width_px, kNearestCell_px)} *
         DivideRoundingUp(params.height_px, kNearestCell_px);
}

}  // namespace

Registrar::Registrar(const std::shared_ptr<Device>& device)
    : device_(device),
      register_(device, {"fusion/register", fusion_register_spirv}),
      draw_nearest_(device, {"fusion/register_nearest", fusion_register_nearest_spirv}),
      nearest_(device, sizeof(std::uint32_t), "fusion/nearest") {}

void Registrar::UploadGrey(const DepthMap& map) {
  cv::Mat grey;
  if (map.bgr.empty()) {
    grey = cv::Mat(map.camera.height, map.camera.width, CV_8UC1, cv::Scalar(0));
  } else {
    cv::cvtColor(map.bgr, grey, cv::COLOR_BGR2GRAY);
  }
  cv::Mat level;
  grey.convertTo(level, CV_32F);
  for (Buffer& buffer : grey_) {
    const std::size_t bytes = std::max<std::size_t>(level.total() * sizeof(float), 4);
    if (buffer.size_bytes() != bytes) buffer = Buffer(device_, bytes, "fusion/grey");
    if (level.empty()) continue;
    buffer.Upload(std::span<const float>(level.ptr<float>(), level.total()));
    // Means of 2x2 pixels: the centre of pixel u of the half is that of 2u + 0.5.
    const cv::Size half(level.cols / 2, level.rows / 2);
    cv::Mat next;
    if (!half.empty()) {
      const cv::Rect whole_pairs(0, 0, 2 * half.width, 2 * half.height);
      cv::resize(level(whole_pairs), next, half, 0, 0, cv::INTER_AREA);
    }
    level = next;
  }
}

RegistrationSystem Registrar::Evaluate(Recorder& recorder, const RegisterParams& params,
                                       const AnchorTable& anchors, const DepthMapBuffers& buffers,
                                       const SurfelStorage& surfels, const BlockList& blocks,
                                       StageTimes* times) {
  const std::uint64_t num_listed = std::uint64_t{params.num_blocks} * kSurfelsPerBlock;
  const std::uint32_t num_samples = DivideRoundingUp(num_listed, params.stride);
  const std::uint32_t num_rows = DivideRoundingUp(num_samples, kSurfelsPerRegistrationRow);
  const std::size_t num_floats = std::size_t{num_rows} * kFloatsPerRegistrationRow;
  if (num_rows == 0) return {};
  if (rows_.size_bytes() < num_floats * sizeof(float)) {
    rows_ = Buffer(device_, num_floats * sizeof(float), "fusion/registration_rows");
  }
  if (params.leaves_out_hidden != 0) DrawNearest(recorder, params, anchors, surfels, blocks);
  recorder.Dispatch(register_,
                    {surfels.position_radius(), surfels.normal_weight(), surfels.history(),
                     buffers.depth, buffers.candidate, grey_.at(params.grey_level), blocks.buffer(),
                     surfels.anchor_of_block(), anchors.buffer(), rows_, nearest_},
                    params, GridFor(register_, num_rows));
  recorder.Submit(times);
  downloaded_.resize(num_floats);
  rows_.Download(std::span<float>(downloaded_));
  return SumRegistrationRows(downloaded_);
}

void Registrar::DrawNearest(Recorder& recorder, const RegisterParams& params,
                            const AnchorTable& anchors, const SurfelStorage& surfels,
                            const BlockList& blocks) {
  const std::size_t bytes = NumNearestCells(params) * sizeof(std::uint32_t);
  if (nearest_.size_bytes() < bytes) nearest_ = Buffer(device_, bytes, "fusion/nearest");
  recorder.Fill(nearest_, 0xFFFFFFFFU);
  recorder.Dispatch(draw_nearest_,
                    {surfels.position_radius(), surfels.normal_weight(), blocks.buffer(),
                     surfels.anchor_of_block(), anchors.buffer(), nearest_},
                    params, blocks.grid());
}

// Surfels, depth map, and how to work on them.
struct Registrar::Target {
  Recorder& recorder;
  const DepthMapBuffers& buffers;
  const SurfelStorage& surfels;
  const BlockList& blocks;
  std::span<const Similarity> S_world_anchor;
  const SurfelMapOptions& options;
  StageTimes* times;
  bool leaves_out_hidden = false;  // surfels that others hide
  SurfelsBehind behind = SurfelsBehind::kCount;

  bool with_grey(const DepthMap& map) const {
    return options.registration.with_grey && !map.bgr.empty();
  }
};

// Evaluates the prediction on one level, with fewer surfels than a registration takes.
Registrar::Evaluation Registrar::EvaluateAt(const Target& target,
                                            const RegistrationProblem& problem, int level,
                                            int& num_evaluations) {
  Evaluation evaluation{problem.predicted_S_world_kf, {}, 1};
  RegisterParams params =
      MakeRegisterParams(problem, target.surfels.size(), target.blocks.size(), level);
  anchors_.Set(device_, evaluation.S_world_kf, target.S_world_anchor);
  params.leaves_out_hidden = target.leaves_out_hidden ? 1 : 0;
  if (level == 0) params.stride *= kCoarseStride;
  evaluation.stride = params.stride;
  for (int i = 0; i < (target.with_grey(problem.map) ? 2 : 1); ++i) {
    if (i > 0) SetExposure(params, evaluation.system);
    evaluation.system = Evaluate(target.recorder, params, anchors_, target.buffers, target.surfels,
                                 target.blocks, target.times);
    ++num_evaluations;
  }
  return evaluation;
}

// What the model says of the prediction. Fine texture tells nothing of how far away a pose is that
// is off by pixels, so the coarsest level is asked as well.
Registrar::Assessment Registrar::Assess(const Target& target, const RegistrationProblem& of_tracker,
                                        const Similarity& predicted, int& num_evaluations) {
  RegistrationProblem problem = of_tracker;
  problem.predicted_S_world_kf = predicted;
  double misfit = 0;
  Evaluation evaluation;
  for (const int level : {static_cast<int>(kNumLevels) - 1, 0}) {
    evaluation = EvaluateAt(target, problem, level, num_evaluations);
    misfit = std::max(
        misfit, Misfit(evaluation.system, Solve(problem, evaluation.system, evaluation.S_world_kf,
                                                evaluation.stride)));
  }
  RegistrationEvidence evidence = EvidenceOf(of_tracker, evaluation.system, evaluation.stride,
                                             evaluation.S_world_kf, target.behind);
  evidence.registered = evidence.overlap >= target.options.gate.min_overlap;
  evidence.tracker_misfit = misfit;
  evidence.num_iterations = num_evaluations;
  return {evidence,
          InformationOf(evaluation.system, evaluation.stride, target.options.registration),
          Misfit(evaluation.system, Deviation(of_tracker, predicted))};
}

// Without surfels that others hide, from here on, where many lie behind the depth map.
Registrar::Assessment Registrar::AssessVisible(Target& target,
                                               const RegistrationProblem& of_tracker,
                                               const Similarity& predicted, int& num_evaluations) {
  const Assessment assessment = Assess(target, of_tracker, predicted, num_evaluations);
  if (target.leaves_out_hidden || !MuchLiesBehind(assessment.evidence, target.options.gate)) {
    return assessment;
  }
  target.leaves_out_hidden = true;
  return Assess(target, of_tracker, predicted, num_evaluations);
}

// Gauss-Newton from the prediction, coarse to fine.
Registrar::Evaluation Registrar::Converge(const Target& target, const RegistrationProblem& problem,
                                          int& num_evaluations) {
  Evaluation evaluation{problem.predicted_S_world_kf, {}, 1};
  for (const Pass& pass : kPasses) {
    for (int i = 0; i < kMaxStepsPerPass; ++i) {
      RegisterParams params =
          MakeRegisterParams(problem, target.surfels.size(), target.blocks.size(), pass.level);
      anchors_.Set(device_, evaluation.S_world_kf, target.S_world_anchor);
      params.leaves_out_hidden = target.leaves_out_hidden ? 1 : 0;
      params.stride *= pass.stride;
      if (target.with_grey(problem.map)) SetExposure(params, evaluation.system);
      evaluation.system = Evaluate(target.recorder, params, anchors_, target.buffers,
                                   target.surfels, target.blocks, target.times);
      evaluation.stride = params.stride;
      ++num_evaluations;
      const Vector7d step = Solve(problem, evaluation.system, evaluation.S_world_kf, params.stride);
      evaluation.S_world_kf = Moved(evaluation.S_world_kf, step);
      const bool is_last_pass = &pass == &kPasses.back();
      if (is_last_pass ? StandardErrors(evaluation.system, step, params.stride) < kLastStepErrors
                       : std::ldexp(ImageMotion(problem, step), -pass.level) < kNearStep_px) {
        break;
      }
    }
  }
  return evaluation;
}

// Maximum likelihood of two explanations: the tracker's pose is right, and what separates it from
// the best fit is the depth map's own error, of which a part is common to all its pixels; or the
// tracker is wrong, by anything.
Registration Registrar::Register(Recorder& recorder, const DepthMap& map,
                                 const DepthMapBuffers& buffers, const SurfelStorage& surfels,
                                 const BlockList& blocks,
                                 std::span<const Similarity> S_world_anchor,
                                 const Predictions& predictions, const SurfelMapOptions& options,
                                 StageTimes* times) {
  Target target{recorder, buffers, surfels, blocks, S_world_anchor, options, times};
  const RegistrationProblem of_tracker = MakeProblem(map, options, predictions.front());
  UploadGrey(map);
  if (!options.registration.moves) return Judge(target, of_tracker, predictions.front());
  int num_evaluations = 0;
  RegistrationEvidence best;
  Matrix7d information = Matrix7d::Zero();
  const Similarity* best_start = nullptr;
  bool is_tracker_wrong = false;
  for (const Similarity& predicted : predictions) {
    Assessment assessment = AssessVisible(target, of_tracker, predicted, num_evaluations);
    RegistrationEvidence& evidence = assessment.evidence;
    evidence.moved = &predicted != &predictions.front();
    if (!evidence.moved) is_tracker_wrong = evidence.tracker_misfit > kToldMisfit;
    // With hardly any of the model in view there is nothing to say.
    if (!evidence.registered && best_start == nullptr) return {predicted, evidence, {}, {}, {}};
    if (IsConfirmed(evidence, options))
      return {predicted, evidence,
              {},        assessment.information,
              {},        is_tracker_wrong || assessment.misfit_from_tracker > kToldMisfit};
    if (best_start == nullptr || Cost(evidence) < Cost(best)) {
      best = evidence;
      information = assessment.information;
      best_start = &predicted;
    }
  }
  RegistrationProblem problem = of_tracker;
  problem.predicted_S_world_kf = *best_start;
  const Evaluation found = Converge(target, problem, num_evaluations);
  RegistrationEvidence evidence =
      EvidenceOf(of_tracker, found.system, found.stride, found.S_world_kf);
  evidence.tracker_misfit = Misfit(found.system, Deviation(problem, found.S_world_kf));
  // Seen from afar a misfit is underestimated.
  is_tracker_wrong = is_tracker_wrong ||
                     Misfit(found.system, Deviation(of_tracker, found.S_world_kf)) > kToldMisfit;
  const bool is_better =
      evidence.tracker_misfit > options.registration.max_misfit && Cost(evidence) < Cost(best);
  best.tracker_misfit = evidence.tracker_misfit;
  if (!is_better) evidence = best;
  if (is_better) information = InformationOf(found.system, found.stride, options.registration);
  evidence.registered = true;
  evidence.moved = evidence.moved || is_better;
  evidence.num_iterations = num_evaluations;
  std::string rejection =
      RejectionReason(evidence, is_better ? Strict(options.gate) : options.gate);
  if (rejection.empty() && TellsTooLittle(evidence, options)) {
    evidence.registered = false;
    evidence.moved = false;
    return {predictions.front(), evidence, {}, {}, {}};
  }
  if (!rejection.empty()) {
    const auto tolerated = Tolerate(target, of_tracker, predictions, num_evaluations);
    if (tolerated) return *tolerated;
  }
  return {is_better ? found.S_world_kf : *best_start,
          evidence,
          std::move(rejection),
          information,
          {},
          is_tracker_wrong};
}

// Where the tracker has it, and nowhere else. All poses are of one adjustment, so that a depth map
// behind which most of the model lies is hardly too near: it shows a surface that the model lacks.
// Only what it does not hide can speak for or against it.
Registration Registrar::Judge(Target& target, const RegistrationProblem& of_tracker,
                              const Similarity& predicted) {
  int num_evaluations = 0;
  Assessment assessment = AssessVisible(target, of_tracker, predicted, num_evaluations);
  const RegistrationEvidence& evidence = assessment.evidence;
  if (evidence.registered && evidence.agreement < target.options.gate.min_agreement) {
    target.behind = SurfelsBehind::kAreLeftOut;
    assessment = Assess(target, of_tracker, predicted, num_evaluations);
  }
  if (!evidence.registered) return {predicted, evidence, {}, {}, {}};
  std::string rejection = RejectionReason(evidence, target.options.gate);
  if (!rejection.empty()) {
    const auto tolerated = Tolerate(target, of_tracker, {predicted}, num_evaluations);
    if (tolerated) return *tolerated;
  }
  return {predicted, evidence, std::move(rejection), assessment.information, {}};
}

// A depth map may err more than it claims, by what its pictures do not show: poses that bent it,
// surfaces of hardly any texture. Where no pose is convincing, that and a tracker that knows the
// way explain it, if what is left looks like noise: as large as expected once sigma is widened,
// common to the pixels by no more than the sigma claimed, and of a picture that is the model's. The
// least such noise is taken.
std::optional<Registration> Registrar::Tolerate(const Target& target,
                                                const RegistrationProblem& of_tracker,
                                                const Predictions& predictions,
                                                int& num_evaluations) {
  const double claimed = of_tracker.map.depth_sigma_per_square_depth;
  DepthMap noisy = of_tracker.map;
  std::optional<Registration> best;
  std::vector<Similarity> candidates = predictions;
  for (const double noise : kNoiseFactors) {
    if (noise > target.options.gate.max_noise || candidates.empty()) break;
    noisy.depth_sigma_per_square_depth = noise * claimed;
    const RegistrationProblem problem = MakeProblem(noisy, target.options, predictions.front());
    std::erase_if(candidates, [&](const Similarity& predicted) {
      RegistrationEvidence evidence = Assess(target, problem, predicted, num_evaluations).evidence;
      evidence.moved = !IsSamePose(predicted, predictions.front());
      evidence.noise = noise;
      if (evidence.tracker_misfit > kLargestOwnMisfit) return true;
      if (LooksLikeNoise(evidence, target.options) &&
          (!best || Cost(evidence) < Cost(best->evidence))) {
        best = Registration{predicted, evidence, {}, Matrix7d::Zero(), {}};
      }
      return false;
    });
    if (best) return best;
  }
  return std::nullopt;
}

}  // namespace mono3d
